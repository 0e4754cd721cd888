#include "files/trusted_folders.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

bool IsWithin(std::string_view path, std::string_view folder) {
  if (folder == "/") return true;
  return path.starts_with(folder) && (path.size() == folder.size() || path[folder.size()] == '/');
}

// The innermost folder around `folder`, itself included, that is a project.
std::optional<fs::path> ProjectAround(fs::path folder) {
  for (;; folder = folder.parent_path()) {
    std::error_code error;
    if (fs::is_regular_file(fs::symlink_status(folder / kProjectFile, error))) return folder;
    if (folder == folder.parent_path()) return std::nullopt;
  }
}

}  // namespace

std::optional<std::string> WithoutLinksAndDots(const std::string& path) {
  if (path.find('\0') != std::string::npos) return std::nullopt;  // where it is opened, it ends there
  std::error_code error;
  const fs::path whole = fs::absolute(path.empty() ? "." : path, error);
  if (error) return std::nullopt;
  fs::path real = whole.root_path();
  for (const fs::path& part : whole.relative_path()) {
    if (part.empty() || part == ".") continue;
    if (part == "..") {
      real = real.parent_path();
    } else if (real /= part; fs::is_symlink(fs::symlink_status(real, error))) {
      real = fs::canonical(real, error);
      if (error) return std::nullopt;
    }
  }
  return real.string();
}

Result<TrustedFolders> TrustedFolders::OfRig(const std::string& path, const std::vector<std::string>& others,
                                             const std::string& word) {
  TrustedFolders trusted;
  trusted.word_ = word;
  // A rig that is not there is refused by whoever opens it
  if (trusted.Add(fs::path(path).parent_path().string())) {
    if (const auto project = ProjectAround(trusted.folders_.front())) trusted.Add(project->string());
  }
  for (const std::string& other : others) {
    if (other.empty() || !trusted.Add(other))
      return Status::Usage("{} \"{}\": expected a folder that is there", word, other);
  }
  const char* named = std::getenv("KPSA_TRUST");
  std::string_view rest = named == nullptr ? "" : named;
  while (!rest.empty()) {
    const std::string_view folder = rest.substr(0, rest.find(':'));
    rest.remove_prefix(std::min(rest.size(), folder.size() + 1));
    if (!folder.empty()) trusted.Add(std::string(folder));
  }
  return trusted;
}

bool TrustedFolders::Add(const std::string& folder) {
  const std::optional<std::string> real = WithoutLinksAndDots(folder);
  std::error_code error;
  if (!real.has_value() || !fs::is_directory(*real, error)) return false;
  folders_.push_back(*real);
  return true;
}

bool TrustedFolders::Hold(const std::string& path) const {
  const std::optional<std::string> real = WithoutLinksAndDots(path);
  return real.has_value() && std::any_of(folders_.begin(), folders_.end(),
                                         [&](const std::string& folder) { return IsWithin(*real, folder); });
}

Result<std::string> TrustedFolders::Check(std::string path) const {
  if (Hold(path)) return path;
  const std::optional<std::string> real = WithoutLinksAndDots(path);
  if (!real.has_value()) return Status::Invalid("{} goes by a symbolic link that leads nowhere", path);
  const std::string own = folders_.empty() ? "" : " " + folders_.front();
  return Status::Invalid("{} leads out of the rig's folder{}, to {}: where that is meant, {} {}", path, own,
                         *real, word_, fs::path(*real).parent_path().string());
}

}  // namespace kpsa::engine
