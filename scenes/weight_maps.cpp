#include "scenes/weight_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace kpsa::engine::scenes {
namespace {

constexpr double kSmallestWeight = 1e-3;

}  // namespace

std::string WeightsJson(const std::string& mesh, const std::map<std::string, std::vector<double>>& maps,
                        std::size_t points) {
  std::string out =
      fmt::format("{{\"kpsa\": \"weights\", \"version\": 1, \"mesh\": \"{}\", \"points\": {}, \"maps\": {{",
                  mesh, points);
  bool first = true;
  for (const auto& [name, values] : maps) {
    // The commonest of 0 and 1 is the default
    const auto ones =
        std::count_if(values.begin(), values.end(), [](double v) { return v > 1 - kSmallestWeight; });
    const auto zeros =
        std::count_if(values.begin(), values.end(), [](double v) { return v < kSmallestWeight; });
    const double usual = ones > zeros ? 1 : 0;
    std::vector<std::string> indices, numbers;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::fabs(values[i] - usual) < kSmallestWeight) continue;
      indices.push_back(fmt::format("{}", i));
      numbers.push_back(fmt::format("{:.4g}", values[i]));
    }
    out += fmt::format("{}\n  \"{}\": {{\"default\": {}, \"indices\": [{}], \"values\": [{}]}}",
                       first ? "" : ",", name, usual, fmt::join(indices, ","), fmt::join(numbers, ","));
    first = false;
  }
  return out + "\n}}\n";
}

}  // namespace kpsa::engine::scenes
