// Weight maps as JSON files (RIG-FORMAT.md, "Weight maps"):
//   {"kpsa": "weights", "version": 1, "mesh": "head_mesh", "points": 17121,
//    "maps": {"upper": {"default": 0, "indices": [4, 7], "values": [0.5, 1]}}}
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa {

// Point i weighs values[k] where indices[k] == i, else `default_value`.
struct NamedWeights {
  std::string name;
  float default_value = 0;
  std::vector<Index> indices;  // below WeightFile::points, each once
  std::vector<float> values;   // finite, one for each index
};

struct WeightFile {
  std::string mesh;  // the name of the mesh node
  std::size_t points = 0;
  std::vector<NamedWeights> maps;  // in the file's order of names
  const NamedWeights* Find(std::string_view name) const;
};

// Errors (collected, at most 20): no such file, no JSON (with line and column), unknown or repeated keys,
// another version, a wrong type, another number of values than of indices, an index out of range or twice, a
// number that is not finite.
Result<WeightFile> ReadWeightFile(const std::string& path);

// One weight a point of map `name`; an error where the file is of another mesh or number of points, or has no
// such map. `path` is for messages.
Result<std::vector<float>> DenseWeights(const WeightFile& file, const std::string& path,
                                        std::string_view name, std::string_view mesh, std::size_t points);

// Reads "file.json#map" with `reference` relative to `folder`; without "#map" the file must have one map
// only.
Result<std::vector<float>> LoadWeights(const std::string& folder, const std::string& reference,
                                       std::string_view mesh, std::size_t points);

Status WriteWeightFile(const std::string& path, const WeightFile& file, bool force);

}  // namespace kpsa
