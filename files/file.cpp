#include "files/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

#include "files/missing_file.h"
#include "files/temporaries.h"

namespace kpsa::engine {
namespace {

std::string Reason(int error) { return std::generic_category().message(error); }

struct Closer {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePointer = std::unique_ptr<std::FILE, Closer>;

std::atomic<unsigned> temporary_counter{0};

// Where a write to `path` ends up: nobody else follows links for rename.
std::string WithoutLinks(const std::string& path) {
  constexpr int kMostLinks = 40;  // as Linux
  std::filesystem::path target = path;
  std::error_code error;
  for (int links = 0; links < kMostLinks && std::filesystem::is_symlink(target, error); ++links) {
    const std::filesystem::path next = std::filesystem::read_symlink(target, error);
    if (error) break;
    target = target.parent_path() / next;  // an absolute one replaces all
  }
  return target.string();
}

// Creates an empty file of a new name; the name, or "" with errno set. It is of the prefix, cut short where file systems
// would have no room for what is added.
std::string CreateTemporary(std::string prefix, unsigned mode = 0666) {
  constexpr std::size_t kMostOfName = 200;                 // of 255
  const std::size_t begin = prefix.find_last_of('/') + 1;  // 0 where there is none
  if (prefix.size() - begin > kMostOfName && prefix.size() - begin <= NAME_MAX)
    prefix.resize(begin + kMostOfName);
  for (int attempt = 0; attempt < 100; ++attempt) {
    std::string name = fmt::format("{}.tmp{}-{}", prefix, ::getpid(), temporary_counter++);
    AddTemporary(name);
    const int descriptor = ::open(name.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, mode);
    if (descriptor >= 0) {
      ::close(descriptor);
      return name;
    }
    const int reason = errno;
    DropTemporary(name);
    errno = reason;
    if (reason != EEXIST) return "";
  }
  return "";
}

// Into a device or a pipe. One that nobody reads would be waited for without end.
FilePointer OpenDevice(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return nullptr;
  ::fcntl(descriptor, F_SETFL, 0);
  FilePointer file(::fdopen(descriptor, "wb"));
  if (file == nullptr) ::close(descriptor);
  return file;
}

Status CopyTo(const std::string& from, const std::string& to) {
  FilePointer in(std::fopen(from.c_str(), "rb"));
  if (in == nullptr) return Status::Invalid("cannot write: {}", Reason(errno)).At({to});
  FilePointer out = OpenDevice(to);
  if (out == nullptr && errno == ENXIO)
    return Status::Invalid("is a pipe that nobody reads; expected a reader, or the name of a file").At({to});
  if (out == nullptr) return Status::Invalid("cannot write: {}", Reason(errno)).At({to});
  std::vector<std::uint8_t> block(1 << 16);
  while (const std::size_t size = std::fread(block.data(), 1, block.size(), in.get())) {
    if (std::fwrite(block.data(), 1, size, out.get()) != size) {
      return Status::Invalid("cannot write: {}", Reason(errno)).At({to});
    }
  }
  if (std::ferror(in.get()) != 0 || std::fflush(out.get()) != 0) {
    return Status::Invalid("cannot write: {}", Reason(errno)).At({to});
  }
  return {};
}

}  // namespace

Result<std::vector<std::uint8_t>> ReadFileBytes(const std::string& path, std::uint64_t max_bytes) {
  struct stat info = {};
  if (::stat(path.c_str(), &info) != 0) {
    const int reason = errno;
    return Status::Invalid("cannot be read: {}{}", Reason(reason),
                           reason == ENOENT ? InsteadOfMissing(path) : Suggestion())
        .At({path});
  }
  if (S_ISDIR(info.st_mode)) return Status::Invalid("is a folder, expected a file").At({path});
  const auto too_large = [&] {
    return Status::Invalid("is larger than {} bytes, the most that is read", max_bytes).At({path});
  };
  if (!S_ISREG(info.st_mode)) return Status::Invalid("is a pipe or a device, expected a file").At({path});
  if (static_cast<std::uint64_t>(info.st_size) > max_bytes) return too_large();
  FilePointer file(std::fopen(path.c_str(), "rb"));
  if (file == nullptr) return Status::Invalid("cannot be read: {}", Reason(errno)).At({path});

  // The size is a hint only: the file may grow
  std::vector<std::uint8_t> bytes;
  std::size_t step = static_cast<std::size_t>(info.st_size) + 1;
  for (;;) {
    const std::size_t before = bytes.size();
    bytes.resize(before + step);
    const std::size_t got = std::fread(bytes.data() + before, 1, step, file.get());
    bytes.resize(before + got);
    if (bytes.size() > max_bytes) return too_large();
    if (std::ferror(file.get()) != 0) return Status::Invalid("cannot be read: {}", Reason(errno)).At({path});
    if (got < step) break;
    step = std::size_t{1} << 20;
  }
  return bytes;
}

Result<OutputFile> OutputFile::Create(const std::string& path, bool force) {
  namespace fs = std::filesystem;
  OutputFile file;
  file.path_ = path;
  file.force_ = force;
  if (path.empty()) return Status::Usage("the name of the output is empty");
  struct stat info = {};
  if (::stat(path.c_str(), &info) == 0) {
    if (S_ISDIR(info.st_mode))
      return Status::Usage("is a folder, expected the name of a file to write").At({path});
    file.device_ = !S_ISREG(info.st_mode);
    if (!file.device_) file.mode_ = info.st_mode & 0777;
    if (!file.device_ && !force) {
      return Status::Usage("exists already; give another name, or let it be replaced").At({path});
    }
  } else if (errno != ENOENT) {
    return Status::Usage("cannot be written: {}", Reason(errno)).At({path});
  }
  if (file.device_) {
    std::error_code error;
    file.temporary_ = CreateTemporary((fs::temp_directory_path(error) / "kpsa").string());
  } else {
    file.target_ = WithoutLinks(path);
    file.temporary_ = CreateTemporary(file.target_, file.mode_.value_or(0666) | S_IRUSR | S_IWUSR);
  }
  if (file.temporary_.empty()) {
    const fs::path folder = fs::path(file.target_).parent_path();
    if (errno == ENOENT)
      return Status::Usage("cannot be written: there is no folder {}", folder.string()).At({path});
    return Status::Usage("cannot be written: {}", Reason(errno)).At({path});
  }
  return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept { *this = std::move(other); }

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(target_, other.target_);
  std::swap(temporary_, other.temporary_);
  std::swap(mode_, other.mode_);
  std::swap(force_, other.force_);
  std::swap(device_, other.device_);
  return *this;
}

OutputFile::~OutputFile() {
  if (temporary_.empty()) return;
  ::unlink(temporary_.c_str());
  DropTemporary(temporary_);
}

Status OutputFile::Commit() {
  if (device_) return CopyTo(temporary_, path_);
  if (!force_ && ::access(path_.c_str(), F_OK) == 0) {
    return Status::Usage("appeared while it was being written; give another name, or let it be replaced")
        .At({path_});
  }
  if ((mode_.has_value() && ::chmod(temporary_.c_str(), *mode_) != 0) ||
      ::rename(temporary_.c_str(), target_.c_str()) != 0) {
    return Status::Invalid("cannot be written: {}", Reason(errno)).At({path_});
  }
  DropTemporary(temporary_);
  temporary_.clear();
  return {};
}

Status WriteFileAtomically(const std::string& path, bool force,
                           const std::function<Status(const ByteSink&)>& writer) {
  Result<OutputFile> output = OutputFile::Create(path, force);
  if (!output.ok()) return output.status();
  FilePointer file(std::fopen(output->temporary_path().c_str(), "wb"));
  if (file == nullptr) return Status::Invalid("cannot be written: {}", Reason(errno)).At({path});
  const auto failed = [&] { return Status::Invalid("cannot be written: {}", Reason(errno)).At({path}); };
  KPSA_RETURN_IF_ERROR(writer([&](std::span<const std::uint8_t> bytes) -> Status {
    if (!bytes.empty() && std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size())
      return failed();
    return {};
  }));
  if (std::fclose(file.release()) != 0) return failed();
  return output->Commit();
}

Status WriteFileAtomically(const std::string& path, bool force, std::span<const std::uint8_t> bytes) {
  return WriteFileAtomically(path, force, [&](const ByteSink& sink) { return sink(bytes); });
}

}  // namespace kpsa::engine
