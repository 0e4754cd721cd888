#include "view/drag_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace kpsa::engine {
namespace {

constexpr int kMostSteps = 20;
constexpr double kProbe = 1e-4;       // of a range: what derivatives are taken over
constexpr double kNearEnough = 1e-6;  // of the point's distance from where the line begins
constexpr double kLeastDamping = 1e-9, kMostDamping = 1e4;  // of the square of the largest derivative
constexpr std::size_t kMostNumbers = 3;

using Offset = std::array<double, 2>;
double Size(const Offset& offset) { return std::hypot(offset[0], offset[1]); }

// From a point to the line, across the line.
class Across {
 public:
  explicit Across(const Line& line) : from_(line.from) {
    const Double3 along = UnitOrZero(line.along);
    u_ = UnitOrZero(Cross(along, std::abs(along.x) < 0.6 ? Double3{1, 0, 0} : Double3{0, 1, 0}));
    v_ = Cross(along, u_);
  }
  Offset Of(Double3 point) const { return {Dot(from_ - point, u_), Dot(from_ - point, v_)}; }

 private:
  Double3 from_, u_, v_;
};

struct Slope {
  std::array<Offset, kMostNumbers> columns{};  // how far a unit of a number takes the point
  std::array<bool, kMostNumbers> is_free{};    // is not held by the end of its range
  double square = 0;                           // of the largest column
};

Slope SlopeAt(const PlaceOfNumbers& place, const std::vector<Range>& ranges, const Across& across,
              const std::vector<double>& numbers, const Offset& offset) {
  Slope slope;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const double size = kProbe * (ranges[k].max - ranges[k].min);
    if (!(size > 0)) continue;
    std::vector<double> probed = numbers;
    probed[k] += numbers[k] + size <= ranges[k].max ? size : -size;
    const std::optional<Double3> there = place(probed);
    const double probe = probed[k] - numbers[k];
    if (!there.has_value() || probe == 0) continue;
    const Offset left = across.Of(*there);
    Offset& column = slope.columns[k];
    column = {(offset[0] - left[0]) / probe, (offset[1] - left[1]) / probe};
    const double pull = column[0] * offset[0] + column[1] * offset[1];
    slope.is_free[k] = pull > 0 ? numbers[k] < ranges[k].max : numbers[k] > ranges[k].min;
    if (slope.is_free[k])
      slope.square = std::max(slope.square, column[0] * column[0] + column[1] * column[1]);
  }
  return slope;
}

// J^T (J J^T + damping)^-1 offset; J is [2, numbers].
std::array<double, kMostNumbers> StepOf(const Slope& slope, const Offset& offset, double damping) {
  double a = damping, b = 0, d = damping;
  for (std::size_t k = 0; k < kMostNumbers; ++k) {
    if (!slope.is_free[k]) continue;
    const Offset& column = slope.columns[k];
    a += column[0] * column[0], b += column[0] * column[1], d += column[1] * column[1];
  }
  std::array<double, kMostNumbers> step{};
  const double determinant = a * d - b * b;
  if (!(determinant > 0)) return step;
  const double x = (d * offset[0] - b * offset[1]) / determinant,
               y = (a * offset[1] - b * offset[0]) / determinant;
  for (std::size_t k = 0; k < kMostNumbers; ++k)
    step[k] = slope.is_free[k] ? slope.columns[k][0] * x + slope.columns[k][1] * y : 0;
  return step;
}

}  // namespace

std::vector<double> BringToLine(const PlaceOfNumbers& place, const std::vector<Range>& ranges,
                                const std::vector<double>& start, const Line& line) {
  std::vector<double> numbers = start;
  const std::optional<Double3> at = place(start);
  if (!at.has_value()) return numbers;
  const Across across(line);
  Offset offset = across.Of(*at);
  const double enough = kNearEnough * Length(*at - line.from);
  double damping = 1e-4;
  bool nearer = true;
  for (int i = 0; i < kMostSteps && nearer && Size(offset) > enough; ++i) {
    const Slope slope = SlopeAt(place, ranges, across, numbers, offset);
    nearer = false;
    while (slope.square > 0 && !nearer && damping < kMostDamping) {
      const auto step = StepOf(slope, offset, damping * slope.square);
      std::vector<double> next = numbers;
      for (std::size_t k = 0; k < next.size(); ++k)
        next[k] = std::clamp(numbers[k] + step[k], ranges[k].min, ranges[k].max);
      if (next == numbers) break;
      const std::optional<Double3> there = place(next);
      nearer = there.has_value() && Size(across.Of(*there)) < Size(offset);
      damping = std::max(kLeastDamping, damping * (nearer ? 0.1 : 8));
      if (!nearer) continue;
      numbers = std::move(next);
      offset = across.Of(*there);
    }
  }
  return numbers;
}

}  // namespace kpsa::engine
