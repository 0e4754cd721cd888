#include "files/missing_file.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostEntries = 10'000;  // of a folder that are looked at
constexpr std::size_t kMostNamed = 4;

// What a line of text can hold.
bool IsPlain(const std::string& name) {
  return std::ranges::none_of(name, [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; });
}

std::vector<std::string> NamesIn(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator() && names.size() < kMostEntries; entry.increment(error))
    if (std::string name = entry->path().filename().string(); IsPlain(name)) names.push_back(std::move(name));
  std::ranges::sort(names);
  return names;
}

// Of a path whose folder is missing, the first folder that is.
fs::path FirstMissing(const fs::path& folder) {
  std::error_code error;
  fs::path missing = folder;
  while (missing.has_parent_path() && missing.parent_path() != missing &&
         !fs::is_directory(missing.parent_path(), error))
    missing = missing.parent_path();
  return missing;
}

}  // namespace

Suggestion InsteadOfMissing(const std::string& path) {
  const fs::path file(path);
  const std::string name = file.filename().string(), kind = file.extension().string();
  std::error_code error;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error))
    return {"", fmt::format("; there is no folder \"{}\"", FirstMissing(folder).string())};
  const std::vector<std::string> names = NamesIn(folder);
  Suggestion near = DidYouMean(name, names);
  if (!near.empty() || kind.empty()) return near;
  std::string same;
  std::size_t count = 0;
  for (const std::string& other : names) {
    if (fs::path(other).extension() != kind || ++count > kMostNamed) continue;
    same += (same.empty() ? "" : ", ") + other;
  }
  if (count == 0) return {"", fmt::format("; its folder has no {} file", kind)};
  if (count > kMostNamed) same += fmt::format(" and {} more", count - kMostNamed);
  return {"", "; its folder has " + same};
}

}  // namespace kpsa::engine
