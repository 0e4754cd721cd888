// Distances between the vertices of two caches.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "files/vertex_file.h"

namespace kpsa::engine {

// Arrays of the two files that stand for each other.
using VertexPairs = std::vector<std::pair<const VertexArray*, const VertexArray*>>;

// Pairs by name; a file with one array without a name (.pc2, .mdd) matches any single array. Errors
// (kDiffers): another number of frames, other times, a missing array, another number of vertices.
Status MatchVertices(const VertexFile& a, const VertexFile& b, VertexPairs* pairs);

// Distances in metres; what is not a number is infinitely far from everything.
struct FrameError {
  std::size_t frame = 0;
  double max = 0, rms = 0, p99 = 0;
  std::string array;  // where the worst vertex is
  std::size_t vertex = 0;
};

// `distances` is scratch, kept between calls.
FrameError CompareFrame(const VertexPairs& pairs, std::size_t frame, std::vector<double>* distances);

}  // namespace kpsa::engine
