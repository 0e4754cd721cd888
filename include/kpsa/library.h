// The node types that rigs are made of: the standard ones, KPSA's, and those of plugins.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kpsa/node_type.h"
#include "kpsa/result.h"

namespace kpsa {

class Rig;

struct LoadOptions {
  std::optional<std::string> variant = {};  // of the rig's `variants`, or hero:NAME of a reference's
  std::optional<double> fps = {};           // frames a second, instead of the rig's
  bool plugins = true;  // false: a rig that names plugins is refused, and no foreign code is loaded
  // A rig names files of its own folder, or of the project around that (a folder with a file kpsa.project), and of
  // these folders and those of the environment's KPSA_TRUST (docs/safety.md). Others are refused.
  std::vector<std::string> trust = {};
};

// May be copied (copies share it) and used by several threads at once: types may be added while others load, train
// and play. What it has loaded keeps it alive.
class Library {
 public:
  Library();
  ~Library();
  Library(const Library&);
  Library& operator=(const Library&);

  // A shared library of node types (graph/plugin.h), for rigs that are loaded from then on. It stays loaded
  // until the program ends. Errors: no such library, another ABI version, a type whose name is taken or whose
  // declaration is wrong; nothing of it is added then.
  Result<Done> AddPlugin(const std::string& path);
  // A node type that a function of this program computes (kpsa/node_type.h), for rigs that are loaded from then on.
  // Errors: a name that is taken, a declaration that is wrong.
  Result<Done> AddNode(const NodeType& type);
  // A rig (.yaml) or a character (.glb, .gltf, .vrm), which is a rig, too. Errors: all of the file's, each
  // with its place.
  Result<Rig> Load(const std::string& path, const LoadOptions& options = {}) const;

 private:
  struct Impl;
  friend class Rig;
  std::shared_ptr<Impl> impl_;
};

std::string_view Version();  // "0.1.0"

}  // namespace kpsa
