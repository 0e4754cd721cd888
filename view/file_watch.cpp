#include "view/file_watch.h"

#include <sys/stat.h>

#include <algorithm>

namespace kpsa::engine {

FileWatch::Seen FileWatch::SeenNow(const std::string& path) {
  Seen seen{path};
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) return seen;
  seen.modified = std::int64_t{1'000'000'000} * status.st_mtim.tv_sec + status.st_mtim.tv_nsec;
  seen.size = static_cast<std::uint64_t>(status.st_size);
  return seen;
}

void FileWatch::Add(const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    if (!file.empty() && std::ranges::find(seen_, file, &Seen::path) == seen_.end())
      seen_.push_back(SeenNow(file));
  }
}

void FileWatch::Keep(const std::vector<std::string>& files) {
  std::erase_if(seen_, [&](const Seen& seen) { return std::ranges::find(files, seen.path) == files.end(); });
  Add(files);
}

bool FileWatch::Look() {
  bool changed = false;
  for (Seen& seen : seen_) {
    Seen now = SeenNow(seen.path);
    changed = changed || now != seen;
    seen = std::move(now);
  }
  return changed;
}

}  // namespace kpsa::engine
