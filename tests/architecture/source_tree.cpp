#include "tests/architecture/source_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string_view>

namespace kpsa::engine {
namespace {

const std::set<std::string> kNoRooms = {"build", "docs", "cmake", "out", "node_modules"};

struct RoomRule {
  const char* room;
  std::vector<const char*> may_include;
};
// The host, and so those that stand upon it.
const std::vector<const char*> kHostKnows = {
    "host", "include", "kpsa/training", "kpsa", "rig/build", "rig/character", "rig/file",
    "rig",  "nodes",   "nodes/kernels", "gltf", "files",     "graph",         "base"};
template <typename... Rooms>
std::vector<const char*> Also(Rooms... rooms) {
  std::vector<const char*> known = kHostKnows;
  (known.push_back(rooms), ...);
  return known;
}
// Rooms that are not listed (cli, bench, tests, ...) stand above all: nobody listed may include them.
const std::array<RoomRule, 18> kRooms = {{
    {"include", {"include"}},
    {"base", {"base"}},
    {"graph", {"graph", "base"}},
    {"nodes/kernels", {"nodes/kernels", "base"}},
    {"nodes", {"nodes", "nodes/kernels", "graph", "base"}},
    {"files", {"files", "base"}},
    {"gltf", {"gltf", "files", "base"}},
    {"rig/file", {"rig/file", "graph", "files", "base"}},
    {"rig/character", {"rig/character", "rig", "graph", "gltf", "files", "base"}},
    {"rig/build", {"rig/build", "rig/character", "rig/file", "rig", "graph", "gltf", "files", "base"}},
    {"rig", {"rig", "graph", "base"}},
    {"kpsa/training", {"kpsa/training", "kpsa", "graph", "files", "base"}},
    {"kpsa", {"kpsa", "graph", "files", "base"}},
    {"host", kHostKnows},
    {"report", Also("report")},
    {"picture", Also("picture")},
    {"view", Also("report", "view")},
    {"scenes", {"scenes", "base"}},
}};
const std::set<std::string> kAbove = {"cli", "bench", "tests", "python", "viewer"};

// A library, or a header of ours, and the files that may include it; a trailing * stands for any text.
struct Door {
  const char* library;
  std::vector<const char*> files;
  bool any_source = false;  // and every .cpp
};
const std::array<Door, 16> kDoors = {{
    {"tbb/", {"base/parallel.cpp"}},
    {"oneapi/", {"base/parallel.cpp"}},
    {"yaml-cpp/", {"files/yaml_document.cpp"}},
    {"tiny_gltf",
     {"gltf/accessor.cpp", "gltf/clip.cpp", "gltf/compressed.cpp", "gltf/document.cpp", "gltf/mesh.cpp",
      "gltf/scene.cpp", "gltf/vertex_look.cpp"}},
    {"draco/", {"gltf/draco.cpp", "tests/gltf/draco_test.cpp"}},
    {"meshoptimizer.h", {"gltf/meshopt.cpp", "tests/gltf/meshopt_test.cpp"}},
    {"nlohmann/", {}, true},
    {"embree", {"base/embree.h"}},
    {"base/embree.h", {"base/embree.cpp", "base/triangle_tree.cpp", "nodes/kernels/ray_scene.cpp"}},
    {"CLI/", {"cli/main.cpp", "cli/options.cpp", "cli/describe.cpp"}},
    {"httplib.h", {"view/server.cpp"}},
    {"hwy/", {"base/simd.h", "base/simd-inl.h", "nodes/kernels/xyzw-inl.h"}, true},
    {"zip", {"files/npz.cpp"}},
    {"png.h", {"picture/decode.cpp"}},
    {"jpeglib.h", {"picture/decode.cpp"}},
    // What plays shows none of it to those who include it
    {"Eigen/", {"kpsa/training/*", "bench/*", "tests/*"}, true},
}};

// A name, and the header that declares it: or, for other libraries, how their headers begin.
struct Use {
  const char* name;
  const char* header;
  bool whole_library = false;
};
const std::array<Use, 40> kUses = {{
    {"std::array", "array"},
    {"std::atomic", "atomic"},
    {"std::clamp", "algorithm"},
    {"std::copy_n", "algorithm"},
    {"std::fill", "algorithm"},
    {"std::function", "functional"},
    {"std::int16_t", "cstdint"},
    {"std::int64_t", "cstdint"},
    {"std::invocable", "concepts"},
    {"std::isfinite", "cmath"},
    {"std::make_shared", "memory"},
    {"std::make_unique", "memory"},
    {"std::map", "map"},
    {"std::max", "algorithm"},
    {"std::memcpy", "cstring"},
    {"std::min", "algorithm"},
    {"std::mt19937", "random"},
    {"std::mutex", "mutex"},
    {"std::numeric_limits", "limits"},
    {"std::optional", "optional"},
    {"std::ostream", "iosfwd"},
    {"std::pair", "utility"},
    {"std::set", "set"},
    {"std::shared_ptr", "memory"},
    {"std::sort", "algorithm"},
    {"std::span", "span"},
    {"std::sqrt", "cmath"},
    {"std::string", "string"},
    {"std::string_view", "string_view"},
    {"std::uint16_t", "cstdint"},
    {"std::uint32_t", "cstdint"},
    {"std::uint64_t", "cstdint"},
    {"std::uint8_t", "cstdint"},
    {"std::unique_ptr", "memory"},
    {"std::unordered_map", "unordered_map"},
    {"std::variant", "variant"},
    {"std::vector", "vector"},
    {"Eigen", "Eigen/", true},
    {"fmt", "fmt/", true},
    {"nlohmann", "nlohmann/", true},
}};

// Whether the line uses the name, followed by no further letters; for libraries, as a namespace.
bool UsesWord(std::string_view line, std::string_view name) {
  for (std::size_t at = line.find(name); at != std::string_view::npos; at = line.find(name, at + 1)) {
    const auto letter = [&](std::size_t i) {
      return i < line.size() && (std::isalnum(static_cast<unsigned char>(line[i])) != 0 || line[i] == '_');
    };
    const std::size_t end = at + name.size();
    if ((at > 0 && (letter(at - 1) || line[at - 1] == '<' || line[at - 1] == '/')) || letter(end)) continue;
    if (name.starts_with("std::") || line.substr(end).starts_with("::")) return true;
  }
  return false;
}

bool Matches(std::string_view pattern, std::string_view path) {
  return pattern.ends_with('*') ? path.starts_with(pattern.substr(0, pattern.size() - 1)) : path == pattern;
}

std::string RoomOf(std::string_view path) {
  for (const RoomRule& rule : kRooms) {  // rooms in rooms first
    const std::string_view room = rule.room;
    if (room.find('/') != std::string_view::npos && path.starts_with(room) &&
        path.substr(room.size()).starts_with('/'))
      return std::string(room);
  }
  return std::string(path.substr(0, path.find('/')));
}

SourceFile ReadSource(const std::filesystem::path& file, std::string path) {
  SourceFile source;
  source.path = std::move(path);
  std::ifstream in(file);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    source.code.push_back(line.substr(0, line.find("//")));
    std::size_t at = line.find_first_not_of(" \t");
    if (at == std::string::npos || line[at] != '#') continue;
    at = line.find_first_not_of(" \t", at + 1);
    if (at == std::string::npos) continue;
    const std::string_view directive = std::string_view(line).substr(at);
    if (!directive.starts_with("include")) continue;
    const std::size_t open = line.find_first_of("\"<", at);
    if (open == std::string::npos) continue;
    const std::size_t close = line.find(line[open] == '<' ? '>' : '"', open + 1);
    if (close == std::string::npos) continue;
    source.includes.push_back({line.substr(open + 1, close - open - 1), line[open] == '"', number});
  }
  return source;
}

}  // namespace

