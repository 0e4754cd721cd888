// What is in a file, as facts for people and programs.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/status.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// One table of facts: a fact a row.
struct FactTable {
  std::string name;
  std::vector<std::string> columns;  // '>' first: right-aligned
  using Cell = std::variant<std::string, double, std::uint64_t>;
  std::vector<std::vector<Cell>> rows;
  std::vector<std::uint32_t> depths = {};  // by row, of a tree's: texts are indented, JSON says "depth"
};
struct FileFacts {
  std::string kind;  // "character", "rig", "npz", ...
  std::vector<std::pair<std::string, FactTable::Cell>> facts;
  std::vector<FactTable> tables;
  std::vector<std::string> notes;
};

// Of any file that kpsa reads or writes but rigs, by suffix: .glb .gltf .vrm .npz .obj .pc2 .mdd .kpsa .json (weight
// maps). `fps`: of .pc2 files, and of the frames that a character's clips are counted in.
Result<FileFacts> InspectFile(const std::string& path, double fps);
FileFacts RigFacts(const Rig& rig);

// One kind each; see InspectFile.
Result<FileFacts> InspectCharacter(const std::string& path, double fps);
Result<FileFacts> InspectNpz(const std::string& path);
Result<FileFacts> InspectObj(const std::string& path);
Result<FileFacts> InspectPointCache(const std::string& path, double fps);
Result<FileFacts> InspectSubspace(const std::string& path);
Result<FileFacts> InspectWeights(const std::string& path);

// For people, and a JSON document for programs. `path`: as the user named the file.
std::string FactsText(const std::string& path, const FileFacts& facts);
std::string FactsJson(const std::string& path, const FileFacts& facts);

}  // namespace kpsa::engine
