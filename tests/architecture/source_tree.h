// The source tree as text: which files there are, what they include, and what they may.
#pragma once

#include <string>
#include <vector>

namespace kpsa {

struct Include {
  std::string text;  // as written, without quotes or angle brackets
  bool quoted = false;
  int line = 0;
};

struct SourceFile {
  std::string path;  // from the root, with slashes
  std::vector<Include> includes;
  bool include_comes_first = false;  // no other directive is before the first include
  bool is_header() const { return path.ends_with(".h"); }
};

// All .h and .cpp files of the rooms below the root, by path; build folders and the like are no rooms.
std::vector<SourceFile> ReadSourceTree(const std::string& root);

// Breaches of the arrows between rooms and of the doors to libraries: "path:line: what is wrong", by path and line.
//   base <- graph <- {nodes, kpsa, io} <- {cli, bench, tests, ...}; kernels know base only; siblings never each other.
std::vector<std::string> FindBreaches(const std::vector<SourceFile>& files);

// Headers that no source file includes before anything else: the build does not prove that they compile alone.
std::vector<std::string> UnprovenHeaders(const std::vector<SourceFile>& files);

// Compiles each header of the root by itself (syntax only, two at a time). The errors of those that do not compile.
std::vector<std::string> CompileAlone(const std::string& root, const std::vector<std::string>& headers);

}  // namespace kpsa
