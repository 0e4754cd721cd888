#include "io/rest_pose.h"

#include <algorithm>
#include <map>

#include "base/matrix.h"

namespace kpsa {

RestPose::RestPose(const gltf::Character& character, const CharacterGraph& scene)
    : character_(character), scene_(scene), worlds_(character.nodes.size()), points_(scene.meshes.size()) {
  std::map<Index, Index> gltf_of_node;  // by graph node
  for (Index i : character.order) {
    const gltf::Node& node = character.nodes[i];
    worlds_[i] = node.parent == kNoIndex ? node.LocalMatrix() : worlds_[node.parent] * node.LocalMatrix();
    gltf_of_node[scene.transforms[i].index] = i;
  }
  for (const CharacterMesh& mesh : scene.meshes) {
    std::vector<Matrix4> matrices;
    for (std::size_t j = 0; j < mesh.influence_nodes.size(); ++j) {
      matrices.push_back(worlds_[gltf_of_node[mesh.influence_nodes[j].index]] * mesh.inverse_binds[j]);
    }
    influences_.push_back(std::move(matrices));
  }
}

const std::vector<Double3>& RestPose::WorldPoints(std::size_t mesh_index) {
  std::optional<std::vector<Double3>>& cached = points_[mesh_index];
  if (cached.has_value()) return *cached;
  const CharacterMesh& mesh = scene_.meshes[mesh_index];
  const ConstPointsView rest = mesh.mesh().data().rest.view();
  std::vector<Double3> points(rest.count);
  for (std::size_t p = 0; p < rest.count; ++p) points[p] = {rest.x[p], rest.y[p], rest.z[p]};
  for (std::size_t k = 0; k < mesh.weights.size(); ++k) {
    if (mesh.weights[k] == 0) continue;
    const MorphTargets::Target& target = mesh.geometry.targets->targets()[k];
    for (std::size_t i = 0; i < target.points.size(); ++i) {
      const Double3 delta{target.deltas[3 * i], target.deltas[3 * i + 1], target.deltas[3 * i + 2]};
      points[target.points[i]] = points[target.points[i]] + delta * mesh.weights[k];
    }
  }
  if (mesh.influences == nullptr) {
    for (Double3& point : points) point = TransformPoint(worlds_[mesh.gltf_node], point);
  } else {
    const Influences& influences = *mesh.influences;
    for (std::size_t p = 0; p < points.size(); ++p) {
      Double3 sum;
      for (Index i = influences.offsets()[p]; i < influences.offsets()[p + 1]; ++i) {
        sum = sum + TransformPoint(influences_[mesh_index][influences.joints()[i]], points[p]) *
                        influences.weights()[i];
      }
      points[p] = sum;
    }
  }
  cached = std::move(points);
  return *cached;
}

Matrix4 RestPose::WorldFromMesh(std::size_t mesh_index) const {
  const CharacterMesh& mesh = scene_.meshes[mesh_index];
  if (mesh.influences == nullptr || influences_[mesh_index].empty()) return worlds_[mesh.gltf_node];
  std::vector<double> share(influences_[mesh_index].size(), 0.0);
  for (std::size_t i = 0; i < mesh.influences->joints().size(); ++i) {
    share[mesh.influences->joints()[i]] += mesh.influences->weights()[i];
  }
  const auto most = std::max_element(share.begin(), share.end()) - share.begin();
  return influences_[mesh_index][static_cast<std::size_t>(most)];
}

}  // namespace kpsa
