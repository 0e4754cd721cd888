#include "kpsa/soft_cache.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/soft_cache.cpp"
#include "hwy/foreach_target.h"
#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa {
namespace HWY_NAMESPACE {

// y = matrix * x, column-major [n x n], from column to column; multiply and add are separate, so that a scalar tail
// and every vector width round alike. Blocks of 4 vectors of rows stay in registers over all columns.
void ColumnProduct(const double* HWY_RESTRICT matrix, const double* HWY_RESTRICT x, std::size_t n, bool lower,
                   double* HWY_RESTRICT y) {
  const hn::ScalableTag<double> d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t row = 0;
  for (; row + 4 * lanes <= n; row += 4 * lanes) {
    auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0;
    const std::size_t columns = lower ? row + 4 * lanes : n;  // beyond its diagonal a lower triangle holds zeros
    for (std::size_t j = 0; j < columns; ++j) {
      const double* column = matrix + j * n + row;
      const auto factor = hn::Set(d, x[j]);
      s0 = hn::Add(s0, hn::Mul(hn::LoadU(d, column), factor));
      s1 = hn::Add(s1, hn::Mul(hn::LoadU(d, column + lanes), factor));
      s2 = hn::Add(s2, hn::Mul(hn::LoadU(d, column + 2 * lanes), factor));
      s3 = hn::Add(s3, hn::Mul(hn::LoadU(d, column + 3 * lanes), factor));
    }
    hn::StoreU(s0, d, y + row);
    hn::StoreU(s1, d, y + row + lanes);
    hn::StoreU(s2, d, y + row + 2 * lanes);
    hn::StoreU(s3, d, y + row + 3 * lanes);
  }
  for (; row < n; ++row) {
    double sum = 0;
    const std::size_t columns = lower ? row + 1 : n;
    for (std::size_t j = 0; j < columns; ++j) sum = sum + matrix[j * n + row] * x[j];
    y[row] = sum;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace kpsa {

HWY_EXPORT(ColumnProduct);

namespace {

constexpr double kQuantile = 0.99;

double Quantile(std::vector<double> values, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

// |block * g| for a block of h x h, column-major.
double BlockNorm(const double* block, const double* g, std::size_t h) {
  double sum = 0;
  for (std::size_t i = 0; i < h; ++i) {
    double value = 0;
    for (std::size_t j = 0; j < h; ++j) value = value + block[j * h + i] * g[j];
    sum = sum + value * value;
  }
  return std::sqrt(sum);
}

Index FirstNotFinite(const SoftCacheModel& model, std::span<const double> y) {
  for (std::size_t k = 0; k < model.cues(); ++k) {
    for (Index j = model.offsets[k]; j < model.offsets[k + 1]; ++j) {
      if (!std::isfinite(y[j])) return static_cast<Index>(k);
    }
  }
  return kNoIndex;
}

}  // namespace

void MultiplyVector(std::span<const double> matrix, std::span<const double> x, bool lower, std::span<double> y) {
  KPSA_DCHECK(matrix.size() == x.size() * x.size() && y.size() >= x.size());
  HWY_DYNAMIC_DISPATCH(ColumnProduct)(matrix.data(), x.data(), x.size(), lower, y.data());
}

double FullWeight(double score, const SoftCacheThreshold& threshold) {
  if (threshold.tau == std::numeric_limits<double>::infinity()) return std::isfinite(score) ? 0.0 : 1.0;
  if (!(threshold.tau > 0) || !(score < threshold.tau)) return 1;
  const double lo = threshold.tau_lo();
  if (score <= lo) return 0;
  const double t = (score - lo) / (threshold.tau - lo);
  return t * t * (3 - 2 * t);
}

SoftCacheModel MakeSoftCacheModel(const Estimator& estimator, const CueSet& cues, const Eigen::MatrixXd& training) {
  KPSA_CHECK_EQ(training.rows(), cues.rows());
  SoftCacheModel model;
  model.mode = estimator.mode;
  model.offsets = cues.offsets;
  model.judge.assign(estimator.judge.data(), estimator.judge.data() + estimator.judge.size());
  for (std::size_t k = 0; k < cues.cues.size() && model.mode == EstimatorMode::kMap; ++k) {
    const auto begin = static_cast<Eigen::Index>(cues.offsets[k]);
    const Eigen::Index height = static_cast<Eigen::Index>(cues.offsets[k + 1]) - begin;
    Eigen::MatrixXd block = estimator.judge.block(begin, begin, height, height);
    block = block.llt().solve(Eigen::MatrixXd::Identity(height, height)).eval();
    // The error of a scalar counts by the displacement it stands for, so that all cues speak of lengths
    if (cues.cues[k].kind == CueKind::kScalar) block *= estimator.gain.col(begin).cwiseAbs().maxCoeff();
    model.leave_one_out.insert(model.leave_one_out.end(), block.data(), block.data() + block.size());
  }

  // Quantiles over the training poses; the floors keep a score of pure rounding from becoming a large one
  std::vector<double> scores1, scores2, scratch(model.rows());
  for (Eigen::Index t = 0; t < training.cols(); ++t) {
    const RawScores raw = ComputeRawScores(model, {training.col(t).data(), model.rows()}, scratch);
    scores1.push_back(raw.score1);
    scores2.push_back(raw.score2);
  }
  const double noise = cues.rows() == 0 ? 0 : std::sqrt(cues.noise.minCoeff());
  const double floor1 = model.mode == EstimatorMode::kPaper ? noise : 1e-6 * static_cast<double>(model.rows());
  model.quantile1 = std::max({scores1.empty() ? 0 : Quantile(scores1, kQuantile), floor1, std::numeric_limits<double>::min()});
  model.quantile2 = std::max({scores2.empty() ? 0 : Quantile(scores2, kQuantile), noise, std::numeric_limits<double>::min()});
  return model;
}

RawScores ComputeRawScores(const SoftCacheModel& model, std::span<const double> y, std::span<double> scratch) {
  const std::size_t rows = model.rows();
  KPSA_DCHECK(y.size() >= rows && scratch.size() >= rows);
  MultiplyVector(model.judge, y.first(rows), false, scratch);
  RawScores raw;
  double largest = -1;
  const double* block = model.leave_one_out.data();
  for (std::size_t k = 0; k < model.cues(); ++k) {
    const std::size_t begin = model.offsets[k], height = model.offsets[k + 1] - begin;
    double norm;
    if (model.mode == EstimatorMode::kMap) {
      norm = BlockNorm(block, scratch.data() + begin, height);
      block += height * height;
      raw.score2 = std::max(raw.score2, norm);
    } else {
      norm = 0;
      for (std::size_t j = begin; j < begin + height; ++j) norm = norm + scratch[j] * scratch[j];
    }
    if (norm > largest) largest = norm, raw.worst_cue = static_cast<Index>(k);
  }
  double sum = 0;
  for (std::size_t j = 0; j < rows; ++j) sum = sum + (model.mode == EstimatorMode::kMap ? y[j] : scratch[j]) * scratch[j];
  raw.score1 = model.mode == EstimatorMode::kMap ? std::max(0.0, sum) : std::sqrt(sum);
  return raw;
}

Verdict Judge(const SoftCacheModel& model, const SoftCacheThreshold& threshold, std::span<const double> y,
              std::span<double> scratch) {
  Verdict verdict;
  verdict.offender = FirstNotFinite(model, y);
  RawScores raw;
  if (verdict.offender == kNoIndex) raw = ComputeRawScores(model, y, scratch);
  verdict.score = std::max(raw.score1 / model.quantile1, raw.score2 / model.quantile2);
  if (verdict.offender != kNoIndex || !std::isfinite(verdict.score)) {  // huge measurements overflow the score
    verdict.score = std::numeric_limits<double>::infinity();
    verdict.full_weight = 1;
    verdict.hit = false;
    verdict.reason = MissReason::kNotFinite;
    if (verdict.offender == kNoIndex) verdict.offender = raw.worst_cue;
    return verdict;
  }
  verdict.full_weight = FullWeight(verdict.score, threshold);
  verdict.hit = verdict.full_weight == 0;
  if (!verdict.hit) {
    verdict.reason = threshold.tau > 0 ? MissReason::kScore : MissReason::kNeverHit;
    verdict.offender = raw.worst_cue;
  }
  return verdict;
}

TrainedRange MakeTrainedRange(std::string plug, double min, double max, double margin) {
  const double widened = margin * (max - min) + 1e-6 * std::max({1.0, std::fabs(min), std::fabs(max)});
  return {std::move(plug), min - widened, max + widened};
}

Index FirstOutside(std::span<const TrainedRange> ranges, std::span<const double> values) {
  KPSA_DCHECK(ranges.size() == values.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    if (!(values[i] >= ranges[i].lo && values[i] <= ranges[i].hi)) return static_cast<Index>(i);
  }
  return kNoIndex;
}

std::string OutsideMessage(const TrainedRange& range, double value) {
  return fmt::format("{} = {:.6g} is outside its trained range [{:.6g}, {:.6g}]", range.plug, value, range.lo, range.hi);
}

}  // namespace kpsa
#endif  // HWY_ONCE
