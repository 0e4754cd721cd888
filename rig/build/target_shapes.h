// Inside of the rig builder: what the targets of a rig's blend shapes are. Nothing outside rig/build includes this.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "rig/build/made_nodes.h"
#include "rig/character/shape_file.h"

namespace kpsa::engine {

// Where the displacements of a target come from.
struct TargetSource {
  const YamlNode* at;                    // the entry of `targets`
  const FileShape* shape;                // null: morph targets of that name, of each mesh that has one
  const ShapeFile* file;                 // of the shape
  bool displacements = true;             // what its numbers are; false: positions
  double metres = 1;                     // one of its units
  std::optional<std::string> mesh = {};  // whose points it moves; unset: those of the only mesh
};

// A target: one shape, or one for each of several meshes.
struct NamedTarget {
  std::string name;
  std::vector<TargetSource> sources;
};

// Refers to its arguments, and to the nodes of the rig file. Files are read once.
class TargetShapes {
 public:
  // Reads the files and writes Rig::files.
  TargetShapes(const BuildInput& in, Rig* rig) : in_(in), rig_(rig) {}

  // `targets: [smile, {file: fix.npz}]` of a blend shape: its targets in their order. False after an error.
  bool Read(NodeId node, const RigAttribute& targets);
  // Of a node whose `targets` were read; null after an error.
  const std::vector<NamedTarget>* Find(NodeId node) const;

 private:
  bool ReadEntry(const YamlNode& entry, int source, std::vector<NamedTarget>* targets);
  bool ReadFileEntry(const YamlNode& entry, int source, std::vector<NamedTarget>* targets);
  bool Add(const std::string& name, const TargetSource& source, std::vector<NamedTarget>* targets);
  const ShapeFile* FindFile(const YamlNode& reference, const std::string& path);

  const BuildInput& in_;
  Rig* rig_;
  std::map<std::string, std::optional<ShapeFile>> files_;  // by path; none: it could not be read
  std::unordered_map<Index, std::vector<NamedTarget>> targets_;
};

}  // namespace kpsa::engine
