#include "kpsa/training/estimator.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kSurveyBytes = 192'000'000;  // of estimates at a time

Eigen::VectorXd Reach(const Eigen::MatrixXd& gain) {
  if (gain.rows() == 0) return Eigen::VectorXd::Zero(gain.cols());
  return gain.cwiseAbs().colwise().maxCoeff().transpose();
}

// covariance P [M x M] of the mode coordinates, cues C [r x M] -> G, its factors and B.
Estimator MapWithCovariance(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::MatrixXd& c,
                            const Eigen::MatrixXd& p, const Eigen::VectorXd& noise, EstimatorParts parts) {
  Estimator estimator;
  const Eigen::MatrixXd cp = Multiply(c, p);  // [r x M]
  estimator.covariance = Multiply(cp, c.transpose());
  estimator.covariance = (0.5 * (estimator.covariance + estimator.covariance.transpose())).eval();
  estimator.covariance.diagonal() += noise;
  const Eigen::Index r = c.rows();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(estimator.covariance);
  KPSA_CHECK(cholesky.info() == Eigen::Success);  // the noise is positive
  estimator.whitening = cholesky.matrixL().solve(Eigen::MatrixXd::Identity(r, r));
  estimator.judge = TransposedProduct(estimator.whitening, estimator.whitening);
  estimator.judge = (0.5 * (estimator.judge + estimator.judge.transpose())).eval();
  estimator.coordinates = cholesky.solve(cp).transpose();
  if (parts == EstimatorParts::kNoGain) return estimator;
  if (parts == EstimatorParts::kAll) {
    estimator.gain = Multiply(a, estimator.coordinates);
    estimator.reach = Reach(estimator.gain);
    return estimator;
  }
  constexpr Eigen::Index kColumns = 64;  // of B at a time
  estimator.reach.resize(r);
  for (Eigen::Index first = 0; first < r; first += kColumns) {
    const Eigen::Index count = std::min(kColumns, r - first);
    const Eigen::MatrixXd q = estimator.coordinates.middleCols(first, count);
    estimator.reach.segment(first, count) = Reach(Multiply(a, q));
  }
  return estimator;
}

}  // namespace

Estimator MapEstimator(const Pca& pca, const CueSet& cues, EstimatorParts parts) {
  return MapWithCovariance(pca.output_modes(), cues.loadings, pca.mode_variance().asDiagonal(), cues.noise,
                           parts);
}

Estimator RotatedMapEstimator(const Pca& pca, const CueSet& cues, const Eigen::MatrixXd& rotation) {
  const Eigen::MatrixXd covariance = rotation.transpose() * pca.mode_variance().asDiagonal() * rotation;
  return MapWithCovariance(Multiply(pca.output_modes(), rotation), Multiply(cues.loadings, rotation),
                           covariance, cues.noise, EstimatorParts::kAll);
}

Estimator LeastSquaresEstimator(const Pca& pca, const CueSet& cues) {
  const Eigen::MatrixXd& c = cues.loadings;
  const Eigen::Index r = c.rows(), m = c.cols();
  Estimator estimator = MapEstimator(pca, cues);
  if (r < m) {
    estimator.warning =
        fmt::format("{} measured values cannot determine {} modes; the MAP estimate is used instead", r, m);
    return estimator;
  }
  const ThinSvd svd = TallSvd(c);
  const double smallest = svd.values[m - 1];
  estimator.condition = smallest > 0 ? svd.values[0] / smallest : std::numeric_limits<double>::infinity();
  if (!(estimator.condition <= kMaxCondition)) {
    estimator.warning = fmt::format(
        "the key points determine the modes badly (condition number {:.3g}, at most {:g} is good); "
        "the MAP estimate is used instead",
        estimator.condition, kMaxCondition);
    return estimator;
  }
  // p = R^-1 Q^T y, the residual is (I - Q Q^T) y
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(c);
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(r, m);
  estimator.mode = EstimatorMode::kPaper;
  estimator.coordinates = qr.matrixQR().topRows(m).triangularView<Eigen::Upper>().solve(q.transpose());
  estimator.gain = Multiply(pca.output_modes(), estimator.coordinates);
  estimator.reach = Reach(estimator.gain);
  estimator.judge = Eigen::MatrixXd::Identity(r, r) - q * q.transpose();
  estimator.judge = (0.5 * (estimator.judge + estimator.judge.transpose())).eval();
  return estimator;
}

Eigen::VectorXd MeasuredCues(const PoseLayout& layout, const CueSet& cues,
                             std::span<const float> centered_row) {
  Eigen::VectorXd y(cues.rows());
  for (std::size_t k = 0; k < cues.cues.size(); ++k) {
    const std::size_t column = CueColumn(layout, cues.cues[k]);
    for (Index j = cues.offsets[k]; j < cues.offsets[k + 1]; ++j) {
      const auto row = static_cast<Eigen::Index>(j);
      y[row] = static_cast<double>(centered_row[column + j - cues.offsets[k]]) * cues.scale[row];
    }
  }
  return y;
}

Eigen::MatrixXd MeasuredPoses(const PoseLayout& layout, const CueSet& cues, const PoseMatrix& centered) {
  Eigen::MatrixXd y(cues.rows(), static_cast<Eigen::Index>(centered.poses()));
  for (std::size_t t = 0; t < centered.poses(); ++t)
    y.col(static_cast<Eigen::Index>(t)) = MeasuredCues(layout, cues, centered.row(t));
  return y;
}

