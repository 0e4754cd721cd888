// jiggle: points lag behind and swing around where they are led to (Maya's jiggle deformer).
//
// Every point is a particle on a spring to its goal, advanced in steps of fixed length (semi-implicit Euler):
//   v <- v (1 - damping) + stiffness (goal - x);  x <- x + v
// The goals of the steps between two frames lie on the straight line between the goals of those frames, so
// frames that are close to each other and frames far apart differ by nothing else. A frame that is evaluated
// again starts from the state before it. Double arithmetic, point by point.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/points.h"
#include "base/types.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

class JiggleKernel {
 public:
  struct Inputs {
    double time = 0;       // seconds
    double stiffness = 0;  // 0 to 1
    double damping = 0;    // 0 to 1
    double amount = 0;     // how much of the lag shows: envelope times jiggleWeight
  };
  enum class Outcome : std::uint8_t { kAdvanced, kBackwards, kNoTime };

  // rate: steps a second, above 0.
  JiggleKernel(double rate, std::span<const Index> out_points, std::span<const float> point_weights = {});

  std::size_t point_count() const { return weights_.size(); }
  // Zeroed before the first frame, which starts it: all points at their goals.
  std::size_t StateBytes() const;
  // The time of the frame that the state holds; only after one was evaluated.
  double StateTime(const std::byte* state) const;
  // kBackwards: the time lies before that of the state by a step or more; kNoTime: it is not finite. Then the
  // points come out as they came in. After a pause of more than kLongestGap seconds the points start anew.
  Outcome Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::byte* state,
              const Parallel* parallel = nullptr) const noexcept;
  static constexpr double kLongestGap = 10;

 private:
  struct Particle {
    Double3 place, velocity, goal;
  };
  struct Header {
    std::int64_t started, step;  // step of the newer state
    double time;
    std::int64_t before;  // step of the older state; the same: there is none
  };
  double rate_;
  std::vector<float> weights_;
};

}  // namespace kpsa::engine
