#include "rig/build/steps/set_blend_weights.h"

#include "rig/graph_editor.h"

namespace kpsa::engine {

void SetBlendWeights(const BuildInput& in, const OwnDeformers& own, WeightMaps* maps, Graph* graph) {
  for (const MadeNode& made : own.made) {
    const RigAttribute* key = made.Find("blendWeights");
    if (key == nullptr || in.errors->full()) continue;
    std::vector<std::vector<float>> weights{std::vector<float>(made.geometries.front().count, 1.0f)};
    if (!maps->MultiplyByMaps(*key, made, &weights)) continue;
    GraphEditor edit(graph);
    edit.Set(made.id, "blendWeights", 0, std::make_shared<const WeightMap>(std::move(weights[0])));
    in.Fail(key->value.where(), edit.Take());
  }
}

}  // namespace kpsa::engine
