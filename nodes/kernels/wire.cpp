#include "nodes/kernels/wire.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

// One span as a cubic in its own parameter t in [0, 1]: c0 + t (c1 + t (c2 + t c3)).
struct Cubic {
  Double3 c[4];
  Double3 At(double t) const { return c[0] + (c[1] + (c[2] + c[3] * t) * t) * t; }
  // Half the derivative of the squared distance to p.
  double Slope(double t, Double3 p) const { return Dot(At(t) - p, c[1] + (c[2] * 2.0 + c[3] * (3 * t)) * t); }
};

std::vector<Cubic> Spans(const CurveShape& shape, std::span<const Double3> vertices) {
  std::vector<Cubic> spans(shape.spans());
  for (std::size_t i = 0; i < spans.size(); ++i) {
    // Interpolate the weights at four parameters: exact for a cubic, and the formulas stay in one place
    const double base = static_cast<double>(i);
    Double3 f[4];
    for (int k = 0; k < 4; ++k) {
      const double t = k / 3.0;
      Index controls[4];
      double weights[4];
      shape.Weights(k == 3 ? std::nextafter(base + 1, base) : base + t, controls, weights);
      for (int c = 0; c < 4; ++c) f[k] = f[k] + vertices[controls[c]] * weights[c];
    }
    Cubic& cubic = spans[i];
    cubic.c[0] = f[0];
    cubic.c[1] = f[0] * -5.5 + f[1] * 9.0 + f[2] * -4.5 + f[3];
    cubic.c[2] = f[0] * 9.0 + f[1] * -22.5 + f[2] * 18.0 + f[3] * -4.5;
    cubic.c[3] = f[0] * -4.5 + f[1] * 13.5 + f[2] * -13.5 + f[3] * 4.5;
  }
  return spans;
}

// The spans of a curve, and boxes around runs of them.
class SpanTable {
 public:
  SpanTable(const CurveShape& shape, std::span<const Double3> vertices) : spans_(Spans(shape, vertices)) {
    for (std::size_t i = 0; i < spans_.size(); ++i) {
      const Cubic& span = spans_[i];
      if (i % kRun == 0) boxes_.push_back({span.c[0], span.c[0]});
      Box& box = boxes_.back();
      for (int a = 0; a < 3; ++a) {
        const double reach = std::fabs(span.c[1][a]) + std::fabs(span.c[2][a]) + std::fabs(span.c[3][a]);
        box.low[a] = std::min(box.low[a], span.c[0][a] - reach);
        box.high[a] = std::max(box.high[a], span.c[0][a] + reach);
      }
    }
  }

  // The parameter of the nearest place, the first one where several are as near. Runs whose boxes are farther than a
  // place of the curve are not searched.
  double Nearest(Double3 p, double* distance) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < spans_.size(); i += kRun) {
      const Double3 offset = spans_[i].c[0] - p;
      least = std::min(least, Dot(offset, offset));
    }
    double best = std::numeric_limits<double>::infinity(), best_u = 0;
    for (std::size_t run = 0; run < boxes_.size(); ++run) {
      if (boxes_[run].SquareTo(p) > kRounding * std::min(least, best)) continue;
      for (std::size_t i = run * kRun; i < std::min(spans_.size(), (run + 1) * kRun); ++i)
        Search(i, p, &best, &best_u);
    }
    *distance = std::sqrt(best);
    return best_u;
  }

 private:
  static constexpr std::size_t kRun = 16;
  static constexpr double kRounding = 1 + 1e-9;  // of boxes and places
  struct Box {
    Double3 low, high;
    double SquareTo(Double3 p) const {
      Double3 beyond;
      for (int a = 0; a < 3; ++a) beyond[a] = std::max({0.0, low[a] - p[a], p[a] - high[a]});
      return Dot(beyond, beyond);
    }
  };

  void Search(std::size_t span, Double3 p, double* best, double* best_u) const {
    const Cubic& cubic = spans_[span];
    const auto consider = [&](double t) {
      const Double3 offset = cubic.At(t) - p;
      const double d = Dot(offset, offset);
      if (d < *best) *best = d, *best_u = static_cast<double>(span) + t;
    };
    constexpr int kSteps = 8;
    consider(0);
    double left = 0, slope_left = cubic.Slope(0, p);
    for (int k = 1; k <= kSteps; ++k) {
      const double right = static_cast<double>(k) / kSteps, slope_right = cubic.Slope(right, p);
      if (slope_left < 0 && slope_right >= 0) {  // a minimum lies between
        double a = left, b = right;
        for (int step = 0; step < 30; ++step) {
          const double middle = 0.5 * (a + b);
          (cubic.Slope(middle, p) < 0 ? a : b) = middle;
        }
        consider(0.5 * (a + b));
      }
      left = right;
      slope_left = slope_right;
    }
    consider(1);
  }

  std::vector<Cubic> spans_;
  std::vector<Box> boxes_;
};

