// Inside of the rig builder: the weight files that a rig names. Nothing outside rig/build includes this.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "files/weights_json.h"
#include "rig/build/made_nodes.h"

namespace kpsa::engine {

// Refers to its arguments. Files are read once; all functions that return bool return false after an error.
class WeightMaps {
 public:
  // Reads Rig::scene and writes Rig::files and Rig::weights.
  WeightMaps(const BuildInput& in, Rig* rig) : in_(in), rig_(rig) {}

  // Null after an error, at the reference.
  const WeightFile* FindFile(const YamlNode& reference, const std::string& path);
  // "w/lips.json#upper": the file, its map, and the geometry of the deformer that it is for.
  bool FindMap(const YamlNode& reference, const std::string& key, int source, const MadeNode& made,
               const WeightFile** file, const NamedWeights** map, const DeformedGeometry** of);
  // The geometry of the deformer that a weight file is for.
  bool FindGeometry(const YamlNode& reference, const MadeNode& made, const WeightFile& file,
                    const std::string& path, const DeformedGeometry** of) const;
  // A welded point takes its vertices' largest.
  std::vector<float> ByPoint(const WeightFile& file, const NamedWeights& map,
                             const DeformedGeometry& of) const;
  // `weights` is by geometry and point. One reference or several; each is for the geometry that its file names.
  bool MultiplyByMaps(const RigAttribute& attribute, const MadeNode& made,
                      std::vector<std::vector<float>>* weights);
  // For those that look for the map of a deformer; a deformer with several geometries comes here several times.
  void Note(const MadeNode& made, const RigAttribute& key, const std::string& geometry,
            const std::string& path = "", const std::string& map = "");

 private:
  const DeformedGeometry* GeometryOf(const MadeNode& made, const WeightFile& file) const;

  const BuildInput& in_;
  Rig* rig_;
  std::map<std::string, std::optional<WeightFile>> files_;  // by path; none: it could not be read
};

}  // namespace kpsa::engine
