#include "files/vertex_compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/quantity_text.h"

namespace kpsa::engine {

Status MatchVertices(const VertexFile& a, const VertexFile& b, VertexPairs* pairs) {
  const auto differ = [&](const std::string& message) {
    return Status::Make(ErrorKind::kDiffers, message).At({b.path});
  };
  if (a.frame_count != b.frame_count)
    return differ(fmt::format("has {}, {} has {}", Plural(b.frame_count, "frame"), a.path, a.frame_count));
  if (!a.times.empty() && !b.times.empty()) {
    for (std::size_t i = 0; i < a.times.size(); ++i) {
      // PC2 and MDD hold float32 times
      if (std::abs(a.times[i] - b.times[i]) > 1e-6 * std::max(1.0, std::abs(a.times[i]))) {
        return differ(fmt::format("frame {} is at {} s, in {} at {} s", i, b.times[i], a.path, a.times[i]));
      }
    }
  }
  const bool unnamed = (a.arrays.size() == 1 && a.arrays[0].name.empty()) ||
                       (b.arrays.size() == 1 && b.arrays[0].name.empty());
  if (a.arrays.size() != b.arrays.size())
    return differ(
        fmt::format("has {}, {} has {}", Plural(b.arrays.size(), "array"), a.path, a.arrays.size()));
  std::vector<std::string> names;
  for (const VertexArray& array : b.arrays) names.push_back(array.name);
  for (const VertexArray& array : a.arrays) {
    const auto found = unnamed ? b.arrays.begin()
                               : std::find_if(b.arrays.begin(), b.arrays.end(),
                                              [&](const VertexArray& x) { return x.name == array.name; });
    if (found == b.arrays.end())
      return differ(fmt::format("has no array \"{}\"{}", array.name, DidYouMean(array.name, names)));
    if (found->vertices != array.vertices)
      return differ(fmt::format("\"{}\" has {}, in {} it has {}", found->name,
                                Plural(found->vertices, "vertex"), a.path, array.vertices));
    pairs->emplace_back(&array, &*found);
  }
  return Status();
}

FrameError CompareFrame(const VertexPairs& pairs, std::size_t frame, std::vector<double>* distances) {
  FrameError error;
  error.frame = frame;
  distances->clear();
  double sum = 0;
  for (const auto& [a, b] : pairs) {
    const float* x = a->frames.data() + frame * a->vertices * 3;
    const float* y = b->frames.data() + frame * a->vertices * 3;
    for (std::size_t v = 0; v < a->vertices; ++v) {
      double square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double d = static_cast<double>(x[3 * v + c]) - static_cast<double>(y[3 * v + c]);
        square += d * d;
      }
      // What is not a number is infinitely far from everything
      const double distance = std::isfinite(square) ? std::sqrt(square) : HUGE_VAL;
      sum += distance * distance;
      if (distance > error.max || distances->empty())
        error.max = distance, error.array = a->name, error.vertex = v;
      distances->push_back(distance);
    }
  }
  if (distances->empty()) return error;
  error.rms = std::sqrt(sum / static_cast<double>(distances->size()));
  const std::size_t rank = (distances->size() * 99 + 99) / 100 - 1;
  std::nth_element(distances->begin(), distances->begin() + static_cast<std::ptrdiff_t>(rank),
                   distances->end());
  error.p99 = (*distances)[rank];
  return error;
}

}  // namespace kpsa::engine