// A curve at rest, and how near points are to it. A Catmull-Rom span, and a reflected end, may leave the box
// of the vertices by an eighth or two of its size; points farther than that and the dropoff need no search.
class RestCurve {
 public:
  RestCurve(const WireSettings& settings, std::span<const Double3> vertices)
      : settings_(settings),
        shape_{settings.basis, settings.closed, vertices.size()},
        spans_(shape_, vertices),
        low_(vertices[0]),
        high_(vertices[0]) {
    for (Double3 v : vertices) {
      for (int a = 0; a < 3; ++a) low_[a] = std::min(low_[a], v[a]), high_[a] = std::max(high_[a], v[a]);
    }
    margin_ = settings.dropoff + 0.5 * Length(high_ - low_);
  }
  const CurveShape& shape() const { return shape_; }
  // The weight of a point, and the parameter of what is nearest to it.
  double Falloff(Double3 p, double* u) const {
    *u = 0;
    for (int a = 0; a < 3; ++a) {
      if (!(p[a] >= low_[a] - margin_ && p[a] <= high_[a] + margin_)) return 0;
    }
    double distance;
    *u = spans_.Nearest(p, &distance);
    return settings_.profile.Evaluate(distance / settings_.dropoff);
  }

 private:
  WireSettings settings_;
  CurveShape shape_;
  SpanTable spans_;
  Double3 low_, high_;
  double margin_;
};

}  // namespace

void CurveShape::Weights(double u, Index controls[4], double weights[4]) const {
  const double span_count = static_cast<double>(spans()), n = static_cast<double>(vertices);
  if (closed) {
    u -= std::floor(u / n) * n;
    if (!(u < n)) u = 0;
  } else {
    u = std::clamp(u, 0.0, span_count);
  }
  const std::size_t i = std::min(static_cast<std::size_t>(u), spans() - 1);
  const double t = u - static_cast<double>(i), t2 = t * t, t3 = t2 * t;
  double w[4];  // of the vertices i - 1, i, i + 1, i + 2
  switch (basis) {
    case CurveBasis::kLinear:
      w[0] = 0, w[1] = 1 - t, w[2] = t, w[3] = 0;
      break;
    case CurveBasis::kCatmullRom:
      w[0] = 0.5 * (-t3 + 2 * t2 - t), w[1] = 0.5 * (3 * t3 - 5 * t2 + 2);
      w[2] = 0.5 * (-3 * t3 + 4 * t2 + t), w[3] = 0.5 * (t3 - t2);
      break;
    case CurveBasis::kBSpline:
      w[0] = (1 - t) * (1 - t) * (1 - t) / 6, w[1] = (3 * t3 - 6 * t2 + 4) / 6;
      w[2] = (-3 * t3 + 3 * t2 + 3 * t + 1) / 6, w[3] = t3 / 6;
      break;
  }
  const std::size_t before = i > 0 ? i - 1 : (closed ? vertices - 1 : kNoIndex);
  const std::size_t next = (i + 1) % vertices;
  const std::size_t after = i + 2 < vertices ? i + 2 : (closed ? (i + 2) % vertices : kNoIndex);
  // An end without a vertex is the reflection of the one inside: c(-1) = 2 c(0) - c(1)
  if (before == kNoIndex) w[1] += 2 * w[0], w[2] -= w[0], w[0] = 0;
  if (after == kNoIndex) w[2] += 2 * w[3], w[1] -= w[3], w[3] = 0;
  controls[0] = static_cast<Index>(before == kNoIndex ? i : before);
  controls[1] = static_cast<Index>(i);
  controls[2] = static_cast<Index>(next);
  controls[3] = static_cast<Index>(after == kNoIndex ? next : after);
  std::copy(w, w + 4, weights);
}

Double3 CurveShape::Point(std::span<const Double3> curve_vertices, double u) const {
  Index controls[4];
  double weights[4];
  Weights(u, controls, weights);
  Double3 point;
  for (int c = 0; c < 4; ++c) point = point + curve_vertices[controls[c]] * weights[c];
  return point;
}

double CurveShape::Nearest(std::span<const Double3> curve_vertices, Double3 p) const {
  double distance;
  return SpanTable(*this, curve_vertices).Nearest(p, &distance);
}

Status WireKernel::Validate(const WireSettings& settings, std::span<const Double3> rest_vertices) {
  const std::size_t least = settings.closed ? 3 : 2;
  if (rest_vertices.size() < least) {
    return Status::Invalid("a {} curve of {} vertices, expected at least {}",
                           settings.closed ? "closed" : "wire", rest_vertices.size(), least);
  }
  if (rest_vertices.size() > 100000) {
    return Status::Invalid("a wire curve of {} vertices, expected at most 100000", rest_vertices.size());
  }
  for (std::size_t i = 0; i < rest_vertices.size(); ++i) {
    const Double3 v = rest_vertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) {
      return Status::Invalid("vertex {} of a wire curve is not a finite point", i);
    }
  }
  if (!(settings.dropoff > 0) || !std::isfinite(settings.dropoff)) {
    return Status::Invalid("a wire's dropoff of {} m, expected more than 0", settings.dropoff);
  }
  return settings.profile.Validate();
}

