// Inside of the rig builder: what the names in a rig file mean. Nothing outside rig/build includes this.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "rig/build/rig_builder.h"
#include "rig/file/rig_file.h"

namespace kpsa::engine {

// Refers to its arguments. Lookups report unknown and ambiguous names, with the nearest ones, at `where`.
class RigNames {
 public:
  // Of the nodes of `file` and the character of `rig`; those of its graph are looked up as they come.
  RigNames(const RigFile& file, const Rig& rig, YamlErrors* errors);

  // Nodes of the file, whether they could be made or not.
  bool IsWritten(const std::string& name) const { return written_.count(name) != 0; }
  std::size_t Written(const std::string& name) const { return written_.at(name); }  // in RigFile::nodes
  // Whether it is of a node of the file that could not be made, which another error says.
  bool LacksNodeOf(const std::string& plug) const;
  // The glTF node that a node of the graph stands for; kNoIndex for others.
  Index GltfNode(NodeId node) const;

  // Among mesh nodes only: by glTF name, name in outputs, `name#<index>` or path. The index of the mesh.
  std::optional<std::size_t> FindMesh(const std::string& name, const SourceLocation& where) const;
  // Among transforms only: glTF nodes without a mesh first, then the rig's own, then mesh nodes.
  std::optional<NodeId> FindTransform(const std::string& name, const SourceLocation& where) const;
  // MESH@STAGE. Stages may have an @ in their names, too: the longest mesh that exists wins. Without a mesh that
  // exists, the text up to its last @; without an @, all of it is the mesh.
  void SplitStage(const std::string& text, std::string* mesh, std::string* stage) const;
  // No error where a stack lists that node, and another error says why it could not be made.
  const Stage* FindStage(const CharacterMesh& mesh, const std::string& stage,
                         const SourceLocation& where) const;

 private:
  bool Fail(const SourceLocation& where, Status status) const;

  const Rig& rig_;
  YamlErrors* errors_;
  std::unordered_map<std::string, std::size_t> written_;
  std::unordered_set<std::string> in_stacks_;                         // what stacks list
  std::unordered_map<std::string, std::vector<Index>> gltf_by_name_;  // verbatim names
  std::unordered_map<Index, Index> gltf_by_node_;
};

}  // namespace kpsa::engine
