#include "kpsa/soft_cache.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/soft_cache.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// Sums of sixteen are added in halves, whatever the width of the target.
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
template <class D, class V>
HWY_INLINE float SumInHalves(D d, V v) {
  HWY_ALIGN float lanes[HWY_MAX_BYTES / sizeof(float)];
  hn::Store(v, d, lanes);
  for (std::size_t half = hn::Lanes(d) / 2; half >= 1; half /= 2) {
    for (std::size_t k = 0; k < half; ++k) lanes[k] = lanes[k] + lanes[k + half];
  }
  return lanes[0];
}
#else
template <class D, class V>
HWY_INLINE float SumInHalves(D d, V v) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    return hn::GetLane(v);
  } else {
    const hn::Half<D> half;
    return SumInHalves(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
  }
}
#endif

// Up to 16 rows of F against y, four by four, sixteen columns at a time: w, and g += F_rows^T w. Returns
// |w|^2.
float Rows(const float* HWY_RESTRICT rows, std::size_t fours, std::size_t groups, const float* HWY_RESTRICT y,
           float* HWY_RESTRICT g) {
  const hn::CappedTag<float, 16> d;
  constexpr std::size_t kLanes = HWY_MIN(HWY_LANES(float), 16), kVectors = 16 / kLanes;
  float w[16], squared = 0;
  for (std::size_t four = 0; four < fours; ++four) {
    const float* HWY_RESTRICT at = rows + 64 * groups * four;
    hn::Vec<decltype(d)> sum[4][kVectors];
#pragma GCC unroll 4
    for (int row = 0; row < 4; ++row) {
#pragma GCC unroll 16
      for (std::size_t i = 0; i < kVectors; ++i) sum[row][i] = hn::Zero(d);
    }
    for (std::size_t group = 0; group < groups; ++group) {
#pragma GCC unroll 16
      for (std::size_t i = 0; i < kVectors; ++i) {
        const auto values = hn::LoadU(d, y + 16 * group + i * kLanes);
#pragma GCC unroll 4
        for (std::size_t row = 0; row < 4; ++row)
          sum[row][i] = Fma(hn::Load(d, at + 64 * group + 16 * row + i * kLanes), values, sum[row][i]);
      }
    }
#pragma GCC unroll 4
    for (std::size_t row = 0; row < 4; ++row) {
#pragma GCC unroll 4
      for (std::size_t half = kVectors / 2; half >= 1; half /= 2) {
#pragma GCC unroll 8
        for (std::size_t i = 0; i < half; ++i) sum[row][i] = hn::Add(sum[row][i], sum[row][i + half]);
      }
      w[4 * four + row] = SumInHalves(d, sum[row][0]);
    }
    const float* of = w + 4 * four;
    squared = squared + ((of[0] * of[0] + of[1] * of[1]) + (of[2] * of[2] + of[3] * of[3]));
  }
  for (std::size_t at = 0; at < 16 * groups; at += kLanes) {
    auto value = hn::LoadU(d, g + at);
    for (std::size_t four = 0; four < fours; ++four) {
      const float* column = rows + 64 * (groups * four + at / 16) + at % 16;
#pragma GCC unroll 4
      for (std::size_t row = 0; row < 4; ++row)
        value = Fma(hn::Load(d, column + 16 * row), hn::Set(d, w[4 * four + row]), value);
    }
    hn::StoreU(value, d, g + at);
  }
  return squared;
}