std::vector<SourceFile> ReadSourceTree(const std::string& root) {
  namespace fs = std::filesystem;
  std::vector<SourceFile> files;
  for (const fs::directory_entry& room : fs::directory_iterator(root)) {
    const std::string name = room.path().filename().string();
    if (!room.is_directory() || name.starts_with('.') || name.starts_with("build") || kNoRooms.contains(name))
      continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(room.path())) {
      const std::string extension = entry.path().extension().string();
      if (!entry.is_regular_file() || (extension != ".h" && extension != ".cpp")) continue;
      files.push_back(ReadSource(entry.path(), fs::relative(entry.path(), root).generic_string()));
    }
  }
  std::sort(files.begin(), files.end(),
            [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

std::vector<std::string> FindBreaches(const std::vector<SourceFile>& files) {
  std::set<std::string> rooms = kAbove;
  for (const SourceFile& file : files) rooms.insert(RoomOf(file.path));
  for (const RoomRule& rule : kRooms) rooms.insert(rule.room);
  std::set<std::string> face;  // headers that are included as <kpsa/...>, from include/
  for (const SourceFile& file : files) {
    if (file.path.starts_with("include/")) face.insert(file.path.substr(8));
  }
  std::vector<std::string> breaches;
  for (const SourceFile& file : files) {
    const std::string room = RoomOf(file.path);
    const auto rule =
        std::find_if(kRooms.begin(), kRooms.end(), [&](const RoomRule& r) { return r.room == room; });
    for (const Include& include : file.includes) {
      const auto breach = [&](const std::string& what) {
        breaches.push_back(fmt::format("{}:{}: {}", file.path, include.line, what));
      };
      const std::string target = face.contains(include.text) ? "include" : RoomOf(include.text);
      const bool ours = include.text.find('/') != std::string::npos && rooms.contains(target);
      if (include.quoted && include.text.starts_with("..")) {
        breach(fmt::format("\"{}\": includes start at the project's root", include.text));
      } else if (include.quoted && include.text.find('/') == std::string::npos) {
        breach(fmt::format("\"{}\" names no room: includes start at the project's root", include.text));
      } else if (ours && rule != kRooms.end() &&
                 std::find(rule->may_include.begin(), rule->may_include.end(), target) ==
                     rule->may_include.end()) {
        breach(fmt::format("{} may not know {} (\"{}\"), only {}", room, target, include.text,
                           fmt::join(rule->may_include, ", ")));
      }
      if (room == "tests") continue;  // tests may look at what a library says
      for (const Door& door : kDoors) {
        if (!include.text.starts_with(door.library) ||
            (ours && include.quoted && include.text != door.library))
          continue;
        const bool open = std::any_of(door.files.begin(), door.files.end(),
                                      [&](const char* f) { return Matches(f, file.path); });
        if (open || (door.any_source && !file.is_header())) continue;
        breach(fmt::format("<{}> belongs behind {}{}", include.text, door.any_source ? "source files" : "",
                           fmt::join(door.files, ", ")));
      }
    }
  }
  return breaches;
}

std::vector<std::string> FindMissingIncludes(const std::vector<SourceFile>& files) {
  std::map<std::string, const SourceFile*> by_path;
  for (const SourceFile& file : files) by_path[file.path] = &file;
  std::vector<std::string> missing;
  for (const SourceFile& file : files) {
    if (!file.is_header() || file.path.ends_with("-inl.h"))
      continue;  // parts of a source file (Highway's targets)
    // What it includes, through our headers as well
    std::set<std::string> libraries, seen = {file.path};
    std::vector<const SourceFile*> stack = {&file};
    while (!stack.empty()) {
      const SourceFile& from = *stack.back();
      stack.pop_back();
      for (const Include& include : from.includes) {
        const auto ours = by_path.find(include.text);
        if (ours == by_path.end()) libraries.insert(include.text);
        if (ours != by_path.end() && seen.insert(include.text).second) stack.push_back(ours->second);
      }
    }
    for (const Use& use : kUses) {
      const bool there = std::any_of(libraries.begin(), libraries.end(), [&](const std::string& library) {
        return use.whole_library ? library.starts_with(use.header) : library == use.header;
      });
      for (std::size_t i = 0; !there && i < file.code.size(); ++i) {
        if (!UsesWord(file.code[i], use.name)) continue;
        missing.push_back(
            fmt::format("{}:{}: uses {}, but includes no <{}>", file.path, i + 1, use.name, use.header));
        break;
      }
    }
  }
  return missing;
}

}  // namespace kpsa::engine
