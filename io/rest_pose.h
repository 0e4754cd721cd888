// The rest pose of a character in double precision, for what is placed on it when a rig is built: handles,
// curves, falloffs. Rest: the file's node transforms and default morph weights, no clip, no control.
#pragma once

#include <optional>
#include <vector>

#include "io/character_graph.h"

namespace kpsa {

// Refers to both arguments. Positions are computed at the first call for a mesh. Not thread-safe.
class RestPose {
 public:
  RestPose(const gltf::Character& character, const CharacterGraph& scene);

  const Matrix4& NodeWorld(Index gltf_node) const { return worlds_[gltf_node]; }
  // World positions of a mesh's points: morphed by the default weights, then skinned (or moved by the node).
  const std::vector<Double3>& WorldPoints(std::size_t mesh);
  // world_from_mesh: what carries mesh space into the world at rest. For a skinned mesh that is its joints'
  // matrix world_from_joint * joint_from_mesh; the joint with the most weight speaks for all (in a file whose
  // rest pose is its bind pose they agree).
  Matrix4 WorldFromMesh(std::size_t mesh) const;

 private:
  const gltf::Character& character_;
  const CharacterGraph& scene_;
  std::vector<Matrix4> worlds_;                   // by glTF node
  std::vector<std::vector<Matrix4>> influences_;  // by mesh and joint: world_from_mesh
  std::vector<std::optional<std::vector<Double3>>> points_;
};

}  // namespace kpsa
