// Weight maps as JSON files (docs/rig-format.md, "Weight maps"):
//   {"kpsa": "weights", "version": 1, "mesh": "head_mesh", "points": 17121,
//    "maps": {"upper": {"default": 0, "indices": [4, 7], "values": [0.5, 1]}}}
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

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
  std::string path = {};           // where it was read
  const NamedWeights* Find(std::string_view name) const;
};

// Errors (collected, at most 20): no such file, no JSON (with line and column), unknown or repeated keys,
// another version, a wrong type, another number of values than of indices, an index out of range or twice, a
// number that is not finite.
Result<WeightFile> ReadWeightFile(const std::string& path);

// One weight a point.
std::vector<float> DenseWeights(const WeightFile& file, const NamedWeights& map);

// "file.json#map" in its parts; without "#map" there is no map. Maps may have a # in their names, too.
struct WeightReference {
  std::string path;  // as written
  std::optional<std::string> map;
};
WeightReference SplitWeightReference(const std::string& text);
// The map that is named, or the only one; an error where there is none, or several. `path` is for messages.
Result<const NamedWeights*> FindWeights(const WeightFile& file, const std::string& path,
                                        const std::optional<std::string>& map);

// The first point that weighs less than 0 or more than 1, and its weight. Maps of deformers, falloffs and
// members have none; those of skins are divided by their sum.
std::optional<std::pair<Index, float>> FirstOutOfRange(const WeightFile& file, const NamedWeights& map);

// One map a line, and the fewest digits that read back as the same floats.
std::string WeightFileText(const WeightFile& file);
Status WriteWeightFile(const std::string& path, const WeightFile& file, bool force);

}  // namespace kpsa::engine
