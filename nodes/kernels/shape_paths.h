// In-betweens of blend shapes: targets that go through other shapes on their way, piecewise linear in their weight.
// Their first and last piece go on outside of 0 to 1.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

class ShapePaths {
 public:
  ShapePaths() = default;
  // Entry i: at the weight places[i], more than 0 and less than 1, the target targets[i] is the shape shapes[i]; both
  // are numbers of targets. Errors: lists of different lengths, numbers that are none, a target as its own in-between,
  // two at one weight.
  static Result<ShapePaths> Make(std::span<const std::int64_t> targets, std::span<const std::int64_t> shapes,
                                 std::span<const double> places, std::size_t target_count);

  // weights: those of all shapes, where they hold those of the targets; weight_of(t): that of target t.
  template <typename WeightOf>
  void Apply(const WeightOf& weight_of, std::span<double> weights) const {
    for (const Path& path : paths_) weights[path.target] = 0;
    for (const Path& path : paths_) path.Add(weight_of(path.target), weights);
  }

 private:
  static constexpr std::size_t kNoShape = static_cast<std::size_t>(-1);
  struct Stop {
    double at;
    std::size_t shape;
  };
  struct Path {
    std::size_t target;
    std::vector<Stop> stops;  // ascending; the first is nothing at 0, the last the target itself at 1
    void Add(double weight, std::span<double> weights) const;
  };
  std::vector<Path> paths_;
};

}  // namespace kpsa::engine
