#include "rig/character/character_graph.h"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <unordered_set>

#include "rig/character/character_vrm.h"
#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxPathBytes = 512;
constexpr std::size_t kMaxAllPathBytes = 8u << 20;

class Builder {
 public:
  Builder(const gltf::Character& character, const CharacterOptions& options, Graph* graph)
      : character_(character),
        options_(options),
        graph_(graph),
        edit_(graph),
        vrm_(character, &scene_, graph) {}

  Result<CharacterGraph> Build() {
    KPSA_RETURN_IF_ERROR(CheckSizes());
    scene_.notes = character_.warnings;
    for (const gltf::Clip& clip : character_.clips) scene_.clips.push_back({clip.id, clip.duration});
    const NodeId time = edit_.Add("time", "time");
    scene_.time = edit_.Plug(time, "time");
    AddTransforms();
    if (edit_.ok()) edit_.Check(vrm_.AddExpressions());
    const std::vector<std::string> names = character_.UniqueNames();
    for (Index node : character_.MeshNodes()) {
      if (edit_.ok()) AddMesh(node, names[node]);
    }
    if (edit_.ok()) edit_.Check(vrm_.AddConstraints());
    if (!edit_.ok()) return edit_.Take();

    FindClipPlugs();

    std::optional<std::string_view> clip;
    if (options_.clip.has_value()) {
      clip = *options_.clip;
    } else if (!options_.rest && !scene_.clips.empty()) {
      clip = scene_.clips.front().id;
    }
    KPSA_RETURN_IF_ERROR(SetClip(character_, clip, &scene_, graph_));
    return std::move(scene_);
  }

 private:
  Status CheckSizes() const {
    std::uint64_t points = 0;
    for (Index n : character_.MeshNodes()) {
      const gltf::Mesh& mesh = character_.meshes[character_.nodes[n].mesh];
      points += mesh.vertex_count();
      if (points > kMaxCharacterPoints) {
        return Status::Invalid("{}: the mesh nodes of the scene have more than {} vertices", character_.path,
                               kMaxCharacterPoints);
      }
      if (mesh.targets.size() > kMaxMorphTargets) {
        return Status::Invalid("{}: mesh of nodes[{}] has {} morph targets; at most {} are supported",
                               character_.path, n, mesh.targets.size(), kMaxMorphTargets);
      }
      const Index skin = character_.nodes[n].skin;
      if (skin != kNoIndex && character_.skins[skin].joints.size() > kMaxSkinJoints) {
        return Status::Invalid("{}: skins[{}] has {} joints; at most {} are supported", character_.path, skin,
                               character_.skins[skin].joints.size(), kMaxSkinJoints);
      }
    }
    return Status();
  }

  void FindClipPlugs() {
    std::unordered_map<Index, Index> weights;  // by glTF node: whose weights its channels are
    for (const CharacterMesh& mesh : scene_.meshes) {
      if (mesh.blend_shape.version != 0) weights[mesh.gltf_node] = mesh.weights_node().index;
    }
    for (const gltf::Clip& clip : character_.clips) {
      for (const gltf::Channel& channel : clip.channels) {
        if (channel.path != gltf::Path::kWeights) {
          scene_.clip_transforms.insert(scene_.transforms[channel.node].index);
        } else if (const auto it = weights.find(channel.node); it != weights.end()) {
          scene_.clip_weights.insert(it->second);
        }
      }
    }
  }