std::vector<PoseErrors> EstimateErrors(const Pca& pca, const CueSet& cues, const Estimator& estimator,
                                       const PoseMatrix& poses) {
  KPSA_CHECK(poses.centered() && poses.layout() == pca.layout);
  const std::size_t outputs = pca.layout.outputs(), kChunk = 384;
  const auto components = static_cast<Eigen::Index>(pca.layout.components);
  const Eigen::MatrixXd a = pca.output_modes();
  Eigen::LDLT<Eigen::MatrixXd> gram;
  if (!pca.output_orthonormal) gram.compute(Gram(GemmOperand::Dense(a).Transposed()));
  std::vector<PoseErrors> errors;
  for (std::size_t first = 0; first < poses.poses(); first += kChunk) {
    const std::size_t count = std::min(kChunk, poses.poses() - first);
    const GemmOperand x = GemmOperand::Poses(poses, first, count, 0, outputs);
    Eigen::MatrixXd best = Multiply(GemmOperand::Dense(a).Transposed(), x.Transposed());  // [M x count]
    if (!pca.output_orthonormal) best = gram.solve(best);
    Eigen::MatrixXd y(cues.rows(), static_cast<Eigen::Index>(count));
    for (std::size_t t = 0; t < count; ++t)
      y.col(static_cast<Eigen::Index>(t)) = MeasuredCues(pca.layout, cues, poses.row(first + t));
    const Eigen::MatrixXd estimated = estimator.coordinates * y;
    const Eigen::MatrixXd projected = Multiply(a, best), reached = Multiply(a, estimated);
    for (std::size_t t = 0; t < count; ++t) {
      const auto column = static_cast<Eigen::Index>(t);
      const Eigen::VectorXd f =
          Eigen::Map<const Eigen::VectorXf>(poses.row(first + t).data(), static_cast<Eigen::Index>(outputs))
              .cast<double>();
      const Eigen::VectorXd difference = f - reached.col(column);
      PoseErrors e;
      e.projection = (f - projected.col(column)).norm();
      e.cue = (projected.col(column) - reached.col(column)).norm();
      e.total = difference.norm();
      const Eigen::Map<const Eigen::MatrixXd> by_point(difference.data(), components,
                                                       difference.size() / components);
      e.largest = std::sqrt(by_point.colwise().squaredNorm().maxCoeff());
      errors.push_back(e);
    }
  }
  return errors;
}

PointSurvey SurveyPoints(const Pca& pca, const CueSet& cues, const Estimator& estimator,
                         const PoseMatrix& poses, std::size_t stride, double limit) {
  KPSA_CHECK(poses.centered() && poses.layout() == pca.layout && stride > 0);
  const std::size_t points = pca.layout.points;
  const auto components = static_cast<std::size_t>(pca.layout.components);
  const Eigen::Ref<const Eigen::MatrixXd> a = pca.output_modes();
  const std::size_t chunk =  // poses at a time
      std::clamp<std::size_t>(
          kSurveyBytes / (sizeof(double) * std::max<std::size_t>(1, pca.layout.outputs())), 24, 384);
  PointSurvey survey;
  survey.largest.resize(points);
  survey.beyond.resize(points);
  Eigen::MatrixXd reached;
  for (std::size_t first = 0; first < poses.poses(); first += chunk * stride) {
    std::vector<std::size_t> chosen;
    for (std::size_t t = first; t < poses.poses() && chosen.size() < chunk; t += stride) chosen.push_back(t);
    Eigen::MatrixXd y(cues.rows(), static_cast<Eigen::Index>(chosen.size()));
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      y.col(static_cast<Eigen::Index>(k)) = MeasuredCues(pca.layout, cues, poses.row(chosen[k]));
    }
    const Eigen::MatrixXd coordinates = Multiply(estimator.coordinates, y);
    MultiplyFloats(GemmOperand::Dense(a), GemmOperand::Dense(coordinates), &reached);
    std::vector<std::atomic<double>> worst(chosen.size());
    ParallelFor(points, 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = 0; k < chosen.size(); ++k) {
        const float* pose = poses.row(chosen[k]).data();
        const double* estimate = reached.col(static_cast<Eigen::Index>(k)).data();
        double most = 0;
        for (std::size_t i = begin; i < end; ++i) {
          double squared = 0;
          for (std::size_t c = components * i; c < components * (i + 1); ++c) {
            squared +=
                (static_cast<double>(pose[c]) - estimate[c]) * (static_cast<double>(pose[c]) - estimate[c]);
          }
          if (std::isnan(squared)) squared = std::numeric_limits<double>::infinity();
          survey.largest[i] = std::max(survey.largest[i], squared);
          survey.beyond[i] += squared > limit * limit;
          most = std::max(most, squared);
        }
        double before = worst[k];
        while (before < most && !worst[k].compare_exchange_weak(before, most)) {
        }
      }
    });
    for (const auto& squared : worst) survey.by_pose.push_back(std::sqrt(squared));
  }
  for (double& value : survey.largest) value = std::sqrt(value);
  return survey;
}

std::size_t PointSurvey::poses_beyond(double limit) const {
  return static_cast<std::size_t>(
      std::count_if(by_pose.begin(), by_pose.end(), [&](double error) { return error > limit; }));
}

double RmsError(const std::vector<PoseErrors>& errors, std::size_t points) {
  double sum = 0;
  for (const PoseErrors& e : errors) sum += e.total * e.total;
  return errors.empty() ? 0
                        : std::sqrt(sum / (static_cast<double>(errors.size()) * static_cast<double>(points)));
}

}  // namespace kpsa::engine
