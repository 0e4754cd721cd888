// The nodes of a clip: a clipTransform for every animated transform, a clipWeights for every animated mesh
// node.
#include <algorithm>

#include "rig/character/character_graph.h"
#include "rig/character/clip_channels.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

class ClipWriter {
 public:
  ClipWriter(CharacterGraph* scene, Graph* graph)
      : scene_(scene), graph_(graph), edit_(graph), time_(scene->time) {}

  // Before anything else, where the clip does not begin at time 0.
  void StartAt(std::string_view clip, double start) {
    const NodeId node = edit_.AddFresh("clipLayer", fmt::format("{}_start", clip));
    if (!edit_.ok()) return;
    scene_->clip_nodes.push_back(node);
    edit_.Set(node, "start", start);
    edit_.Connect(scene_->time, edit_.Plug(node, "time"));
    time_ = edit_.Plug(node, "localTime");
  }

  void AddTransform(Index gltf_node, const std::shared_ptr<const AnimationKeys>& keys) {
    const NodeId transform = scene_->transforms[gltf_node];
    const PlugRef offset = ClipInput(*scene_, *graph_, transform);
    if (!edit_.ok() || IsDriven(offset)) return;
    const NodeId node = AddNode("clipTransform", graph_->name(transform) + "_clip", keys);
    if (edit_.ok()) edit_.Connect(edit_.Plug(node, "matrix"), offset);
    Start(node);
  }
  void AddWeights(const CharacterMesh& mesh, const std::shared_ptr<const AnimationKeys>& keys) {
    const NodeId node = AddNode("clipWeights", mesh.name + "_clipWeights", keys);
    for (int k = 0; k < keys->data().weights.components && edit_.ok(); ++k) {
      const PlugRef weight = edit_.Plug(mesh.weights_node(), "weight", k);
      if (edit_.ok() && !IsDriven(weight)) edit_.Connect(edit_.Plug(node, "output", k), weight);
    }
    Start(node);
  }
  GraphEditor& edit() { return edit_; }

 private:
  bool IsDriven(const PlugRef& plug) const { return graph_->FindConnection(plug) != nullptr; }
  NodeId AddNode(std::string_view type, std::string name, const std::shared_ptr<const AnimationKeys>& keys) {
    const NodeId node = edit_.AddFresh(type, std::move(name));
    if (!edit_.ok()) return node;
    scene_->clip_nodes.push_back(node);
    edit_.Set(node, "keys", keys);
    return node;
  }
  // Time last: a node without inputs is connected without a search for cycles.
  void Start(NodeId node) {
    if (edit_.ok()) edit_.Connect(time_, edit_.Plug(node, "time"));
  }

  CharacterGraph* scene_;
  Graph* graph_;
  GraphEditor edit_;
  PlugRef time_;
};

// By its id: one of the character, else (kNoIndex) a layered one.
struct FoundClip {
  Index index = kNoIndex;
  const LayeredClip* layered = nullptr;
};
Result<FoundClip> FindClip(const gltf::Character& character, const CharacterGraph& scene,
                           std::string_view clip) {
  FoundClip found;
  for (const LayeredClip& candidate : scene.layered) {
    if (candidate.id == clip) found.layered = &candidate;
  }
  found.index = character.FindClip(clip);
  if (found.index != kNoIndex || found.layered != nullptr) return found;
  return NoSuchClip(scene, clip);
}

}  // namespace

Status NoSuchClip(const CharacterGraph& scene, std::string_view clip) {
  std::vector<std::string> ids;
  for (const CharacterClip& known : scene.clips) ids.push_back(known.id);
  if (ids.empty()) return Status::Invalid("the character has no clips, so none named \"{}\"", clip);
  constexpr std::size_t kShown = 20;
  const std::vector<std::string> shown(
      ids.begin(), ids.begin() + static_cast<std::ptrdiff_t>(std::min(ids.size(), kShown)));
  return Status::Invalid("the character has no clip \"{}\"{}; its clips are {}{}", clip,
                         DidYouMean(clip, ids), fmt::join(shown, ", "), ids.size() > kShown ? ", ..." : "");
}

Status SetClip(const gltf::Character& character, std::optional<std::string_view> clip, CharacterGraph* scene,
               Graph* graph) {
  if (clip.has_value()) KPSA_RETURN_IF_ERROR(FindClip(character, *scene, *clip).status());
  for (NodeId node : scene->clip_nodes) KPSA_RETURN_IF_ERROR(graph->RemoveNode(node));
  scene->clip_nodes.clear();
  scene->clip.reset();
  if (!clip.has_value()) return Status();
  const std::string id(*clip);
  KPSA_RETURN_IF_ERROR(AddClip(character, id, 0, scene, graph));
  scene->clip = id;
  return Status();
}

Status AddClip(const gltf::Character& character, std::string_view clip, double start, CharacterGraph* scene,
               Graph* graph) {
  const Result<FoundClip> found = FindClip(character, *scene, clip);
  if (!found.ok()) return found.status();
  if (found->layered != nullptr) {
    LayeredClip moved = *found->layered;
    for (LayeredClip::Layer& layer : moved.layers) layer.start += start;
    return PlayLayers(character, moved, scene, graph);
  }
  ClipWriter writer(scene, graph);
  if (start != 0) writer.StartAt(clip, start);
  for (auto& [gltf_node, node_keys] : KeysByNode(character, character.clips[found->index], &scene->notes)) {
    const auto keys = std::make_shared<const AnimationKeys>(std::move(node_keys.data));
    if (node_keys.moves) writer.AddTransform(gltf_node, keys);
    if (!node_keys.morphs) continue;
    for (const CharacterMesh& mesh : scene->meshes) {
      if (mesh.gltf_node == gltf_node && mesh.geometry.targets != nullptr) writer.AddWeights(mesh, keys);
    }
  }
  return writer.edit().Take();
}

PlugRef ClipInput(const CharacterGraph& scene, const Graph& graph, NodeId transform) {
  const auto input = scene.clip_inputs.find(transform.index);
  if (input != scene.clip_inputs.end()) return input->second;
  return {transform, graph.def(transform).FindAttribute("offsetParentMatrix"), -1, -1};
}

bool IsClipPlug(const CharacterGraph& scene, const Graph& graph, const PlugRef& plug) {
  const NodeDef& def = graph.def(plug.node);
  if (plug.attribute == def.FindAttribute("offsetParentMatrix"))
    return scene.clip_transforms.count(plug.node.index) != 0;
  for (const auto& [transform, input] : scene.clip_inputs) {
    if (input == plug) return scene.clip_transforms.count(transform) != 0;
  }
  return plug.attribute == def.FindAttribute("weight") && scene.clip_weights.count(plug.node.index) != 0;
}

}  // namespace kpsa::engine
