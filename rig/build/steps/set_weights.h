// A step of rig_builder.cpp. Members, weight maps and falloffs of deformers: one float a point, their product.
// Reads: `members`, `weights`, `falloff` and weight files. Writes: weights of the nodes' geometries in the graph,
// notes; through the maps the files and weights that the rig names; through the places handles that falloffs are at.
#pragma once

#include <string>
#include <vector>

#include "rig/build/members.h"
#include "rig/build/rest_falloffs.h"

namespace kpsa::engine {

// Refers to its arguments.
class WeightSetter {
 public:
  WeightSetter(const BuildInput& in, const RestFalloffs& falloffs, WeightMaps* maps, Graph* graph,
               std::vector<std::string>* notes)
      : in_(in), falloffs_(falloffs), members_(in, maps), maps_(maps), graph_(graph), notes_(notes) {}

  // Sets weights[g] of the geometries that were added since the last call. Nothing is set where the rig says
  // nothing.
  void Set(MadeNode* made);

 private:
  const BuildInput& in_;
  const RestFalloffs& falloffs_;
  const Members members_;
  WeightMaps* maps_;
  Graph* graph_;
  std::vector<std::string>* notes_;
};

void SetWeights(WeightSetter* setter, MadeNodes* nodes);

}  // namespace kpsa::engine
