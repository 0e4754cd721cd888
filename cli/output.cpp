#include "cli/output.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>

#include "cli/common.h"
#include "files/file.h"
#include "files/temporaries.h"

namespace kpsa::engine {

namespace fs = std::filesystem;

Status CheckOutput(const std::string& path, bool force, const std::vector<std::string>& suffixes) {
  if (path == "-") return Status();
  if (path.empty()) return Status::Usage("-o: the name of the output is empty");
  if (!suffixes.empty() && std::find(suffixes.begin(), suffixes.end(), FileSuffix(path)) == suffixes.end()) {
    return Status::Usage("expected a name that ends in {}", fmt::join(suffixes, ", ")).At({path});
  }
  if (fs::path(path).lexically_normal().string().starts_with("/dev/std"))
    return Status::Usage("write - for stdout").At({path});
  std::error_code error;
  if (!force && fs::is_regular_file(path, error))
    return Status::Usage("exists already; give another name, or --force to replace it").At({path});
  // Asks the writer itself: it knows all reasons. What it made is removed at once.
  const Result<OutputFile> file = OutputFile::Create(path, force);
  return file.ok() ? Status() : AsUsage(file.status());
}

Status CheckNotInput(const std::string& path, std::span<const std::string> inputs) {
  if (path == "-") return Status();
  for (const std::string& input : inputs) {
    std::error_code error;
    if (fs::equivalent(path, input, error) && !error) {
      return Status::Usage("the output is the input {}; expected another name", input).At({path});
    }
  }
  return Status();
}

Result<OutputPath> OutputPath::Create(const std::string& output) {
  OutputPath place;
  place.path_ = output;
  if (output != "-") return place;
  place.stdout_ = true;
  std::error_code error;
  place.path_ = (fs::temp_directory_path(error) / "kpsa-XXXXXX").string();
  const int descriptor = ::mkstemp(place.path_.data());
  if (descriptor < 0) {
    const std::string name = std::exchange(place.path_, "");
    return Status::Usage("no temporary file for stdout: {}", std::generic_category().message(errno))
        .At({name});
  }
  AddTemporary(place.path_);
  ::close(descriptor);
  return place;
}

OutputPath::OutputPath(OutputPath&& other) noexcept
    : path_(std::exchange(other.path_, "")), stdout_(std::exchange(other.stdout_, false)) {}

OutputPath::~OutputPath() {
  if (!stdout_ || path_.empty()) return;
  ::unlink(path_.c_str());
  DropTemporary(path_);
}

Status OutputPath::Finish() {
  if (!stdout_) return Status();
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(path_.c_str(), "rb"), std::fclose);
  if (in == nullptr)
    return Status::Invalid("cannot be read again: {}", std::generic_category().message(errno)).At({path_});
  std::vector<char> block(1 << 20);
  while (const std::size_t size = std::fread(block.data(), 1, block.size(), in.get())) {
    if (std::fwrite(block.data(), 1, size, stdout) != size)
      return Status::Invalid("stdout cannot be written");
  }
  return FlushOutput();
}

Status WriteText(const std::string& output, bool force, const std::string& text) {
  if (output == "-") {
    Print(text);
    return FlushOutput();
  }
  return WriteFileAtomically(output, force,
                             {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace kpsa::engine