// g = F^T F y; returns |F y|^2. F [rows x columns].
double Project(const float* factor, std::size_t rows, std::size_t columns, bool lower, const float* y,
               float* g) {
  const std::size_t all = (columns + 15) / 16;
  for (std::size_t j = 0; j < 16 * all; ++j) g[j] = 0;
  double sum = 0;
  for (std::size_t row = 0; row < rows; row += 16) {
    const std::size_t groups = lower ? row / 16 + 1 : all,
                      fours = ((rows - row < 16 ? rows - row : 16) + 3) / 4;
    sum += static_cast<double>(Rows(factor, fours, groups, y, g));
    factor += 64 * groups * fours;
  }
  return sum;
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "base/check.h"

namespace kpsa::engine {

HWY_EXPORT(Project);

namespace {

constexpr float kHugeMeasurement = 1e15f;  // deviations, or metres: reconstruction would overflow soon

// |block * g|^2 for a block of h x h, column-major.
float BlockNorm(const float* block, const float* g, std::size_t h) {
  float sum = 0;
  for (std::size_t i = 0; i < h; ++i) {
    float value = 0;
    for (std::size_t j = 0; j < h; ++j) value = value + block[j * h + i] * g[j];
    sum = sum + value * value;
  }
  return sum;
}

// The first cue with a value that is not below `limit`.
Index FirstNotFinite(const SoftCacheModel& model, std::span<const float> y,
                     float limit = std::numeric_limits<float>::infinity()) {
  // As whole numbers, which are in order as magnitudes are, infinity and NaN last: no branch for each
  constexpr std::int32_t kMagnitude = 0x7fffffff;
  const auto least = std::bit_cast<std::int32_t>(limit);
  std::int32_t spoilt = 0;
  for (const float value : y.first(model.rows()))
    spoilt |= (std::bit_cast<std::int32_t>(value) & kMagnitude) >= least ? -1 : 0;
  if (spoilt == 0) return kNoIndex;
  for (std::size_t k = 0; k < model.cues(); ++k) {
    for (Index j = model.offsets[k]; j < model.offsets[k + 1]; ++j) {
      if (!(std::fabs(y[j]) < limit)) return static_cast<Index>(k);
    }
  }
  return kNoIndex;
}

void Spoil(Verdict* verdict) {
  verdict->score = std::numeric_limits<double>::infinity();
  verdict->full_weight = 1;
  verdict->hit = false;
  verdict->reason = MissReason::kNotFinite;
}

}  // namespace

std::size_t SoftCacheModel::factor_size() const {
  const std::size_t all = padded_rows() / 16;
  std::size_t size = 0;
  const std::size_t height = mode == EstimatorMode::kMap ? rows() : modes;
  for (std::size_t row = 0; row < height; row += 4)
    size += 64 * (mode == EstimatorMode::kMap ? row / 16 + 1 : all);
  return size;
}

double FullWeight(double score, const SoftCacheThreshold& threshold) {
  if (threshold.tau == std::numeric_limits<double>::infinity()) return std::isfinite(score) ? 0.0 : 1.0;
  if (!(threshold.tau > 0) || !(score < threshold.tau)) return 1;
  const double lo = threshold.tau_lo();
  if (score <= lo) return 0;
  return Smoothstep((score - lo) / (threshold.tau - lo));
}

double PatchScoreInBlend(double own, double score, const SoftCacheThreshold& threshold) {
  const double tau = threshold.tau;
  if (!(score < tau) || std::isinf(tau)) return score;
  return std::min(score, std::max(own, kLeastOwn * score) * (tau - threshold.tau_lo()) / (tau - score));
}

RawScores ComputeRawScores(const SoftCacheModel& model, std::span<const float> y, std::span<float> g) {
  KPSA_DCHECK(y.size() >= model.padded_rows() && g.size() >= model.padded_rows());
  const bool map = model.mode == EstimatorMode::kMap;
  double squared = HWY_DYNAMIC_DISPATCH(Project)(model.factor.data(), map ? model.rows() : model.modes,
                                                 model.rows(), map, y.data(), g.data());
  if (!map) {
    squared = 0;
    for (std::size_t j = 0; j < model.rows(); ++j) {
      g[j] = y[j] - g[j];
      squared += static_cast<double>(g[j]) * g[j];
    }
  }
  RawScores raw;
  float largest = -1;
  const auto consider = [&](float norm, std::size_t cue) {
    if (norm > largest) largest = norm, raw.worst_cue = static_cast<Index>(cue);
  };
  const float* block = model.leave_one_out.data();
  const Index* const offsets = model.offsets.data();
  const float* const of = g.data();
  const std::size_t cues = model.cues();
  for (std::size_t k = 0; k < cues; ++k) {
    if (map) {  // most cues are scalars, many in a row
      for (; k < cues && offsets[k + 1] - offsets[k] == 1; ++k, ++block) {
        const float error = block[0] * of[offsets[k]];
        consider(error * error, k);
      }
      if (k == cues) break;
    }
    const std::size_t begin = offsets[k], height = offsets[k + 1] - begin;
    float norm = 0;
    if (map) {
      norm = BlockNorm(block, of + begin, height);
      block += height * height;
    } else {
      for (std::size_t j = begin; j < begin + height; ++j) norm = norm + of[j] * of[j];
    }
    consider(norm, k);
  }
  raw.score1 = map ? squared : std::sqrt(squared);
  raw.score2 = map && largest > 0 ? std::sqrt(static_cast<double>(largest)) : 0;
  return raw;
}

Verdict JudgeFinite(const SoftCacheModel& model, std::span<const float> y) {
  Verdict verdict;
  verdict.offender = FirstNotFinite(model, y, kHugeMeasurement);
  if (verdict.offender != kNoIndex) Spoil(&verdict);
  return verdict;
}

Verdict Judge(const SoftCacheModel& model, const SoftCacheThreshold& threshold, std::span<const float> y,
              std::span<float> g, double weight) {
  Verdict verdict;
  const RawScores raw = ComputeRawScores(model, y, g);
  // A NaN or an infinity anywhere in y spoils score 1
  if (!std::isfinite(raw.score1)) verdict.offender = FirstNotFinite(model, y);
  verdict.score = weight * std::max(raw.score1 / model.quantile1, raw.score2 / model.quantile2);
  if (verdict.offender != kNoIndex ||
      !std::isfinite(verdict.score)) {  // huge measurements overflow the score
    Spoil(&verdict);
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

TrainedRange MakeTrainedRange(std::string plug, double min, double max, double slack, double ramp) {
  const double widened = slack + 1e-6 * std::max({1.0, std::fabs(min), std::fabs(max)});
  return {std::move(plug), min - widened, max + widened, ramp};
}

std::string OutsideMessage(const TrainedRange& range, double value) {
  return fmt::format("{} = {:.6g} is outside its trained range [{:.6g}, {:.6g}]", range.plug, value, range.lo,
                     range.hi);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
