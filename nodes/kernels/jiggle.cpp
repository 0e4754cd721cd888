#include "nodes/kernels/jiggle.h"

#include <cmath>

#include "base/check.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {
constexpr std::size_t kJiggleGrain = 1024;
constexpr double kMostSteps = 1e15;  // of time: beyond, steps are no whole numbers any more
}  // namespace

JiggleKernel::JiggleKernel(double rate, std::span<const Index> out_points,
                           std::span<const float> point_weights)
    : rate_(rate) {
  KPSA_CHECK(rate > 0);
  KPSA_CHECK(point_weights.empty() || point_weights.size() == out_points.size());
  weights_.assign(out_points.size(), 1.0f);
  if (!point_weights.empty()) weights_.assign(point_weights.begin(), point_weights.end());
}

std::size_t JiggleKernel::StateBytes() const { return sizeof(Header) + 2 * point_count() * sizeof(Particle); }

double JiggleKernel::StateTime(const std::byte* state) const {
  return reinterpret_cast<const Header*>(state)->time;
}

JiggleKernel::Outcome JiggleKernel::Run(const Inputs& inputs, ConstPointsView in, PointsView out,
                                        std::byte* state, const Parallel* parallel) const noexcept {
  KPSA_CHECK_EQ(in.count, point_count());
  KPSA_CHECK_EQ(out.count, point_count());
  auto& header = *reinterpret_cast<Header*>(state);
  auto* older = reinterpret_cast<Particle*>(state + sizeof(Header));
  Particle* newer = older + point_count();
  const double exact = std::floor(inputs.time * rate_ + 0.5);
  if (!(std::fabs(exact) < kMostSteps)) {
    CopyPoints(in, out);
    return Outcome::kNoTime;
  }
  const auto step = static_cast<std::int64_t>(exact);
  if (header.started != 0 && step < header.step) {
    CopyPoints(in, out);
    return Outcome::kBackwards;
  }
  const bool anew = header.started == 0 || static_cast<double>(step - header.step) > kLongestGap * rate_ ||
                    (step == header.step && header.before == header.step);
  const bool keep = !anew && step > header.step;  // the newer state becomes the older one
  const std::int64_t from = keep ? header.step : header.before;
  const auto steps = static_cast<double>(step - from);
  ForRanges(parallel, point_count(), kJiggleGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Double3 goal{in.x[i], in.y[i], in.z[i]};
      Particle p;
      if (anew) {
        p = {goal, {}, goal};
        older[i] = p;
      } else {
        if (keep) older[i] = newer[i];
        p = older[i];
        const Double3 way = goal - p.goal;
        for (double k = 1; k <= steps; ++k) {
          const Double3 led = p.goal + way * (k / steps);
          p.velocity = p.velocity * (1 - inputs.damping) + (led - p.place) * inputs.stiffness;
          p.place = p.place + p.velocity;
        }
        p.goal = goal;
      }
      newer[i] = p;
      const double w = weights_[i] * inputs.amount;
      out.x[i] = w == 0 ? in.x[i] : static_cast<float>(goal.x + (p.place.x - goal.x) * w);
      out.y[i] = w == 0 ? in.y[i] : static_cast<float>(goal.y + (p.place.y - goal.y) * w);
      out.z[i] = w == 0 ? in.z[i] : static_cast<float>(goal.z + (p.place.z - goal.z) * w);
    }
  });
  header.before = anew ? step : from;
  header.started = 1;
  header.step = step;
  header.time = inputs.time;
  return Outcome::kAdvanced;
}

}  // namespace kpsa::engine
