// Where tests find the assets and expected frames that lie beside the checkout; "" where they are absent.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace kpsa::engine {

// <source dir>/../shared/<path>, or one folder above that.
inline std::string SharedFile(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path source = fs::path(__FILE__).parent_path().parent_path().parent_path();
  for (const fs::path& folder : {source / "../shared", source / "../../shared"}) {
    std::error_code error;
    if (fs::exists(folder / path, error)) return fs::weakly_canonical(folder / path).string();
  }
  return "";
}

}  // namespace kpsa::engine