WireKernel::WireKernel(const WireSettings& settings, std::span<const Double3> rest_vertices,
                       ConstPointsView rest, std::span<const Index> out_points,
                       std::span<const float> point_weights)
    : count_(out_points.size()), vertices_(rest_vertices.size()) {
  KPSA_CHECK(Validate(settings, rest_vertices).ok());
  KPSA_CHECK(IsSortedSet(out_points, rest.count));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == count_);
  const RestCurve curve(settings, rest_vertices);
  std::vector<Index> controls(4 * count_, 0);
  std::vector<float> weights(4 * count_, 0.0f);
  for (std::size_t i = 0; i < count_; ++i) {
    const Index index = out_points[i];
    double u, basis[4];
    const double falloff = curve.Falloff({rest.x[index], rest.y[index], rest.z[index]}, &u);
    const double w = falloff * static_cast<double>(point_weights.empty() ? 1.0f : point_weights[i]);
    if (w == 0) continue;
    curve.shape().Weights(u, controls.data() + 4 * i, basis);
    for (std::size_t c = 0; c < 4; ++c) weights[4 * i + c] = static_cast<float>(w * basis[c]);
  }
  if (settings.basis == CurveBasis::kLinear) {  // the outer two are unused
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t c = 0; c < 2; ++c) {
        controls[2 * i + c] = controls[4 * i + 1 + c];
        weights[2 * i + c] = weights[4 * i + 1 + c];
      }
    }
    controls.resize(2 * count_);
    weights.resize(2 * count_);
  }
  blend_ = ControlBlend(settings.basis == CurveBasis::kLinear ? 2 : 4, controls, weights);
}

WireKernel::WireKernel(std::span<const WireCurve> curves, double crossing_effect, ConstPointsView rest,
                       std::span<const Index> out_points, std::span<const float> point_weights)
    : count_(out_points.size()) {
  KPSA_CHECK(IsSortedSet(out_points, rest.count));
  KPSA_CHECK(point_weights.empty() || point_weights.size() == count_);
  std::vector<RestCurve> rest_curves;
  std::vector<std::size_t> first;
  for (const WireCurve& curve : curves) {
    KPSA_CHECK(Validate(curve.settings, curve.rest_vertices).ok());
    rest_curves.emplace_back(curve.settings, curve.rest_vertices);
    first.push_back(vertices_);
    vertices_ += curve.rest_vertices.size();
  }
  const std::size_t width = 4 * curves.size();
  std::vector<Index> controls(width * count_, 0);
  std::vector<float> weights(width * count_, 0.0f);
  std::vector<double> falloffs(curves.size()), parameters(curves.size());
  for (std::size_t i = 0; i < count_; ++i) {
    const Index index = out_points[i];
    double sum = 0;
    for (std::size_t k = 0; k < curves.size(); ++k) {
      falloffs[k] = rest_curves[k].Falloff({rest.x[index], rest.y[index], rest.z[index]}, &parameters[k]);
      sum += falloffs[k];
    }
    for (std::size_t k = 0; k < curves.size(); ++k) {
      if (!(falloffs[k] > 0)) continue;
      const double share = crossing_effect + (1 - crossing_effect) * falloffs[k] / sum;
      const double w =
          falloffs[k] * share * static_cast<double>(point_weights.empty() ? 1.0f : point_weights[i]);
      Index* to = controls.data() + width * i + 4 * k;
      double basis[4];
      rest_curves[k].shape().Weights(parameters[k], to, basis);
      for (std::size_t c = 0; c < 4; ++c) {
        to[c] += static_cast<Index>(first[k]);
        weights[width * i + 4 * k + c] = static_cast<float>(w * basis[c]);
      }
    }
  }
  if (width > 0) blend_ = ControlBlend(width, controls, weights);
}

void WireKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
                     const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, count_);
  KPSA_CHECK_EQ(out.count, count_);
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  CopyPoints(in, out);
  bool any = false;
  std::size_t vertex = 0;
  for (const ConstPointsView& offsets : inputs.offsets) {
    KPSA_CHECK_LE(vertex + offsets.count, vertices_);
    any |= PackOffsets(offsets, inputs.turn, inputs.envelope, scratch.data() + 4 * vertex);
    vertex += offsets.count;
  }
  KPSA_CHECK_EQ(vertex, vertices_);
  if (any) blend_.Run(scratch.data(), out, parallel);
}

}  // namespace kpsa::engine
