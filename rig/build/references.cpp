#include "rig/build/references.h"

#include <algorithm>
#include <set>

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxLabel = 3;  // clips that are named where several play

// Moves what one rig says of its graph and its character behind what is there already.
class Mover {
 public:
  Mover(const ReferencePlace& place, LoadedRig from, LoadedRig* to)
      : place_(place), prefix_(place.name + ":"), from_(std::move(from)), to_(*to), graph_(*to->rig.graph) {}

  Status Run() {
    KPSA_RETURN_IF_ERROR(ChooseClip());
    KPSA_RETURN_IF_ERROR(CheckSize());
    KPSA_RETURN_IF_ERROR(AddGraph());
    AddCharacter();
    AddScene();
    AddRig();
    return Status();
  }

 private:
  const gltf::Character& character() const { return *from_.character; }

  Status CheckSize() const {
    std::uint64_t points = 0;
    for (const Rig* rig : {&from_.rig, static_cast<const Rig*>(&to_.rig)}) {
      for (const CharacterMesh& mesh : rig->scene.meshes) points += mesh.vertex_count;
    }
    if (points > kMaxCharacterPoints)
      return Status::Invalid("all characters together have more than {} vertices", kMaxCharacterPoints);
    return Status();
  }

  // By then the clips that play instead of the rig's own.
  Status ChooseClip();

  Status AddGraph() {
    GraphEditor edit(&graph_);
    root_ = edit.Add("transform", place_.name);
    if (edit.ok()) edit.Check(graph_.Pose(edit.Plug(root_, "translate"), place_.translate));
    if (!edit.ok()) return edit.Take();
    Graph& graph = *from_.rig.graph;
    begin_ = graph_.node_capacity();
    const NodeId time = from_.rig.scene.time.node;
    std::vector<Connection> timed = graph.Outputs(time);
    KPSA_RETURN_IF_ERROR(graph.RemoveNode(time));  // there is one time for all
    const Result<Index> offset = graph_.Absorb(std::move(graph), prefix_);
    if (!offset.ok()) return offset.status();
    offset_ = *offset;
    for (const Connection& c : timed) edit.Connect(to_.rig.scene.time, Moved(c.destination));
    // What stands in the world there hangs under the root
    const PlugRef world = edit.Plug(root_, "worldMatrix");
    for (Index i = begin_; i < graph_.node_capacity() && edit.ok(); ++i) {
      const NodeId node = graph_.IdAt(i);
      if (node.version == 0) continue;
      const std::vector<AttributeDef>& attributes = graph_.def(node).attributes;
      for (std::size_t a = 0; a < attributes.size(); ++a) {
        if (!attributes[a].world_place) continue;
        const PlugRef plug{node, static_cast<int>(a), -1, -1};
        if (graph_.FindValue(plug) == nullptr && graph_.FindConnection(plug) == nullptr)
          edit.Connect(world, plug);
      }
    }
    return edit.Take();
  }

  void AddCharacter();
  void AddScene();
  void AddRig();

  NodeId Moved(NodeId node) const {
    return node.version == 0 ? node : NodeId{node.index + offset_, node.version};
  }
  PlugRef Moved(PlugRef plug) const {
    plug.node = Moved(plug.node);
    return plug;
  }
  void Name(std::string* name) const { name->insert(0, prefix_); }

  const ReferencePlace& place_;
  const std::string prefix_;
  LoadedRig from_;
  LoadedRig& to_;
  Graph& graph_;
  NodeId root_;
  Index begin_ = 0, offset_ = 0;
  Index nodes_ = 0, clips_ = 0;  // of the character that was there before
};

void Mover::AddCharacter() {
  gltf::Character& to = *to_.character;
  gltf::Character& from = *from_.character;
  const auto count = [](const auto& list) { return static_cast<Index>(list.size()); };
  const auto move = [](Index* index, Index offset) {
    if (*index != kNoIndex) *index += offset;
  };
  nodes_ = count(to.nodes), clips_ = count(to.clips);
  const Index meshes = count(to.meshes), skins = count(to.skins), materials = count(to.materials);
  for (Index i = 0; i < from.nodes.size(); ++i) {
    gltf::Node& node = from.nodes[i];
    node.name = prefix_ + (node.name.empty() ? fmt::format("node{}", i) : node.name);
    move(&node.parent, nodes_);
    move(&node.mesh, meshes);
    move(&node.skin, skins);
    for (Index& child : node.children) child += nodes_;
    to.nodes.push_back(std::move(node));
  }
  for (Index node : from.order) to.order.push_back(node + nodes_);
  for (Index node : from.scene_roots) to.scene_roots.push_back(node + nodes_);
  for (gltf::Mesh& mesh : from.meshes) {
    for (gltf::Primitive& primitive : mesh.primitives) move(&primitive.material, materials);
    to.meshes.push_back(std::move(mesh));
  }
  for (gltf::Skin& skin : from.skins) {
    for (Index& joint : skin.joints) joint += nodes_;
    move(&skin.skeleton, nodes_);
    to.skins.push_back(std::move(skin));
  }
  for (gltf::Material& material : from.materials) to.materials.push_back(std::move(material));
  for (gltf::Clip& clip : from.clips) {
    Name(&clip.name);
    Name(&clip.id);
    for (gltf::Channel& channel : clip.channels) channel.node += nodes_;
    to.clips.push_back(std::move(clip));
  }
}

