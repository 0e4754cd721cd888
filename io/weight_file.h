// Weight map files (RIG-FORMAT.md, "Weight maps"): JSON with named maps over the vertices of one mesh.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa {

struct WeightFile {
  struct Map {
    std::string name;
    float default_value = 0;
    std::vector<Index> indices;  // each once, below `points`
    std::vector<float> values;   // one an index, finite
  };
  std::string path;
  std::string mesh;  // the mesh node's name
  Index points = 0;  // vertices of the mesh in the file, all primitives
  std::vector<Map> maps;
  const Map* Find(std::string_view name) const;  // null if there is none
  std::vector<std::string> Names() const;
  std::vector<float> Dense(const Map& map) const;  // [points]
};

// Errors name the file and the entry: bad JSON (at its line), another version, missing or unknown keys, duplicate
// keys, counts that differ, an index out of range or twice, a number that is none. Nothing is allocated by the
// file's say-so: only what its text holds.
Result<WeightFile> ReadWeightFile(const std::string& path);
Result<WeightFile> ParseWeightFile(std::string_view text, const std::string& path);

}  // namespace kpsa
