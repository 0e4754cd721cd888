// Inside of the rig builder: falloffs of deformers, spheres, capsules, planes, distances from meshes and weight maps,
// evaluated at rest and combined. Nothing outside rig/build includes this.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rig/build/rest_places.h"
#include "rig/build/weight_maps.h"

namespace kpsa::engine {

// Refers to its arguments. All return false after an error.
class RestFalloffs {
 public:
  RestFalloffs(const BuildInput& in, RestPlaces* places, RestPose* rest, WeightMaps* maps)
      : in_(in), places_(places), rest_(rest), maps_(maps) {}

  // Weights are by point of one geometry of the deformer.
  bool Multiply(const RigAttribute& attribute, const MadeNode& made, const DeformedGeometry& of,
                std::vector<float>* weights) const;

 private:
  using Falloff = std::optional<std::vector<double>>;  // by point, 0 to 1; none: says nothing of this mesh
  bool Read(const YamlNode& node, int source, const MadeNode& made, const DeformedGeometry& of,
            Falloff* falloff) const;
  bool Combine(const YamlNode& list, const std::string& how, int source, const MadeNode& made,
               const DeformedGeometry& of, Falloff* falloff) const;
  bool ReadShape(const std::string& kind, const YamlNode& node, int source, const DeformedGeometry& of,
                 std::function<double(Double3)>* weight_at) const;

  const BuildInput& in_;
  RestPlaces* places_;
  RestPose* rest_;
  WeightMaps* maps_;
};

}  // namespace kpsa::engine