void Mover::AddScene() {
  CharacterGraph& to = to_.rig.scene;
  CharacterGraph& from = from_.rig.scene;
  for (CharacterMesh& mesh : from.meshes) {
    Name(&mesh.name);
    mesh.gltf_node += nodes_;
    for (NodeId* node : {&mesh.transform, &mesh.rest, &mesh.morph_weights, &mesh.blend_shape,
                         &mesh.skin_cluster, &mesh.transform_geometry})
      *node = Moved(*node);
    for (NodeId& node : mesh.influence_nodes) node = Moved(node);
    const auto move = [&](Stage* stage) {
      stage->node = Moved(stage->node);
      stage->points = Moved(stage->points);
    };
    move(&mesh.at_rest);
    for (Stage& stage : mesh.stages) move(&stage);
    mesh.points = Moved(mesh.points);
    for (OutputPrimitive& primitive : mesh.primitives) Name(&primitive.key);
    to.meshes.push_back(std::move(mesh));
  }
  for (NodeId node : from.transforms) to.transforms.push_back(Moved(node));
  for (CharacterClip& clip : from.clips) {
    Name(&clip.id);
    to.clips.push_back(std::move(clip));
  }
  for (LayeredClip& clip : from.layered) {
    Name(&clip.id);
    for (LayeredClip::Layer& layer : clip.layers) {
      layer.clip += clips_;
      if (!layer.moves.empty()) layer.moves.insert(layer.moves.begin(), nodes_, false);
    }
    to.layered.push_back(std::move(clip));
  }
  for (LayeredClip& clip : to.layered) {
    for (LayeredClip::Layer& layer : clip.layers) {
      if (!layer.moves.empty()) layer.moves.resize(to.transforms.size(), false);
    }
  }
  for (Index node : from.clip_transforms) to.clip_transforms.insert(node + offset_);
  for (Index node : from.clip_weights) to.clip_weights.insert(node + offset_);
  for (const auto& [node, plug] : from.clip_inputs) to.clip_inputs[node + offset_] = Moved(plug);
}

void Mover::AddRig() {
  Rig& to = to_.rig;
  Rig& from = from_.rig;
  const auto first = static_cast<int>(to.references.size());
  const std::size_t meshes = to.scene.meshes.size() - from.scene.meshes.size();
  to.references.push_back({prefix_, place_.file, root_, begin_, graph_.node_capacity()});
  for (Reference& reference : from.references) {
    Name(&reference.name_space);
    reference.root = Moved(reference.root);
    reference.begin += offset_;
    reference.end += offset_;
    to.references.push_back(std::move(reference));
  }
  for (Control& control : from.controls) {
    Name(&control.name);
    control.plug = Moved(control.plug);
    to.controls.push_back(std::move(control));
  }
  for (AccelerateEntry& entry : from.accelerate) {
    Name(&entry.name);
    for (AcceleratedPoints& points : entry.points) {
      points.points = Moved(points.points);
      if (!points.colors) points.mesh += meshes;
    }
    if (entry.space.has_value()) entry.space = Moved(*entry.space);
    for (std::vector<std::string>* clips : {&entry.train_clips, &entry.test_clips}) {
      for (std::string& clip : *clips) Name(&clip);
    }
    entry.reference += first + 1;
    to.accelerate.push_back(std::move(entry));
  }
  for (std::string& file : from.files) {
    if (std::find(to.files.begin(), to.files.end(), file) == to.files.end()) to.files.push_back(file);
  }
  for (std::string& note : from.notes) {
    if (std::find(to.notes.begin(), to.notes.end(), note) == to.notes.end()) to.notes.push_back(note);
  }
  to.node_places[place_.name] = place_.where;
  for (auto& [name, where] : from.node_places) to.node_places[prefix_ + name] = where;
  for (WeightSource& source : from.weights) {
    source.deformer = Moved(source.deformer);
    if (!source.geometry.empty()) Name(&source.geometry);
    to.weights.push_back(std::move(source));
  }
  for (const PlugRef& plug : from.pinned) to.pinned.push_back(Moved(plug));
  for (PlayedClip& clip : from.played) {
    Name(&clip.id);
    clip.start += place_.start;
    to.played.push_back(std::move(clip));
  }
  for (Index number : from.clip_characters) to.clip_characters.push_back(number + to.characters);
  to.characters += from.characters;
}

