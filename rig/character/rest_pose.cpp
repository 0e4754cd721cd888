#include "rig/character/rest_pose.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "base/matrix.h"

namespace kpsa::engine {

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

std::vector<Double3> RestPose::MeshPoints(std::size_t mesh_index, bool morphed) const {
  const CharacterMesh& mesh = scene_.meshes[mesh_index];
  const ConstPointsView rest = mesh.mesh().data().rest.view();
  std::vector<Double3> points(rest.count);
  for (std::size_t p = 0; p < rest.count; ++p) points[p] = {rest.x[p], rest.y[p], rest.z[p]};
  for (std::size_t k = 0; k < mesh.weights.size() && morphed; ++k) {
    if (mesh.weights[k] == 0) continue;
    const MorphTargets::Target& target = mesh.geometry.targets->targets()[k];
    for (std::size_t i = 0; i < target.points.size(); ++i) {
      const Double3 delta{target.deltas[3 * i], target.deltas[3 * i + 1], target.deltas[3 * i + 2]};
      points[target.points[i]] = points[target.points[i]] + delta * mesh.weights[k];
    }
  }
  return points;
}

const std::vector<Double3>& RestPose::WorldPoints(std::size_t mesh_index) {
  std::optional<std::vector<Double3>>& cached = points_[mesh_index];
  if (cached.has_value()) return *cached;
  const CharacterMesh& mesh = scene_.meshes[mesh_index];
  std::vector<Double3> points = MeshPoints(mesh_index, true);
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

// The joints' matrices in these shares; those of the largest one where that says nothing or cannot be
// inverted.
Matrix4 RestPose::Blend(std::size_t mesh_index, const std::vector<double>& joint_shares) const {
  const std::vector<Matrix4>& joints = influences_[mesh_index];
  const double total = std::accumulate(joint_shares.begin(), joint_shares.end(), 0.0);
  const auto most = std::max_element(joint_shares.begin(), joint_shares.end()) - joint_shares.begin();
  const Matrix4& first = joints[static_cast<std::size_t>(most)];
  // first + the mean of differences: exactly the joints' matrix where they all have the same
  Matrix4 blend = first, inverse;
  for (std::size_t j = 0; j < joints.size() && total > 0; ++j) {
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) blend(r, c) += joint_shares[j] / total * (joints[j](r, c) - first(r, c));
    }
  }
  return Invert(blend, &inverse) ? blend : first;
}

Matrix4 RestPose::WorldFromMesh(std::size_t mesh_index, const std::vector<float>& members) const {
  const CharacterMesh& mesh = scene_.meshes[mesh_index];
  if (mesh.influences == nullptr || influences_[mesh_index].empty()) return worlds_[mesh.gltf_node];
  const Influences& influences = *mesh.influences;
  std::vector<double> shares(influences_[mesh_index].size(), 0.0);
  for (std::size_t p = 0; p + 1 < influences.offsets().size(); ++p) {
    const double member = members.empty() ? 1 : members[p];
    for (Index i = influences.offsets()[p]; i < influences.offsets()[p + 1]; ++i)
      shares[influences.joints()[i]] += member * influences.weights()[i];
  }
  return Blend(mesh_index, shares);
}

Matrix4 RestPose::WorldFromMeshAt(std::size_t mesh_index, const std::vector<Double3>& at, bool morphed) {
  const std::vector<Double3>& points = WorldPoints(mesh_index);
  if (points.empty() || at.empty()) return WorldFromMesh(mesh_index, {});
  const std::vector<Double3> before = MeshPoints(mesh_index, morphed), after = MeshPoints(mesh_index, true);
  std::vector<float> nearest(points.size(), 0.0f);
  Double3 shift;
  for (const Double3& place : at) {
    std::size_t best = 0;
    for (std::size_t p = 1; p < points.size(); ++p) {
      if (Length(points[p] - place) < Length(points[best] - place)) best = p;
    }
    nearest[best] += 1;
    shift = shift + (after[best] - before[best]) * (1 / static_cast<double>(at.size()));
  }
  return WorldFromMesh(mesh_index, nearest) * Translation(shift);
}

}  // namespace kpsa::engine
