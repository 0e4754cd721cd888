#include "host/skin_record.h"

#include <algorithm>
#include <map>

namespace kpsa::engine {
namespace {

const std::string& TypeOf(const Rig& rig, const Stage& stage) { return rig.graph->def(stage.node).name; }

PlugRef PlugOf(const Rig& rig, NodeId node, std::string_view attribute, int element = -1) {
  return {node, rig.graph->def(node).FindAttribute(attribute), element, -1};
}

template <typename T>
const T* AssetOf(const Rig& rig, const Stage& stage, std::string_view attribute) {
  const Value* value = rig.graph->FindValue(PlugOf(rig, stage.node, attribute, stage.geometry));
  return value == nullptr ? nullptr : value->asset<T>();
}

}  // namespace

SkinRecord::SkinRecord(const Rig& rig, const std::vector<std::size_t>& meshes, std::size_t frames)
    : rig_(rig), nodes_(rig.character->nodes.size(), kNoIndex) {
  for (const std::size_t m : meshes) {
    CacheSkin skin;
    std::vector<StageWeights> weights;
    const Status status = Describe(rig.scene.meshes[m], &skin, &weights);
    scene_.reasons.push_back(status.ok() ? "" : status.errors().front().message);
    scene_.meshes.push_back(status.ok() ? std::optional(std::move(skin)) : std::nullopt);
    if (!status.ok()) weights.clear();
    weights_.push_back(std::move(weights));
  }
  std::uint64_t numbers = 16 * scene_.nodes.size();
  for (const std::optional<CacheSkin>& skin : scene_.meshes)
    numbers += skin.has_value() ? skin->targets.size() : 0;
  if (numbers * sizeof(double) * frames <= kMaxBytes) return;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (scene_.reasons[m].empty()) scene_.reasons[m] = "has too many joints for so many frames";
    scene_.meshes[m].reset();
    weights_[m].clear();
  }
  scene_.nodes.clear();
  worlds_.clear();
}

Status SkinRecord::Describe(const CharacterMesh& mesh, CacheSkin* skin, std::vector<StageWeights>* weights) {
  if (mesh.stages.empty() || !(mesh.stages.back().points == mesh.points))
    return Status::Invalid("is accelerated");
  const Stage& last = mesh.stages.back();
  bool placed = false;  // by its skin or its transform
  for (const Stage& stage : mesh.stages) {
    const bool own = stage.node == mesh.skin_cluster || stage.node == mesh.transform_geometry;
    if (!own && (placed || TypeOf(rig_, stage) != "blendShape"))
      return Status::Invalid("has \"{}\" ({}) in its stack", stage.name, TypeOf(rig_, stage));
    placed = placed || own;
  }
  if (!placed) return Status::Invalid("leaves out its skin");
  const Mesh::Data& data = mesh.mesh().data();
  const ConstPointsView rest = data.rest.view();
  for (const Index p : data.vertex_to_point)
    skin->rest.insert(skin->rest.end(), {rest.x[p], rest.y[p], rest.z[p]});
  for (const Stage& stage : mesh.stages) {
    if (&stage != &last) KPSA_RETURN_IF_ERROR(AddTargets(mesh, stage, skin, weights));
  }
  if (last.node == mesh.skin_cluster) {
    AddJoints(mesh, skin);
  } else {
    skin->node = NodeOf(mesh.gltf_node);
  }
  return Status();
}