// Whose a clip is.
std::set<Index> CharactersOf(const Rig& rig, std::string_view clip) {
  for (const LayeredClip& layered : rig.scene.layered) {
    if (layered.id != clip) continue;
    std::set<Index> all;
    for (const LayeredClip::Layer& layer : layered.layers) all.insert(rig.clip_characters[layer.clip]);
    return all;
  }
  return {rig.clip_characters[rig.character->FindClip(clip)]};
}

// What plays besides a clip: that of the characters which it is not of.
std::vector<PlayedClip> PlayedBeside(const Rig& rig, std::string_view clip) {
  const std::set<Index> taken = CharactersOf(rig, clip);
  std::vector<PlayedClip> others;
  for (const PlayedClip& played : rig.played) {
    const std::set<Index> of = CharactersOf(rig, played.id);
    if (std::none_of(of.begin(), of.end(), [&](Index number) { return taken.count(number) != 0; }))
      others.push_back(played);
  }
  return others;
}

Status AddClips(const std::vector<PlayedClip>& clips, Rig* rig) {
  for (const PlayedClip& clip : clips) {
    KPSA_RETURN_IF_ERROR(AddClip(*rig->character, clip.id, clip.start, &rig->scene, rig->graph.get()));
  }
  return Status();
}

Status DisconnectPinned(Rig* rig) {
  for (const PlugRef& plug : rig->pinned) {
    if (rig->graph->FindConnection(plug) != nullptr) KPSA_RETURN_IF_ERROR(rig->graph->Disconnect(plug));
  }
  return Status();
}

Status Mover::ChooseClip() {
  if (!place_.clip.has_value()) return Status();
  Rig& rig = from_.rig;
  KPSA_RETURN_IF_ERROR(SetClip(*rig.character, *place_.clip, &rig.scene, rig.graph.get()));
  KPSA_RETURN_IF_ERROR(SetClip(*rig.character, std::nullopt, &rig.scene, rig.graph.get()));
  std::vector<PlayedClip> played = PlayedBeside(rig, *place_.clip);
  played.insert(played.begin(), {*place_.clip, 0});
  rig.played = std::move(played);
  return Status();
}

}  // namespace

Status AddReference(const ReferencePlace& place, LoadedRig from, LoadedRig* to) {
  return Mover(place, std::move(from), to).Run();
}

const Reference* ReferenceOf(const Rig& rig, NodeId node) {
  for (const Reference& reference : rig.references) {
    if (reference.Brought(node)) return &reference;
  }
  return nullptr;
}

const Reference* InnermostReference(const Rig& rig, NodeId node) {
  const Reference* innermost = nullptr;  // references come before those within them
  for (const Reference& reference : rig.references) {
    if (reference.Brought(node)) innermost = &reference;
  }
  return innermost;
}

bool IsReferenceRoot(const Rig& rig, NodeId node) {
  return std::any_of(rig.references.begin(), rig.references.end(),
                     [&](const Reference& reference) { return reference.root == node; });
}

Status PlayOwnClips(Rig* rig) {
  KPSA_RETURN_IF_ERROR(SetClip(rig, std::nullopt));
  KPSA_RETURN_IF_ERROR(AddClips(rig->played, rig));
  KPSA_RETURN_IF_ERROR(DisconnectPinned(rig));
  if (rig->played.empty()) return Status();
  std::vector<std::string> ids;
  CharacterClip all;
  std::optional<double> begin;
  for (const PlayedClip& played : rig->played) {
    ids.push_back(played.id);
    for (const CharacterClip& clip : rig->scene.clips) {
      if (clip.id != played.id) continue;
      all.duration = std::max(all.duration, played.start + clip.duration);
      const double first = clip.begin == 0 ? 0 : played.start + clip.begin;
      begin = std::min(begin.value_or(first), first);
    }
  }
  all.begin = begin.value_or(0);
  if (ids.size() > kMaxLabel) {
    ids.resize(kMaxLabel);
    ids.push_back("...");
  }
  all.id = fmt::format("{}", fmt::join(ids, " + "));
  rig->scene.clip = all.id;
  rig->playing = std::move(all);
  return Status();
}

Status SetClip(Rig* rig, std::optional<std::string_view> clip) {
  KPSA_RETURN_IF_ERROR(SetClip(*rig->character, clip, &rig->scene, rig->graph.get()));
  rig->playing.reset();
  if (clip.has_value() && !rig->references.empty())
    KPSA_RETURN_IF_ERROR(AddClips(PlayedBeside(*rig, *clip), rig));
  return DisconnectPinned(rig);
}

}  // namespace kpsa::engine
