#include "rig/build/steps/place_stages.h"

#include "rig/build/stack_parts.h"

namespace kpsa::engine {

void PlaceStages(const BuildInput& in, RestPose* rest, MadeNodes* nodes, Graph* graph) {
  for (MadeNode& made : *nodes) {
    for (std::size_t g = 0; g < made.geometries.size() && !made.world; ++g) {
      const DeformedGeometry& of = made.geometries[g];
      if (!of.mesh.has_value()) continue;
      const WeightMap* weights = WeightsOf(made, g, graph);
      SetWorldFromStage(
          in, g,
          rest->WorldFromMesh(*of.mesh, weights == nullptr ? std::vector<float>() : weights->weights()),
          &made, graph);
    }
  }
}

}  // namespace kpsa::engine
