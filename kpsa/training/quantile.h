#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace kpsa::engine {

// The smallest of the values that a share of them does not exceed; not of an empty list.
inline double Quantile(std::vector<double> values, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace kpsa::engine