// With the share of the stage's weight map; points of no share do not move.
Status SkinRecord::AddTargets(const CharacterMesh& mesh, const Stage& stage, CacheSkin* skin,
                              std::vector<StageWeights>* weights) const {
  const auto* targets = AssetOf<MorphTargets>(rig_, stage, "targets");
  const auto* map = AssetOf<WeightMap>(rig_, stage, "weights");
  if (targets == nullptr) return Status();
  const auto list = [&]<typename T>(const char* attribute, const T& none) {
    const Value* value = rig_.graph->FindValue(PlugOf(rig_, stage.node, attribute));
    return value == nullptr ? none : value->get<T>();
  };
  const std::vector<std::int64_t> no_numbers;
  Result<ShapePaths> paths =
      ShapePaths::Make(list("inbetweenTarget", no_numbers), list("inbetweenShape", no_numbers),
                       list("inbetweenWeight", std::vector<double>()), targets->targets().size());
  if (!paths.ok()) return Status::Invalid("has in-betweens that are none");
  StageWeights of_stage{{}, PlugOf(rig_, stage.node, "envelope"), std::move(*paths)};
  std::vector<std::size_t> entry_of(targets->point_count());
  for (std::size_t k = 0; k < targets->targets().size(); ++k) {
    const MorphTargets::Target& from = targets->targets()[k];
    constexpr std::size_t kStill = static_cast<std::size_t>(-1);
    std::fill(entry_of.begin(), entry_of.end(), kStill);
    for (std::size_t i = 0; i < from.points.size(); ++i) entry_of[from.points[i]] = i;
    CacheTarget to{from.name, {}, {}};
    for (Index v = 0; v < mesh.vertex_count; ++v) {
      const Index p = mesh.mesh().data().vertex_to_point[v];
      const float share = map == nullptr ? 1 : map->weights()[p];
      if (entry_of[p] == kStill || share == 0) continue;
      to.vertices.push_back(v);
      for (std::size_t c = 0; c < 3; ++c) to.deltas.push_back(share * from.deltas[3 * entry_of[p] + c]);
    }
    skin->targets.push_back(std::move(to));
    of_stage.weights.push_back(PlugOf(rig_, stage.node, "weight", static_cast<int>(k)));
  }
  weights->push_back(std::move(of_stage));
  return Status();
}

void SkinRecord::AddJoints(const CharacterMesh& mesh, CacheSkin* skin) {
  std::map<Index, Index> gltf_of;  // by node of the graph
  for (Index i = 0; i < rig_.scene.transforms.size(); ++i) gltf_of[rig_.scene.transforms[i].index] = i;
  for (const NodeId joint : mesh.influence_nodes) skin->joints.push_back(NodeOf(gltf_of.at(joint.index)));
  skin->inverse_binds = mesh.inverse_binds;
  const Influences& from = *mesh.influences;
  skin->offsets.push_back(0);
  for (const Index p : mesh.mesh().data().vertex_to_point) {
    for (Index i = from.offsets()[p]; i < from.offsets()[p + 1]; ++i) {
      if (from.weights()[i] == 0) continue;
      skin->influences.push_back(from.joints()[i]);
      skin->shares.push_back(from.weights()[i]);
    }
    skin->offsets.push_back(static_cast<Index>(skin->influences.size()));
  }
}

// With all that it hangs from in the character's file, which come first.
Index SkinRecord::NodeOf(Index gltf_node) {
  std::vector<Index> chain;
  for (Index n = gltf_node; n != kNoIndex && nodes_[n] == kNoIndex; n = rig_.character->nodes[n].parent)
    chain.push_back(n);
  for (auto n = chain.rbegin(); n != chain.rend(); ++n) {
    const Index parent = rig_.character->nodes[*n].parent;
    const NodeId transform = rig_.scene.transforms[*n];
    nodes_[*n] = static_cast<Index>(scene_.nodes.size());
    scene_.nodes.push_back({rig_.graph->name(transform), parent == kNoIndex ? kNoIndex : nodes_[parent], {}});
    worlds_.push_back(PlugOf(rig_, transform, "worldMatrix"));
  }
  return nodes_[gltf_node];
}

void SkinRecord::Ask(Request* request) {
  first_ = static_cast<Index>(request->outputs.size());
  for (const PlugRef& world : worlds_) request->outputs.push_back({world, {}});
  for (const std::vector<StageWeights>& of_mesh : weights_) {
    for (const StageWeights& stage : of_mesh) {
      request->outputs.push_back({stage.envelope, {}});
      for (const PlugRef& weight : stage.weights) request->outputs.push_back({weight, {}});
    }
  }
}

void SkinRecord::Add(const Evaluator& evaluator) {
  Index at = first_;
  for (CacheNode& node : scene_.nodes) node.worlds.push_back(evaluator.Get<Matrix4>(at++));
  std::vector<double> given, weights;
  for (std::size_t m = 0; m < weights_.size(); ++m) {
    for (const StageWeights& stage : weights_[m]) {
      const double envelope = evaluator.Get<double>(at++);
      given.clear();
      for (std::size_t k = 0; k < stage.weights.size(); ++k) given.push_back(evaluator.Get<double>(at++));
      weights = given;
      stage.paths.Apply([&](std::size_t target) { return given[target]; }, weights);
      for (const double weight : weights) scene_.meshes[m]->weights.push_back(weight * envelope);
    }
  }
}

}  // namespace kpsa::engine
