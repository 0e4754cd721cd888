// Inside of the rig builder: the nodes of a rig file in the graph, as the steps hand them on. Nothing outside
// rig/build includes this.
#pragma once

#include <deque>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "rig/build/build_input.h"

namespace kpsa::engine {

using Places = std::vector<Double3>;                   // in the world at rest, metres
using RestCurves = std::unordered_map<Index, Places>;  // cvs by node of the graph

// What one geometry of a deformer is.
struct DeformedGeometry {
  std::string name;
  std::optional<std::size_t> mesh;  // in scene.meshes; none: a points attribute
  std::size_t count = 0;            // points
  bool morphed = true;              // after the mesh's morphs in its stack
  Matrix4 world_from_stage = {};    // at rest; the identity for stages in world space
};
Index VertexCount(const CharacterGraph& scene, const DeformedGeometry& of);
Index PointOf(const CharacterGraph& scene, const DeformedGeometry& of, Index vertex);

// A node of the rig file, and those of its keys that are no attributes.
struct MadeNode {
  const RigNode* from;
  NodeId id;
  std::map<std::string, const RigAttribute*> special = {};  // parent, at, members, driver, ...
  bool placed = false, placing = false;                     // `at` was followed
  std::vector<DeformedGeometry> geometries = {};            // that it deforms
  std::size_t weighted = 0;                                 // geometries whose weights are set
  bool world = false;                                       // space of the stages that it is in

  // Null where the file does not write the key.
  const RigAttribute* Find(const std::string& key) const {
    const auto it = special.find(key);
    return it == special.end() ? nullptr : it->second;
  }
};

// In the order of the file. References stay valid until the next Add.
class MadeNodes {
 public:
  void Add(const RigNode& from, NodeId id);
  MadeNode* Find(NodeId id);
  MadeNode* Find(const std::string& name);
  const MadeNode* Find(NodeId id) const { return const_cast<MadeNodes*>(this)->Find(id); }
  const MadeNode* Find(const std::string& name) const { return const_cast<MadeNodes*>(this)->Find(name); }
  auto begin() { return list_.begin(); }
  auto end() { return list_.end(); }
  auto begin() const { return list_.begin(); }
  auto end() const { return list_.end(); }

 private:
  std::vector<MadeNode> list_;
  std::unordered_map<Index, std::size_t> by_node_;
  std::unordered_map<std::string, std::size_t> by_name_;
};

// Deformers of the character's file of which overrides set keys that are no attributes.
struct OwnDeformers {
  std::vector<MadeNode> made;
  std::deque<RigNode> nodes;  // what `made` refers to
  std::deque<RigAttribute> attributes;
};

// A node of the file that has all the outputs that are wanted of it; none, with an error, where `name` names no
// such node.
std::optional<NodeId> FindWithOutputs(const BuildInput& in, const MadeNodes& nodes, const YamlNode& name,
                                      std::initializer_list<const char*> outputs, const char* what);

inline const char* SpaceName(bool world) { return world ? "world space" : "mesh space (before the skin)"; }

}  // namespace kpsa::engine
