#include "kpsa/training/pca.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxGram =
    8000;  // side of the Gram matrix above which kAuto takes the randomised method

// Sum of squares of every column. [D]; the result has a NaN or infinity where the poses have one.
Eigen::VectorXd ColumnEnergies(const PoseMatrix& poses) {
  Eigen::VectorXd energy = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(poses.columns()));
  ParallelFor(poses.columns(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pose = 0; pose < poses.poses(); ++pose) {
      const std::span<const float> values = poses.row(pose);
      for (std::size_t i = begin; i < end; ++i) {
        energy[static_cast<Eigen::Index>(i)] +=
            static_cast<double>(values[i]) * static_cast<double>(values[i]);
      }
    }
  });
  return energy;
}

// Square roots of the column weights. [D]
std::vector<double> ColumnScales(const PoseLayout& layout, const PcaOptions& options,
                                 const Eigen::VectorXd& variance) {
  std::vector<double> scale(layout.columns(), 1.0);
  for (std::size_t i = 0; i < layout.outputs() && !options.point_weights.empty(); ++i) {
    scale[i] = std::sqrt(options.point_weights[i / static_cast<std::size_t>(layout.components)]);
  }
  for (std::size_t i = layout.stage_begin(); i < layout.scalar_begin(); ++i)
    scale[i] = std::sqrt(options.stage_weight);
  for (std::size_t i = layout.scalar_begin(); i < layout.columns(); ++i) {
    const double deviation = std::sqrt(variance[static_cast<Eigen::Index>(i)]);
    scale[i] = deviation > 0 ? std::sqrt(options.scalar_weight) / deviation : 0;
  }
  return scale;
}