  // Graph names of all glTF nodes: verbatim where nobody shares them.
  std::vector<std::string> TransformNames(std::vector<std::string>* verbatim) const {
    std::unordered_map<std::string, int> count{{"time", 1}};
    for (std::size_t i = 0; i < character_.nodes.size(); ++i) {
      const std::string& name = character_.nodes[i].name;
      verbatim->push_back(name.empty() ? fmt::format("node{}", i) : name);
      ++count[verbatim->back()];
    }
    std::vector<std::string> names(*verbatim);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (count[(*verbatim)[i]] == 1) continue;
      names[i] += fmt::format("#{}", i);
      while (count.count(names[i]) != 0) names[i] += '#';  // somebody is really called that
      count[names[i]] = 1;
    }
    return names;
  }

  void AddTransforms() {
    std::vector<std::string> verbatim;
    const std::vector<std::string> names = TransformNames(&verbatim);
    scene_.transforms.resize(names.size());
    for (Index i : character_.order) {  // parents first: connecting them then needs no search for cycles
      const gltf::Node& from = character_.nodes[i];
      const NodeId node = edit_.Add("transform", names[i]);
      if (!edit_.ok()) return;
      scene_.transforms[i] = node;
      const Matrix4 local = from.LocalMatrix();
      edit_.Set(node, "offsetParentMatrix", local);
      edit_.Set(node, "restMatrix", local);
      if (from.parent != kNoIndex) {
        edit_.Connect(edit_.Plug(scene_.transforms[from.parent], "worldMatrix"),
                      edit_.Plug(node, "parentMatrix"));
      }
    }
    AddAliases(verbatim, names);
  }

  // The bare name of those that share it, and paths.
  void AddAliases(const std::vector<std::string>& verbatim, const std::vector<std::string>& names) {
    std::unordered_set<std::string> taken(names.begin(), names.end());
    taken.insert("time");
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] != verbatim[i] && verbatim[i] != "time")
        graph_->AddAlias(scene_.transforms[i], verbatim[i]);
    }
    // `time` is the node of the time; what that lacks may be said of the only transform of that name
    if (std::count(verbatim.begin(), verbatim.end(), "time") == 1) {
      const auto at = std::find(verbatim.begin(), verbatim.end(), "time") - verbatim.begin();
      graph_->AddDelegate(scene_.time.node, scene_.transforms[static_cast<std::size_t>(at)]);
    }
    std::vector<std::string> paths(names.size());
    std::size_t bytes = 0;
    for (Index i : character_.order) {
      const Index parent = character_.nodes[i].parent;
      if (parent != kNoIndex && paths[parent].empty()) continue;
      std::string path = (parent == kNoIndex ? "" : paths[parent]) + "/" + verbatim[i];
      if (path.size() > kMaxPathBytes || bytes + path.size() > kMaxAllPathBytes) continue;
      bytes += path.size();
      if (taken.count(path) == 0) graph_->AddAlias(scene_.transforms[i], path);
      paths[i] = std::move(path);
    }
  }

  // A node of ours for a mesh; its name gives way to the file's.
  NodeId AddOwn(std::string_view type, const CharacterMesh& mesh, std::string_view suffix) {
    return edit_.AddFresh(type, fmt::format("{}_{}", mesh.name, suffix), fmt::format("#{}", mesh.gltf_node));
  }

  void AddMesh(Index gltf_node, const std::string& name) {
    const gltf::Node& from = character_.nodes[gltf_node];
    const gltf::Mesh& gltf_mesh = character_.meshes[from.mesh];
    CharacterMesh mesh;
    mesh.name = name;
    mesh.gltf_node = gltf_node;
    mesh.visible = from.visible;
    mesh.vertex_count = static_cast<Index>(gltf_mesh.vertex_count());
    mesh.transform = scene_.transforms[gltf_node];
    auto it = welded_.find(from.mesh);  // instances of a mesh share its geometry
    if (it == welded_.end()) {
      it = welded_.emplace(from.mesh, WeldMesh(character_, from.mesh, name, options_.weld)).first;
    }
    mesh.geometry = it->second;
    for (std::size_t p = 0; p < gltf_mesh.primitives.size(); ++p) {
      const gltf::Primitive& primitive = gltf_mesh.primitives[p];
      mesh.primitives.push_back(
          {fmt::format("{}/{}", name, p), primitive.first_vertex, primitive.vertex_count});
    }

    mesh.rest = AddOwn("mesh", mesh, "mesh");
    if (!edit_.ok()) return;
    edit_.Set(mesh.rest, "mesh", mesh.geometry.mesh);
    mesh.at_rest = {"rest", mesh.rest, 0, false, edit_.Plug(mesh.rest, "points")};
    if (mesh.geometry.targets != nullptr) AddBlendShape(from, gltf_mesh, &mesh);
    if (from.skin != kNoIndex && gltf_mesh.skinned()) {
      AddSkinCluster(from.skin, gltf_mesh, &mesh);
    } else if (edit_.ok()) {
      mesh.transform_geometry = AddOwn("transformGeometry", mesh, "transformGeometry");
      if (edit_.ok())
        edit_.Connect(edit_.Plug(mesh.transform, "worldMatrix"),
                      edit_.Plug(mesh.transform_geometry, "matrix"));
    }
    graph_->AddDelegate(mesh.transform, mesh.rest);
    edit_.Check(ConnectStages(OwnStages(mesh), &mesh, graph_));
    scene_.meshes.push_back(std::move(mesh));
  }

  void AddBlendShape(const gltf::Node& from, const gltf::Mesh& gltf_mesh, CharacterMesh* mesh) {
    mesh->blend_shape = AddOwn("blendShape", *mesh, "blendShape");
    if (!edit_.ok()) return;
    edit_.Set(mesh->blend_shape, "targets", 0, mesh->geometry.targets);
    mesh->weights = from.weights.empty() ? gltf_mesh.weights : from.weights;
    mesh->weights.resize(gltf_mesh.targets.size(), 0.0);
    std::vector<std::string> names;
    for (const MorphTargets::Target& target : mesh->geometry.targets->targets()) names.push_back(target.name);
    const PlugRef weight = edit_.Plug(mesh->blend_shape, "weight", 0);
    if (!edit_.ok()) return;
    edit_.Check(vrm_.AddMorphWeights(names, mesh));
    graph_->SetElementNames(mesh->blend_shape, weight.attribute, std::move(names));
    for (std::size_t k = 0; k < mesh->weights.size(); ++k) {
      if (mesh->weights[k] != 0)
        edit_.Set(mesh->weights_node(), "weight", static_cast<int>(k), mesh->weights[k]);
    }
    if (mesh->morph_weights.version != 0) graph_->AddDelegate(mesh->transform, mesh->morph_weights);
    graph_->AddDelegate(mesh->transform, mesh->blend_shape);
  }

  // The mesh node's own transform is ignored (glTF 2.0, 3.7.3.3), except by primitives without influences.
  void AddSkinCluster(Index skin_index, const gltf::Mesh& gltf_mesh, CharacterMesh* mesh) {
    const gltf::Skin& skin = character_.skins[skin_index];
    mesh->skin_cluster = AddOwn("skinCluster", *mesh, "skinCluster");
    if (!edit_.ok()) return;
    bool needs_node = false;
    mesh->influences =
        PointInfluences(gltf_mesh, mesh->geometry, static_cast<Index>(skin.joints.size()), &needs_node);
    edit_.Set(mesh->skin_cluster, "influences", 0, mesh->influences);
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      mesh->influence_nodes.push_back(scene_.transforms[skin.joints[j]]);
      mesh->inverse_binds.push_back(skin.inverse_bind_matrices[j]);
    }
    if (needs_node) {
      mesh->influence_nodes.push_back(mesh->transform);
      mesh->inverse_binds.push_back(Matrix4());
    }
    for (std::size_t j = 0; j < mesh->influence_nodes.size(); ++j) {
      const int element = static_cast<int>(j);
      edit_.Set(mesh->skin_cluster, "bindPreMatrix", element, mesh->inverse_binds[j]);
      edit_.Connect(edit_.Plug(mesh->influence_nodes[j], "worldMatrix"),
                    edit_.Plug(mesh->skin_cluster, "matrix", element));
    }
  }

 private:
  const gltf::Character& character_;
  const CharacterOptions& options_;
  Graph* graph_;
  GraphEditor edit_;
  CharacterGraph scene_;
  VrmGraph vrm_;
  std::map<Index, WeldedMesh> welded_;
};

}  // namespace

