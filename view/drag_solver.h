// Numbers that bring a point as near to a line as they can: damped least squares within ranges (Levenberg and Marquardt).
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "base/types.h"

namespace kpsa::engine {

// Metres; `along` has any length but 0.
struct Line {
  Double3 from, along;
};
struct Range {
  double min = 0, max = 0;
};
// Where the point is; none where that is not known.
using PlaceOfNumbers = std::function<std::optional<Double3>(const std::vector<double>&)>;

// `start` is within the ranges, one a number, at most three. Of the numbers that are as good, near the start; those that
// move nothing stay.
std::vector<double> BringToLine(const PlaceOfNumbers& place, const std::vector<Range>& ranges,
                                const std::vector<double>& start, const Line& line);

}  // namespace kpsa::engine
