// What is in a file, as facts for people and programs.
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

// One table of facts: a fact a row.
struct FactTable {
  std::string name;
  std::vector<std::string> columns;  // '>' first: right-aligned
  using Cell = std::variant<std::string, double, std::uint64_t>;
  std::vector<std::vector<Cell>> rows;
};
struct FileFacts {
  std::string kind;  // "character", "rig", "npz", ...
  std::vector<std::pair<std::string, FactTable::Cell>> facts;
  std::vector<FactTable> tables;
  std::vector<std::string> notes;
};

// Of any file that kpsa reads or writes, by suffix: .glb .gltf .vrm .yaml .yml .npz .pc2 .mdd .kpsa .json
// (weight maps). `plugins` are libraries of nodes for rigs.
Result<FileFacts> InspectFile(const std::string& path, double fps, const std::vector<std::string>& plugins);

// One kind each; see InspectFile.
Result<FileFacts> InspectCharacter(const std::string& path);
Result<FileFacts> InspectRig(const std::string& path, const std::vector<std::string>& plugins);
Result<FileFacts> InspectNpz(const std::string& path);
Result<FileFacts> InspectPointCache(const std::string& path, double fps);
Result<FileFacts> InspectSubspace(const std::string& path);
Result<FileFacts> InspectWeights(const std::string& path);

}  // namespace kpsa::engine
