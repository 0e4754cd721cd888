#include "rig/build/steps/note_lost_weights.h"

#include <fmt/format.h>

#include <algorithm>

namespace kpsa::engine {

void NoteLostWeights(const CharacterGraph& scene, const Graph& graph, std::vector<std::string>* notes) {
  for (const CharacterMesh& mesh : scene.meshes) {
    const NodeId own = mesh.blend_shape;
    if (own.version == 0 || scene.clip_weights.count(own.index) == 0) continue;
    const auto is_own = [&](const Stage& stage) { return stage.node == own; };
    if (std::ranges::any_of(mesh.stages, is_own)) continue;
    for (const Stage& stage : mesh.stages) {
      const NodeDef& def = graph.def(stage.node);
      if (def.name != "blendShape" || !graph.Inputs(stage.node, def.FindAttribute("weight")).empty())
        continue;
      notes->push_back(fmt::format(
          "clips move {0}.weight, which the stack of {1} leaves out, and nothing drives {2}.weight: connect "
          "{{from: \"{0}.weight[NAME]\", to: \"{2}.weight[NAME]\"}}, or put morph into the stack",
          graph.name(own), mesh.name, graph.name(stage.node)));
    }
  }
}

}  // namespace kpsa::engine