const Stage* CharacterMesh::FindStage(std::string_view stage) const {
  for (const Stage& s : stages) {
    if (s.name == stage) return &s;
  }
  const Stage* found = nullptr;
  for (const Stage& s : stages) {
    const bool own = s.node == blend_shape || s.node == skin_cluster || s.node == transform_geometry;
    if (own && (stage == "gltf" || (stage == "skin" && s.node == transform_geometry))) found = &s;
  }
  return found == nullptr && stage == at_rest.name ? &at_rest : found;
}

std::vector<Stage> OwnStages(const CharacterMesh& mesh) {
  std::vector<Stage> stages;
  if (mesh.blend_shape.version != 0) stages.push_back({"morph", mesh.blend_shape, 0, false, {}});
  if (mesh.skin_cluster.version != 0) stages.push_back({"skin", mesh.skin_cluster, 0, true, {}});
  if (mesh.transform_geometry.version != 0)
    stages.push_back({"transform", mesh.transform_geometry, 0, true, {}});
  return stages;
}

Status ConnectStages(std::vector<Stage> stages, CharacterMesh* mesh, Graph* graph) {
  GraphEditor edit(graph);
  // All old links go first: a new order may look like a cycle among them
  std::vector<Stage> old = std::move(mesh->stages);
  for (const Stage& own : OwnStages(*mesh)) old.push_back(own);
  for (const Stage& stage : old) {
    const PlugRef in = edit.Plug(stage.node, "inPoints", stage.geometry);
    if (edit.ok() && graph->FindConnection(in) != nullptr) edit.Check(graph->Disconnect(in));
  }
  PlugRef points = edit.Plug(mesh->rest, "points");
  bool world = false;
  for (Stage& stage : stages) {
    if (!edit.ok()) break;
    if (edit.Has(stage.node, "mesh")) edit.Set(stage.node, "mesh", stage.geometry, mesh->geometry.mesh);
    if (edit.Has(stage.node, "space")) edit.Set(stage.node, "space", Value(stage.world ? "world" : "mesh"));
    edit.Connect(points, edit.Plug(stage.node, "inPoints", stage.geometry));
    stage.points = edit.Plug(stage.node, "outPoints", stage.geometry);
    points = stage.points;
    world = stage.world;
  }
  mesh->stages = std::move(stages);
  mesh->points = points;
  mesh->world = world;
  return edit.Take();
}

Result<CharacterGraph> BuildCharacterGraph(const gltf::Character& character, const CharacterOptions& options,
                                           Graph* graph) {
  return Builder(character, options, graph).Build();
}

std::vector<std::size_t> ShownMeshes(const CharacterGraph& scene) {
  const std::vector<CharacterMesh>& meshes = scene.meshes;
  const bool any = std::any_of(meshes.begin(), meshes.end(), [](const auto& mesh) { return mesh.visible; });
  std::vector<std::size_t> shown;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (meshes[m].visible || !any) shown.push_back(m);
  }
  return shown;
}

}  // namespace kpsa::engine
