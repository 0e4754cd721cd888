// Inside of the rig builder: which points a deformer moves, `members`. Nothing outside rig/build includes this.
#pragma once

#include <functional>
#include <vector>

#include "rig/build/weight_maps.h"

namespace kpsa::engine {

// Refers to its arguments.
class Members {
 public:
  Members(const BuildInput& in, WeightMaps* maps) : in_(in), maps_(maps) {}

  // Raises the weights of the members of one geometry of the deformer to 1. False after an error.
  bool Add(const YamlNode& node, int source, const MadeNode& made, const DeformedGeometry& of,
           std::vector<float>* weights) const;

 private:
  bool AddOfFile(const YamlNode& reference, int source, const MadeNode& made, const DeformedGeometry& of,
                 std::vector<float>* weights) const;
  bool AddOfJoint(const YamlNode& joint, const YamlNode* above, const MadeNode& made,
                  const DeformedGeometry& of, std::vector<float>* weights) const;
  bool AddOfPrimitives(const YamlNode* primitive, const YamlNode* material, const MadeNode& made,
                       const DeformedGeometry& of, std::vector<float>* weights) const;
  bool AnyOther(const MadeNode& made, const DeformedGeometry& of,
                const std::function<bool(const CharacterMesh&)>& has) const;

  const BuildInput& in_;
  WeightMaps* maps_;
};

}  // namespace kpsa::engine
