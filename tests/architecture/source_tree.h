// The source tree as text: which files there are, what they include, and what they may.
#pragma once

#include <string>
#include <vector>

namespace kpsa::engine {

struct Include {
  std::string text;  // as written, without quotes or angle brackets
  bool quoted = false;
  int line = 0;
};

struct SourceFile {
  std::string path;  // from the root, with slashes
  std::vector<Include> includes;
  std::vector<std::string> code;  // lines, without comments
  bool is_header() const { return path.ends_with(".h"); }
};

// All .h and .cpp files of the rooms below the root, by path; build folders and the like are no rooms.
std::vector<SourceFile> ReadSourceTree(const std::string& root);

// Breaches of the arrows between rooms and of the doors to libraries: "path:line: what is wrong", by path and
// line.
//   base <- graph <- {nodes, kpsa, rig} <- host <- {report, picture} <- view <- {cli, bench, tests, ...}; kernels know
//   base only; siblings never each other.
std::vector<std::string> FindBreaches(const std::vector<SourceFile>& files);

// Names of the standard library and of other libraries that a header uses without including, directly or
// through the project's own headers, what declares them: "path:line: what is missing". Precompiled headers
// hide such gaps from the compiler; gaps in the project's own headers it sees, since each source includes its
// own header first.
std::vector<std::string> FindMissingIncludes(const std::vector<SourceFile>& files);

}  // namespace kpsa::engine
