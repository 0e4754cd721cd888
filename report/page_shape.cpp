#include "report/page_shape.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostSamples = 512;  // rows whose components are looked for at once
constexpr std::size_t kBlock = 4096;       // columns of the rows that are multiplied at once
constexpr double kRounding = 4;            // rounding counts this many times as much as modes that are left

double Square(double x) { return x * x; }

// In eight sums, which do not wait for each other.
double Product(const float* a, const float* b, std::size_t count) {
  double sums[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k)
      sums[k] += static_cast<double>(a[i + k]) * static_cast<double>(b[i + k]);
  }
  for (; i < count; ++i) sums[0] += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

// The rows less what the modes so far give: [R][3V].
class Remainder {
 public:
  Remainder(std::span<const float> rest, const std::vector<std::span<const float>>& rows)
      : width_(rest.size()), rows_(rows.size(), std::vector<float>(rest.size())), worst_(rows.size()) {
    ParallelFor(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        for (std::size_t i = 0; i < width_; ++i) rows_[r][i] = rows[r][i] - rest[i];
        worst_[r] = WorstOf(r);
      }
    });
  }

  double worst() const { return worst_.empty() ? 0 : *std::max_element(worst_.begin(), worst_.end()); }

  // Rows to look for components in: all of them, or an even spread and those that are farthest off.
  std::vector<std::size_t> Samples() const {
    std::vector<std::size_t> samples(rows_.size());
    for (std::size_t r = 0; r < rows_.size(); ++r) samples[r] = r;
    if (rows_.size() <= kMostSamples) return samples;
    std::stable_sort(samples.begin(), samples.end(),
                     [&](std::size_t a, std::size_t b) { return worst_[a] > worst_[b]; });
    samples.resize(kMostSamples / 2);
    for (std::size_t i = 0; i < kMostSamples / 2; ++i)
      samples.push_back(i * rows_.size() / (kMostSamples / 2));
    std::sort(samples.begin(), samples.end());
    samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
    return samples;
  }

  Eigen::MatrixXd GramOfRows(const std::vector<std::size_t>& samples) const {
    const auto n = static_cast<Eigen::Index>(samples.size());
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n), block;
    for (std::size_t begin = 0; begin < width_; begin += kBlock) {
      const std::size_t count = std::min(kBlock, width_ - begin);
      block.resize(n, static_cast<Eigen::Index>(count));
      for (Eigen::Index s = 0; s < n; ++s) {
        const float* from = rows_[samples[static_cast<std::size_t>(s)]].data() + begin;
        for (std::size_t i = 0; i < count; ++i)
          block(s, static_cast<Eigen::Index>(i)) = static_cast<double>(from[i]);
      }
      gram += GramOf(block);
    }
    return gram;
  }

  // Sum over the samples of weight times row: [3V].
  std::vector<double> Combine(const std::vector<std::size_t>& samples, const Eigen::VectorXd& weights) const {
    std::vector<double> sum(width_, 0);
    ParallelFor(width_, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t s = 0; s < samples.size(); ++s) {
        const double weight = weights[static_cast<Eigen::Index>(s)];
        const float* from = rows_[samples[s]].data();
        for (std::size_t i = begin; i < end; ++i) sum[i] += weight * static_cast<double>(from[i]);
      }
    });
    return sum;
  }

  // Takes the best multiple of `mode` off every row: [R] multiples.
  std::vector<float> TakeOff(std::span<const float> mode) {
    const double square = Product(mode.data(), mode.data(), width_);
    std::vector<float> multiples(rows_.size(), 0);
    ParallelFor(rows_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        const double product = Product(rows_[r].data(), mode.data(), width_);
        multiples[r] = static_cast<float>(product / square);
        for (std::size_t i = 0; i < width_; ++i) rows_[r][i] -= multiples[r] * mode[i];
        worst_[r] = WorstOf(r);
      }
    });
    return multiples;
  }

  double Energy(const std::vector<std::size_t>& samples) const {
    double energy = 0;
    for (const std::size_t r : samples) energy += Product(rows_[r].data(), rows_[r].data(), width_);
    return energy;
  }

 private:
  double WorstOf(std::size_t r) const {
    float worst = 0;
    const float* p = rows_[r].data();
    for (std::size_t i = 0; i + 2 < width_; i += 3)
      worst = std::max(worst, p[i] * p[i] + p[i + 1] * p[i + 1] + p[i + 2] * p[i + 2]);
    return std::sqrt(static_cast<double>(worst));
  }
  std::size_t width_;
  std::vector<std::vector<float>> rows_;
  std::vector<double> worst_;  // [R] the largest distance of a point
};

// Rounds a direction to whole numbers of the shape's last mode; what these stand for: [3V].
std::vector<float> AddRounded(const std::vector<double>& direction, PageShape* shape) {
  double largest = 0;
  for (const double d : direction) largest = std::max(largest, std::abs(d));
  shape->scale.push_back(static_cast<float>(largest));
  const float unit = shape->scale.back() / static_cast<float>(shape->largest);
  std::vector<float> mode(direction.size());
  for (std::size_t i = 0; i < mode.size(); ++i) {
    const double rounded = std::round(direction[i] / largest * shape->largest);
    shape->basis.push_back(static_cast<std::int16_t>(rounded));
    mode[i] = unit * static_cast<float>(rounded);
  }
  ++shape->modes;
  return mode;
}

