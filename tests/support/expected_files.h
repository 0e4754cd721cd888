// The frames that an independent evaluator computed for the shared characters, one file a character and clip.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/shared_files.h"

namespace kpsa::engine {

struct ExpectedFile {
  std::string path, stem;
  std::string character;  // path of the .glb or .gltf
  std::string clip;       // "rest": none
};

// By path; empty where there are none beside the checkout.
inline std::vector<ExpectedFile> ExpectedFiles() {
  std::vector<ExpectedFile> files;
  const std::string folder = SharedFile("expected");
  if (folder.empty()) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    const std::size_t split = stem.find("__");
    if (entry.path().extension() != ".npz" || split == std::string::npos || stem.ends_with(".alt")) continue;
    const std::string name = stem.substr(0, split);
    for (const std::string& path : {name + ".glb", name + ".gltf", name + "/" + name + ".gltf"}) {
      const std::string found = SharedFile("assets/" + path);
      if (!found.empty()) files.push_back({entry.path().string(), stem, found, stem.substr(split + 2)});
    }
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

}  // namespace kpsa::engine
