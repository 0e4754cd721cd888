// The nodes of a layered clip: a clipLayer for every layer, a layeredTransform for every transform that some
// layer moves, a layeredWeights for every mesh node whose weights some layer sets.
#include <algorithm>
#include <map>

#include "rig/character/character_graph.h"
#include "rig/character/clip_channels.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

// What the layers say of one glTF node, lowest layer first.
struct NodeLayers {
  struct Part {
    std::size_t layer;
    std::shared_ptr<const AnimationKeys> keys;
  };
  std::vector<Part> moves, morphs;
};

class LayerWriter {
 public:
  LayerWriter(const LayeredClip& clip, CharacterGraph* scene, Graph* graph)
      : clip_(clip), scene_(scene), graph_(graph), edit_(graph) {}

  // Before anything else, once a layer.
  void AddLayer(const LayeredClip::Layer& layer, double duration) {
    const NodeId node = Add("clipLayer", fmt::format("{}_layer{}", clip_.id, layers_.size()));
    layers_.push_back(node);
    edit_.Set(node, "start", layer.start);
    edit_.Set(node, "speed", layer.speed);
    edit_.Set(node, "loop", layer.loop);
    edit_.Set(node, "duration", duration);
    edit_.Set(node, "weight", layer.weight);
    if (edit_.ok()) edit_.Connect(scene_->time, edit_.Plug(node, "time"));
  }
  void AddTransform(Index gltf_node, const std::vector<NodeLayers::Part>& parts) {
    const NodeId transform = scene_->transforms[gltf_node];
    const PlugRef offset = ClipInput(*scene_, *graph_, transform);
    if (!edit_.ok() || graph_->FindConnection(offset) != nullptr) return;
    const NodeId node = AddBlend("layeredTransform", graph_->name(transform) + "_clip", parts);
    if (edit_.ok()) edit_.Connect(edit_.Plug(node, "matrix"), offset);
  }
  void AddWeights(const CharacterMesh& mesh, const std::vector<NodeLayers::Part>& parts) {
    const NodeId node = AddBlend("layeredWeights", mesh.name + "_clipWeights", parts);
    edit_.Set(node, "rest", mesh.weights);
    int targets = 0;
    for (const NodeLayers::Part& part : parts)
      targets = std::max(targets, part.keys->data().weights.components);
    for (int k = 0; k < targets && edit_.ok(); ++k) {
      const PlugRef weight = edit_.Plug(mesh.weights_node(), "weight", k);
      if (edit_.ok() && graph_->FindConnection(weight) == nullptr)
        edit_.Connect(edit_.Plug(node, "output", k), weight);
    }
  }
  Status Take() { return edit_.Take(); }

 private:
  NodeId Add(std::string_view type, std::string name) {
    const NodeId node = edit_.AddFresh(type, std::move(name));
    if (edit_.ok()) scene_->clip_nodes.push_back(node);
    return node;
  }
  NodeId AddBlend(std::string_view type, std::string name, const std::vector<NodeLayers::Part>& parts) {
    const NodeId node = Add(type, std::move(name));
    std::vector<std::int64_t> additive;
    for (std::size_t i = 0; i < parts.size() && edit_.ok(); ++i) {
      const int element = static_cast<int>(i);
      const NodeId layer = layers_[parts[i].layer];
      additive.push_back(clip_.layers[parts[i].layer].additive ? 1 : 0);
      edit_.Set(node, "keys", element, parts[i].keys);
      edit_.Connect(edit_.Plug(layer, "localTime"), edit_.Plug(node, "time", element));
      edit_.Connect(edit_.Plug(layer, "weight"), edit_.Plug(node, "weight", element));
    }
    edit_.Set(node, "additive", std::move(additive));
    return node;
  }

  const LayeredClip& clip_;
  CharacterGraph* scene_;
  Graph* graph_;
  GraphEditor edit_;
  std::vector<NodeId> layers_;
};

}  // namespace

Status PlayLayers(const gltf::Character& character, const LayeredClip& clip, CharacterGraph* scene,
                  Graph* graph) {
  LayerWriter writer(clip, scene, graph);
  std::map<Index, NodeLayers> by_node;
  for (std::size_t i = 0; i < clip.layers.size(); ++i) {
    const LayeredClip::Layer& layer = clip.layers[i];
    writer.AddLayer(layer, character.clips[layer.clip].duration);
    for (auto& [gltf_node, node_keys] : KeysByNode(character, character.clips[layer.clip], &scene->notes)) {
      if (!layer.moves.empty() && !layer.moves[gltf_node]) continue;
      const auto keys = std::make_shared<const AnimationKeys>(std::move(node_keys.data));
      if (node_keys.moves) by_node[gltf_node].moves.push_back({i, keys});
      if (node_keys.morphs) by_node[gltf_node].morphs.push_back({i, keys});
    }
  }
  for (const auto& [gltf_node, layers] : by_node) {
    if (!layers.moves.empty()) writer.AddTransform(gltf_node, layers.moves);
    if (layers.morphs.empty()) continue;
    for (const CharacterMesh& mesh : scene->meshes) {
      if (mesh.gltf_node == gltf_node && mesh.geometry.targets != nullptr)
        writer.AddWeights(mesh, layers.morphs);
    }
  }
  return writer.Take();
}

}  // namespace kpsa::engine
