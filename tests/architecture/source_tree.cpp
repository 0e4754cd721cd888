#include "tests/architecture/source_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>
#include <thread>

namespace kpsa {
namespace {

const std::set<std::string> kNoRooms = {"build", "docs", "cmake", "out", "node_modules"};

struct RoomRule {
  const char* room;
  std::vector<const char*> may_include;
};
// Rooms that are not listed (cli, bench, tests, ...) stand above all: nobody listed may include them.
const std::array<RoomRule, 7> kRooms = {{
    {"base", {"base"}},
    {"graph", {"graph", "base"}},
    {"nodes/kernels", {"nodes/kernels", "base"}},
    {"nodes", {"nodes", "nodes/kernels", "graph", "base"}},
    {"kpsa", {"kpsa", "graph", "base"}},
    {"io", {"io", "graph", "base"}},
    {"scenes", {"scenes", "base"}},
}};
const std::set<std::string> kAbove = {"cli", "bench", "tests", "python", "viewer"};

// A library and the files that may include it; a trailing * stands for any text.
struct Door {
  const char* library;
  std::vector<const char*> files;
  bool any_source = false;  // and every .cpp
};
const std::array<Door, 9> kDoors = {{
    {"tbb/", {"base/parallel.cpp"}},
    {"oneapi/", {"base/parallel.cpp"}},
    {"yaml-cpp/", {"io/yaml_document.cpp"}},
    {"tiny_gltf", {"io/gltf_accessor.cpp", "io/gltf_clip.cpp", "io/gltf_document.cpp", "io/gltf_mesh.cpp", "io/gltf_scene.cpp"}},
    {"nlohmann/", {}, true},
    {"embree", {"nodes/kernels/ray_scene.cpp"}},
    {"CLI/", {"cli/main.cpp", "cli/options.cpp"}},
    {"hwy/", {"base/simd.h", "base/simd-inl.h", "nodes/kernels/xyzw-inl.h"}, true},
    {"zip", {"io/npz.cpp"}},
}};

bool Matches(std::string_view pattern, std::string_view path) {
  return pattern.ends_with('*') ? path.starts_with(pattern.substr(0, pattern.size() - 1)) : path == pattern;
}

std::string RoomOf(std::string_view path) {
  if (path.starts_with("nodes/kernels/")) return "nodes/kernels";
  return std::string(path.substr(0, path.find('/')));
}

SourceFile ReadSource(const std::filesystem::path& file, std::string path) {
  SourceFile source;
  source.path = std::move(path);
  std::ifstream in(file);
  std::string line;
  bool directive_before = false;
  for (int number = 1; std::getline(in, line); ++number) {
    std::size_t at = line.find_first_not_of(" \t");
    if (at == std::string::npos || line[at] != '#') continue;
    at = line.find_first_not_of(" \t", at + 1);
    if (at == std::string::npos) continue;
    const std::string_view directive = std::string_view(line).substr(at);
    if (directive.starts_with("pragma once")) continue;
    if (!directive.starts_with("include")) {
      directive_before = true;
      continue;
    }
    const std::size_t open = line.find_first_of("\"<", at);
    if (open == std::string::npos) continue;
    const std::size_t close = line.find(line[open] == '<' ? '>' : '"', open + 1);
    if (close == std::string::npos) continue;
    if (source.includes.empty()) source.include_comes_first = !directive_before;
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
    if (!room.is_directory() || name.starts_with('.') || name.starts_with("build") || kNoRooms.contains(name)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(room.path())) {
      const std::string extension = entry.path().extension().string();
      if (!entry.is_regular_file() || (extension != ".h" && extension != ".cpp")) continue;
      files.push_back(ReadSource(entry.path(), fs::relative(entry.path(), root).generic_string()));
    }
  }
  std::sort(files.begin(), files.end(), [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

std::vector<std::string> FindBreaches(const std::vector<SourceFile>& files) {
  std::set<std::string> rooms = kAbove;
  for (const SourceFile& file : files) rooms.insert(RoomOf(file.path));
  for (const RoomRule& rule : kRooms) rooms.insert(rule.room);
  std::vector<std::string> breaches;
  for (const SourceFile& file : files) {
    const std::string room = RoomOf(file.path);
    const auto rule = std::find_if(kRooms.begin(), kRooms.end(), [&](const RoomRule& r) { return r.room == room; });
    for (const Include& include : file.includes) {
      const auto breach = [&](const std::string& what) { breaches.push_back(fmt::format("{}:{}: {}", file.path, include.line, what)); };
      const std::string target = RoomOf(include.text);
      const bool ours = include.text.find('/') != std::string::npos && rooms.contains(target);
      if (include.quoted && include.text.starts_with("..")) {
        breach(fmt::format("\"{}\": includes start at the project's root", include.text));
      } else if (include.quoted && include.text.find('/') == std::string::npos) {
        breach(fmt::format("\"{}\" names no room: includes start at the project's root", include.text));
      } else if (ours && rule != kRooms.end() && std::find(rule->may_include.begin(), rule->may_include.end(), target) == rule->may_include.end()) {
        breach(fmt::format("{} may not know {} (\"{}\"), only {}", room, target, include.text, fmt::join(rule->may_include, ", ")));
      }
      if (room == "tests") continue;  // tests may look at what a library says
      for (const Door& door : kDoors) {
        if (!include.text.starts_with(door.library) || (ours && include.quoted)) continue;
        const bool open = std::any_of(door.files.begin(), door.files.end(), [&](const char* f) { return Matches(f, file.path); });
        if (open || (door.any_source && !file.is_header())) continue;
        breach(fmt::format("<{}> belongs behind {}{}", include.text, door.any_source ? "source files" : "", fmt::join(door.files, ", ")));
      }
    }
  }
  return breaches;
}

std::vector<std::string> UnprovenHeaders(const std::vector<SourceFile>& files) {
  std::set<std::string> proven;
  for (const SourceFile& file : files) {
    if (!file.is_header() && file.include_comes_first && file.includes.front().quoted) proven.insert(file.includes.front().text);
  }
  std::vector<std::string> unproven;
  for (const SourceFile& file : files) {
    // *-inl.h are parts of one translation unit for each vector unit (Highway's foreach_target.h), and no headers
    if (file.is_header() && !file.path.ends_with("-inl.h") && !proven.contains(file.path)) unproven.push_back(file.path);
  }
  return unproven;
}

std::vector<std::string> CompileAlone(const std::string& root, const std::vector<std::string>& headers) {
  std::vector<std::string> errors;
  std::mutex mutex;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < headers.size(); i = next++) {
      const std::string command = fmt::format("echo '#include \"{}\"' | \"{}\" -std=c++20 -w -fsyntax-only -I\"{}\" -isystem \"{}\" -x c++ - 2>&1",
                                              headers[i], KPSA_COMPILER, root, KPSA_EIGEN);
      std::string output;
      std::FILE* pipe = popen(command.c_str(), "r");
      std::array<char, 4096> buffer;
      for (std::size_t size; pipe != nullptr && (size = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) output.append(buffer.data(), size);
      const int status = pipe == nullptr ? -1 : pclose(pipe);
      if (status == 0) continue;
      std::lock_guard<std::mutex> lock(mutex);
      errors.push_back(fmt::format("{} does not compile by itself:\n{}", headers[i], output.substr(0, 2000)));
    }
  };
  std::thread other(work);
  work();
  other.join();
  std::sort(errors.begin(), errors.end());
  return errors;
}

}  // namespace kpsa
