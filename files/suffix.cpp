#include "files/suffix.h"

#include <filesystem>

namespace kpsa::engine {

std::string FileSuffix(const std::string& path) {
  std::string suffix = std::filesystem::path(path).extension().string();
  for (char& c : suffix) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return suffix;
}

}  // namespace kpsa::engine
