// The rest pose of a character in double precision, for what is placed on it when a rig is built: handles,
// curves, falloffs. Rest: the file's node transforms and default morph weights, no clip, no control.
#pragma once

#include <optional>
#include <vector>

#include "rig/character/character_graph.h"

namespace kpsa::engine {

// Refers to both arguments. Positions are computed at the first call for a mesh. Not thread-safe.
class RestPose {
 public:
  RestPose(const gltf::Character& character, const CharacterGraph& scene);

  const Matrix4& NodeWorld(Index gltf_node) const { return worlds_[gltf_node]; }
  // World positions of a mesh's points: morphed by the default weights, then skinned (or moved by the node).
  const std::vector<Double3>& WorldPoints(std::size_t mesh);
  // The same before the skin, in mesh space, after the morphs or before them.
  std::vector<Double3> MeshPoints(std::size_t mesh, bool morphed) const;
  // world_from_mesh: what carries mesh space into the world at rest. For a skinned mesh that is a blend of
  // its joints' world_from_joint * joint_from_mesh, which agree in a file whose rest pose is its bind pose.
  // Where they differ, members (a weight a point; empty: all points) say whose mean to take, and `at` the
  // places in the world at whose nearest points; these are carried to where they are, from before the morphs
  // too.
  Matrix4 WorldFromMesh(std::size_t mesh, const std::vector<float>& members) const;
  Matrix4 WorldFromMeshAt(std::size_t mesh, const std::vector<Double3>& at, bool morphed);

 private:
  Matrix4 Blend(std::size_t mesh, const std::vector<double>& joint_shares) const;
  const gltf::Character& character_;
  const CharacterGraph& scene_;
  std::vector<Matrix4> worlds_;                   // by glTF node
  std::vector<std::vector<Matrix4>> influences_;  // by mesh and joint: world_from_mesh
  std::vector<std::optional<std::vector<Double3>>> points_;
};

}  // namespace kpsa::engine
