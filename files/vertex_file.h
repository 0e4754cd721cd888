// Vertex caches of any readable format, in one shape.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

struct VertexArray {
  std::string name;  // the key of an .npz, "" of .pc2 and .mdd
  std::size_t vertices = 0;
  std::vector<float> frames;  // [T * V * 3]
};
struct VertexFile {
  std::string path;
  std::vector<double> times;  // seconds; empty where the file has none
  std::size_t frame_count = 0;
  std::vector<VertexArray> arrays;
};

// .npz (every float array [T, V, 3], and `times`), .pc2 or .mdd by suffix. Errors: those of the readers,
// other suffixes, arrays of other shapes or different numbers of frames.
Result<VertexFile> ReadVertexFile(const std::string& path, double fps = 24);
std::vector<std::string> VertexFileSuffixes();

}  // namespace kpsa::engine