// How many modes are not rounding. energies: S_k^2, descending
Eigen::Index Kept(const Eigen::VectorXd& energies, Eigen::Index wanted, double min_ratio) {
  Eigen::Index kept = 0;
  while (kept < wanted && energies[kept] > min_ratio * min_ratio * energies[0]) ++kept;
  return kept;
}
// Of the eigenvectors of X X^T, or of that of an image of it: what turns it into modes of unit length.
Eigen::MatrixXd ToUnitModes(const SymmetricEigen& eigen, Eigen::Index wanted, double min_ratio) {
  const Eigen::Index kept = Kept(eigen.values, wanted, min_ratio);
  return eigen.vectors.leftCols(kept) * eigen.values.head(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

// Approximately orthonormal modes [columns x m], before the finish.
Eigen::MatrixXd RoughModes(const PoseMatrix& poses, std::size_t columns, std::span<const double> scale,
                           const PcaOptions& options) {
  const GemmOperand x = GemmOperand::Poses(poses, 0, poses.poses(), 0, columns, scale);  // X [T x columns]
  const std::size_t small = std::min(poses.poses(), columns);
  const auto wanted =
      static_cast<Eigen::Index>(std::min<std::size_t>(static_cast<std::size_t>(options.max_modes), small));
  const bool randomised = options.method == PcaOptions::Method::kRandomised ||
                          (options.method == PcaOptions::Method::kAuto && small > kMaxGram);
  if (randomised) {
    // Range finder on the side of the poses; orthonormalised in every step, or small modes drown
    const Eigen::Index width = std::min<Eigen::Index>(wanted + 20, static_cast<Eigen::Index>(small));
    Eigen::MatrixXd image = RandomNormal(static_cast<Eigen::Index>(columns), width, options.seed), range;
    Multiply(x, GemmOperand::Dense(image), &range);
    Orthonormalize(&range);
    for (int i = 0; i < options.power_iterations; ++i) {
      Multiply(x.Transposed(), GemmOperand::Dense(range), &image);
      Orthonormalize(&image);
      Multiply(x, GemmOperand::Dense(image), &range);
      Orthonormalize(&range);
    }
    Multiply(x.Transposed(), GemmOperand::Dense(range), &image);
    const SymmetricEigen eigen = AllEigen(Gram(GemmOperand::Dense(image).Transposed()));
    return Multiply(image, ToUnitModes(eigen, wanted, options.min_ratio));
  }
  if (poses.poses() <= columns) {
    const Eigen::MatrixXd vectors =
        ToUnitModes(LargestEigen(Gram(x), wanted, options.seed), wanted, options.min_ratio);
    return Multiply(x.Transposed(), GemmOperand::Dense(vectors));
  }
  const SymmetricEigen eigen = LargestEigen(Gram(x.Transposed()), wanted, options.seed);
  return eigen.vectors.leftCols(Kept(eigen.values, wanted, options.min_ratio));
}

Status CheckInput(const PoseMatrix& poses, const Eigen::VectorXd& mean, const PcaOptions& options) {
  if (poses.poses() < 2)
    return Status::Invalid("a subspace needs at least 2 training poses, there are {}", poses.poses());
  if (poses.layout().outputs() == 0) return Status::Invalid("the training poses have no points");
  if (options.max_modes < 1)
    return Status::Invalid("the number of modes is {}, expected at least 1", options.max_modes);
  if (!mean.allFinite()) return Status::Invalid("a training pose holds a NaN or an infinity");
  if (!options.point_weights.empty() && options.point_weights.size() != poses.layout().points) {
    return Status::Invalid("there are {} point weights for {} points", options.point_weights.size(),
                           poses.layout().points);
  }
  for (std::size_t i = 0; i < options.point_weights.size(); ++i) {
    if (!(options.point_weights[i] > 0) || !std::isfinite(options.point_weights[i])) {
      return Status::Invalid("the weight of point {} is {}, expected a positive number", i,
                             options.point_weights[i]);
    }
  }
  return {};
}

}  // namespace

Eigen::VectorXd Pca::mode_variance() const {
  return singular.array().square() / static_cast<double>(poses - 1);
}

double Pca::output_noise() const {
  return std::max(0.0, discarded_energy()) /
         (static_cast<double>(poses - 1) * static_cast<double>(layout.outputs()));
}

Result<Pca> ComputePca(const PoseMatrix& poses, const Eigen::VectorXd& mean, const PcaOptions& options) {
  KPSA_CHECK(poses.centered());
  KPSA_CHECK_EQ(static_cast<std::size_t>(mean.size()), poses.columns());
  KPSA_RETURN_IF_ERROR(CheckInput(poses, mean, options));
  Pca pca;
  pca.layout = poses.layout();
  pca.poses = poses.poses();
  pca.mean = mean;
  const Eigen::VectorXd energies = ColumnEnergies(poses);
  if (!energies.allFinite()) return Status::Invalid("a training pose holds a NaN or an infinity");
  pca.row_variance = energies / static_cast<double>(pca.poses - 1);

  // Which columns are decomposed, and with what weight
  const std::vector<double> scale = ColumnScales(pca.layout, options, pca.row_variance);
  const bool joint = options.stage_weight > 0 || options.scalar_weight > 0;
  const std::size_t columns = joint ? pca.layout.columns() : pca.layout.outputs();
  const auto width = static_cast<Eigen::Index>(columns);
  const bool weighted = joint || !options.point_weights.empty();
  const std::span<const double> used_scale =
      weighted ? std::span<const double>(scale) : std::span<const double>();
  for (std::size_t i = 0; i < columns; ++i)
    pca.total_energy += energies[static_cast<Eigen::Index>(i)] * scale[i] * scale[i];
  if (!(pca.total_energy > 0))
    return Status::Invalid(
        "nothing moves in the {} training poses: widen the controls, or name clips that move these points",
        pca.poses);
  pca.output_orthonormal = !weighted;

  // Modes, then the finish: orthonormal columns A, coordinates P = X A, and the SVD of P turns both into X =
  // U S A^T
  Eigen::MatrixXd modes = RoughModes(poses, columns, used_scale, options);
  Orthonormalize(&modes);
  const GemmOperand x = GemmOperand::Poses(poses, 0, pca.poses, 0, columns, used_scale);
  ThinSvd svd = TallSvd(Multiply(x, GemmOperand::Dense(modes)));
  Eigen::Index kept = 0;
  while (kept < svd.values.size() && svd.values[kept] > options.min_ratio * svd.values[0]) ++kept;
  pca.singular = svd.values.head(kept);
  modes = Multiply(modes, svd.v.leftCols(kept));
  Orthonormalize(&modes);

  // All columns: those decomposed without their weight, the others by regression on the coordinates
  pca.modes.resize(static_cast<Eigen::Index>(pca.layout.columns()), kept);
  pca.modes.topRows(width) = modes;
  if (columns < pca.layout.columns() || joint) {
    const Eigen::MatrixXd factor =
        svd.u.leftCols(kept) * pca.singular.cwiseInverse().asDiagonal();  // [T x M]
    const std::size_t begin = pca.layout.outputs(), end = pca.layout.columns();
    pca.modes.bottomRows(static_cast<Eigen::Index>(end - begin)) = Multiply(
        GemmOperand::Poses(poses, 0, pca.poses, begin, end).Transposed(), GemmOperand::Dense(factor));
  }
  if (weighted) {
    for (std::size_t i = 0; i < pca.layout.outputs(); ++i)
      pca.modes.row(static_cast<Eigen::Index>(i)) /= scale[i];
  }
  const Eigen::VectorXd explained = pca.modes.array().square().matrix() * pca.mode_variance();
  pca.row_residual = (pca.row_variance - explained).cwiseMax(0.0);
  return pca;
}

Pca TruncatedPca(const Pca& pca, Eigen::Index modes) {
  Pca result = pca;
  modes = std::clamp<Eigen::Index>(modes, 1, pca.mode_count());
  result.modes = pca.modes.leftCols(modes);
  result.singular = pca.singular.head(modes);
  const Eigen::VectorXd explained = result.modes.array().square().matrix() * result.mode_variance();
  result.row_residual = (result.row_variance - explained).cwiseMax(0.0);
  return result;
}

}  // namespace kpsa::engine
