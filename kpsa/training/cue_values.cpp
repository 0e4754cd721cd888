#include "kpsa/training/cue_values.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"

namespace kpsa::engine {
namespace {

constexpr double kLeastDeterminant = 1e-9;  // of a matrix that is inverted
constexpr std::size_t kScalePoses = 16;     // that say how a joint is scaled
constexpr double kAlmostRotation = 4;       // axes of so many times the length, or one so many times shorter

}  // namespace

Affine RelativeMatrix(const PoseLayout& layout, std::span<const float> row, const Eigen::VectorXd* mean,
                      Index first_entry) {
  const std::size_t first = layout.scalar_begin() + first_entry;
  Affine matrix;
  for (std::size_t e = 0; e < 12; ++e) {
    matrix.data()[e] = static_cast<double>(row[first + e]) +
                       (mean == nullptr ? 0 : (*mean)[static_cast<Eigen::Index>(first + e)]);
  }
  return matrix;
}

double JointScale(const PoseMatrix& poses, const Eigen::VectorXd* mean, Index first_entry) {
  const std::size_t stride = std::max<std::size_t>(1, poses.poses() / kScalePoses);
  double sum = 0, count = 0;
  for (std::size_t t = 0; t < poses.poses(); t += stride, count += 3)
    sum += RelativeMatrix(poses.layout(), poses.row(t), mean, first_entry).leftCols<3>().squaredNorm();
  const double length = count > 0 ? std::sqrt(sum / count) : 0;
  if (!(length > 0) || (length < kAlmostRotation && length > 1 / kAlmostRotation)) return 1;
  return std::exp2(std::round(std::log2(length)));
}

std::optional<Affine> InverseOf(const Affine& matrix) {
  const Eigen::Matrix3d turn = matrix.leftCols<3>();
  if (!(std::fabs(turn.determinant()) > kLeastDeterminant)) return std::nullopt;
  Affine inverse;
  inverse.leftCols<3>() = turn.inverse();
  inverse.col(3) = -(inverse.leftCols<3>() * matrix.col(3));
  return inverse;
}

Affine Product(const Affine& a, const Affine& b) {
  Affine product = a.leftCols<3>() * b;
  product.col(3) += a.col(3);
  return product;
}

void CueReader::Read(const CueRef& cue, double* values) {
  const std::size_t column = CueColumn(layout_, cue), height = CueHeight(layout_, cue);
  if (cue.joint == kNoIndex) {
    for (std::size_t k = 0; k < height; ++k) values[k] = At(column + k);
    return;
  }
  auto back = back_.find(cue.joint);
  if (back == back_.end()) {
    const std::optional<Affine> inverse = InverseOf(RelativeMatrix(layout_, row_, mean_, cue.joint));
    back = back_.emplace(cue.joint, inverse.value_or(Affine::Identity())).first;
  }
  if (cue.kind == CueKind::kScalar) {
    const Index entry = (cue.index - layout_.relative_begin) % 12;
    const Affine matrix = Product(back->second, RelativeMatrix(layout_, row_, mean_, cue.index - entry));
    values[0] = matrix.data()[entry];
    return;
  }
  const Eigen::Vector3d point(At(column), At(column + 1), At(column + 2));
  Eigen::Map<Eigen::Vector3d>{values} = back->second.leftCols<3>() * point + back->second.col(3);
}

CueSet MeasureCues(const PoseMatrix& poses, const Eigen::VectorXd& mean, std::span<const CueRef> cues,
                   Eigen::MatrixXd* measured) {
  const PoseLayout& layout = poses.layout();
  CueSet set;
  set.cues.assign(cues.begin(), cues.end());
  set.offsets.push_back(0);
  for (const CueRef& cue : cues)
    set.offsets.push_back(set.offsets.back() + static_cast<Index>(CueHeight(layout, cue)));
  const auto rows = static_cast<Eigen::Index>(set.offsets.back());
  measured->resize(rows, static_cast<Eigen::Index>(poses.poses()));
  ParallelFor(poses.poses(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      CueReader reader(layout, poses.row(t), &mean);
      double* const y = measured->col(static_cast<Eigen::Index>(t)).data();
      for (std::size_t k = 0; k < cues.size(); ++k) reader.Read(cues[k], y + set.offsets[k]);
    }
  });
  set.mean = measured->rowwise().mean();
  measured->colwise() -= set.mean;
  set.scale = Eigen::VectorXd::Ones(rows);
  for (std::size_t k = 0; k < cues.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(set.offsets[k]);
    const double variance = measured->row(row).squaredNorm() / static_cast<double>(poses.poses());
    if (cues[k].kind == CueKind::kScalar && variance > 0) set.scale[row] = 1 / std::sqrt(variance);
    if (cues[k].kind != CueKind::kScalar && cues[k].joint != kNoIndex)
      set.scale.segment(row, 3).setConstant(JointScale(poses, &mean, cues[k].joint));
  }
  *measured = set.scale.asDiagonal() * *measured;
  return set;
}

}  // namespace kpsa::engine
