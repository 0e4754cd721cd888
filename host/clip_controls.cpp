#include "host/clip_controls.h"

#include <algorithm>

#include "base/scalar_math.h"
#include "rig/build/control_plugs.h"
#include "rig/build/starter_character.h"

namespace kpsa::engine {
namespace {

// By glTF node, of all clips.
std::vector<Motion> MotionOf(const gltf::Character& character) {
  std::vector<Motion> motions(character.nodes.size());
  for (const gltf::Clip& clip : character.clips) {
    for (const auto& [node, motion] : MeasureClip(character, clip)) motions[node].Add(motion);
  }
  return motions;
}

class ClipControls {
 public:
  explicit ClipControls(const Rig& rig) : rig_(rig), graph_(*rig.graph) {}

  // What does not move noticeably is left out.
  void AddTransform(NodeId node, const Motion& motion) {
    if (rig_.scene.clip_inputs.contains(node.index)) return;  // to a constraint
    const NodeDef& def = graph_.def(node);
    const auto add = [&](const char* attribute, int axis, const MotionRange& range, double least,
                         double unit) {
      const PlugRef plug{node, def.FindAttribute(attribute), -1, axis};
      const double rest = RestValueOf(graph_, plug);
      if (range.size() >= least) Add(plug, rest, rest + range.min * unit, rest + range.max * unit);
    };
    for (int axis = 0; axis < 3; ++axis) {
      add("rotate", axis, motion.rotate[axis], kLeastDegrees, kPi / 180);
      add("translate", axis, motion.translate[axis], kLeastTranslation * rig_.rest_diagonal, 1);
      add("scale", axis, motion.scale[axis], kLeastScale, 1);
    }
  }
  void AddWeights(NodeId node, const std::vector<MotionRange>& weights) {
    const int attribute = graph_.def(node).FindAttribute("weight");
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const PlugRef plug{node, attribute, static_cast<int>(k), -1};
      if (weights[k].size() >= kLeastWeight && IsClipPlug(rig_.scene, graph_, plug))
        Add(plug, RestValueOf(graph_, plug), weights[k].min, weights[k].max);
    }
  }

  std::vector<ControlRange> Take() { return std::move(controls_); }

 private:
  void Add(const PlugRef& plug, double rest, double min, double max) {
    PlugRef whole = plug;
    whole.component = -1;
    const auto pinned = [&](const PlugRef& at) {
      return std::ranges::find(rig_.pinned, at) != rig_.pinned.end();
    };
    if (pinned(plug) || pinned(whole) || DriverBesidesClips(rig_.scene, graph_, plug) != nullptr) return;
    if (std::ranges::find(rig_.controls, plug, &Control::plug) != rig_.controls.end()) return;
    ControlRange& control = controls_.emplace_back();
    control.plug = plug;
    control.rest = rest, control.min = std::min(rest, min), control.max = std::max(rest, max);
    control.by_clip = plug.component < 0;
    const AttributeDef& attribute =
        graph_.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
    control.lowest = attribute.min, control.highest = attribute.max;
  }

  const Rig& rig_;
  const Graph& graph_;
  std::vector<ControlRange> controls_;
};

}  // namespace

std::vector<ControlRange> ControlsOfClips(const Rig& rig) {
  const std::vector<Motion> motions = MotionOf(*rig.character);
  ClipControls controls(rig);
  for (std::size_t n = 0; n < motions.size(); ++n) controls.AddTransform(rig.scene.transforms[n], motions[n]);
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    if (mesh.geometry.targets != nullptr)
      controls.AddWeights(mesh.weights_node(), motions[mesh.gltf_node].weights);
  }
  return controls.Take();
}

}  // namespace kpsa::engine
