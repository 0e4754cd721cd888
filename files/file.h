// Whole files in, and files out that appear complete or not at all.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

// The bytes of a file (not of a folder, a pipe or a device). An error where it is missing, unreadable or
// larger than max_bytes.
Result<std::vector<std::uint8_t>> ReadFileBytes(const std::string& path, std::uint64_t max_bytes);

// An output that is written under a temporary name beside its place and renamed by Commit, so that nobody
// ever sees half a file; without Commit the destructor removes what was written. Move-only, for one thread.
// A device or pipe (/dev/null, /dev/stdout) cannot be renamed over: it gets a copy of the finished bytes.
// A symbolic link stays one: what it points to is replaced. A file that is replaced keeps its permissions.
class OutputFile {
 public:
  // Fails where the folder is missing or not writable, where `path` is a folder, and where it exists and
  // `force` is false.
  static Result<OutputFile> Create(const std::string& path, bool force);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  const std::string& path() const { return path_; }
  // The name to write to. It exists and is empty; a library may replace it.
  const std::string& temporary_path() const { return temporary_; }
  Status Commit();

 private:
  OutputFile() = default;
  std::string path_, target_, temporary_;  // target_: path_ without symbolic links
  std::optional<unsigned> mode_;           // permissions of the file that is replaced
  bool force_ = false, device_ = false;
};

// Writes through a sink that appends bytes; sink errors (a full disk) stop the writer and are returned.
using ByteSink = std::function<Status(std::span<const std::uint8_t>)>;
Status WriteFileAtomically(const std::string& path, bool force,
                           const std::function<Status(const ByteSink&)>& writer);
Status WriteFileAtomically(const std::string& path, bool force, std::span<const std::uint8_t> bytes);

}  // namespace kpsa::engine