Result<PageShape> Fit(std::span<const float> rest, const std::vector<std::span<const float>>& rows,
                      double wanted, int largest, const Watch& watch) {
  PageShape shape;
  shape.largest = largest;
  Remainder remainder(rest, rows);
  std::vector<std::vector<float>> multiples;  // [K][R]
  while (remainder.worst() > wanted && shape.modes < kMostPageModes) {
    const std::vector<std::size_t> samples = remainder.Samples();
    const auto most = static_cast<Eigen::Index>(std::min(samples.size(), kMostPageModes - shape.modes));
    const SymmetricEigen eigen = LargestEigen(remainder.GramOfRows(samples), most, 1);
    double left = remainder.Energy(samples);  // of the components that come
    const std::size_t before = shape.modes;
    for (Eigen::Index k = 0; k < most && remainder.worst() > wanted && eigen.values[k] > 0; ++k) {
      if (watch.cancelled()) return CancelledStatus();
      const bool rounding_is_more = k > 0 && remainder.Energy(samples) > kRounding * std::max(left, 0.0);
      if (rounding_is_more) break;
      const std::vector<double> direction =
          remainder.Combine(samples, eigen.vectors.col(k) / std::sqrt(eigen.values[k]));
      if (std::all_of(direction.begin(), direction.end(), [](double d) { return std::abs(d) < 1e-30; }))
        break;
      multiples.push_back(remainder.TakeOff(AddRounded(direction, &shape)));
      left -= eigen.values[k];
      watch.Done(shape.modes, 0);
    }
    if (shape.modes == before) break;
  }
  if (shape.modes == 0) {  // nothing moves
    shape.modes = 1;
    shape.basis.assign(rest.size(), 0);
    shape.scale = {0};
    multiples.emplace_back(rows.size(), 0.0f);
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t k = 0; k < shape.modes; ++k) shape.rows.push_back(multiples[k][r]);
  }
  std::vector<double> worst(rows.size(), 0);
  ParallelFor(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const std::vector<float> made = ShapePositions(shape, rest, r);
      double square = 0;
      for (std::size_t i = 0; i + 2 < made.size(); i += 3) {
        double distance = 0;
        for (std::size_t c = i; c < i + 3; ++c)
          distance += Square(static_cast<double>(made[c]) - static_cast<double>(rows[r][c]));
        square = std::max(square, distance);
      }
      worst[r] = std::sqrt(square);
    }
  });
  for (const double distance : worst) shape.precision = std::max(shape.precision, distance);
  return shape;
}

}  // namespace

Result<PageShape> FitShape(std::span<const float> rest, const std::vector<std::span<const float>>& rows,
                           double wanted, const Watch& watch) {
  constexpr double kNearEnough = 1.5;  // as far beyond what is wanted as twice the bytes are not worth
  Result<PageShape> bytes = Fit(rest, rows, wanted, 127, watch);
  if (!bytes.ok() || bytes->precision <= kNearEnough * wanted) return bytes;
  Result<PageShape> words = Fit(rest, rows, wanted, 32767, watch);
  if (!words.ok() || words->precision < bytes->precision) return words;
  return bytes;
}

std::vector<float> ShapePositions(const PageShape& shape, std::span<const float> rest, std::size_t row) {
  std::vector<float> points(rest.begin(), rest.end());
  const std::int16_t* mode = shape.basis.data();
  for (std::size_t k = 0; k < shape.modes; ++k, mode += rest.size()) {
    const float factor =
        shape.rows[row * shape.modes + k] * shape.scale[k] / static_cast<float>(shape.largest);
    for (std::size_t i = 0; i < points.size(); ++i) points[i] += factor * static_cast<float>(mode[i]);
  }
  return points;
}

PageResidual FitResidual(const std::vector<std::span<const float>>& full,
                         const std::vector<std::span<const float>>& accelerated, double step) {
  constexpr double kBytes = 127, kWords = 32767;
  PageResidual residual;
  double largest = 0;
  for (std::size_t f = 0; f < full.size(); ++f) {
    for (std::size_t i = 0; i < full[f].size(); ++i) {
      largest = std::max(largest,
                         std::abs(static_cast<double>(full[f][i]) - static_cast<double>(accelerated[f][i])));
    }
  }
  residual.step = std::max(step, largest / kWords);
  residual.wide = largest > (kBytes + 0.5) * residual.step;
  int rows = 0;
  for (std::size_t f = 0; f < full.size(); ++f) {
    const bool same = std::equal(full[f].begin(), full[f].end(), accelerated[f].begin());
    residual.frame_rows.push_back(same ? -1 : rows++);
    if (same) continue;
    for (std::size_t i = 0; i < full[f].size(); ++i) {
      const double off = static_cast<double>(full[f][i]) - static_cast<double>(accelerated[f][i]);
      residual.values.push_back(
          static_cast<std::int16_t>(std::clamp(std::round(off / residual.step), -kWords, kWords)));
    }
  }
  return residual;
}

}  // namespace kpsa::engine
