#include "files/point_cache.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <set>

#include "base/check.h"
#include "files/file.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kLargestCache = std::uint64_t{64} << 30;  // written, frame by frame
constexpr std::uint64_t kLargestRead = std::uint64_t{8} << 30;    // read, as a whole
constexpr std::size_t kPc2Header = 32;
constexpr char kPc2Magic[12] = {'P', 'O', 'I', 'N', 'T', 'C', 'A', 'C', 'H', 'E', '2', '\0'};

// Appends 32-bit words in the byte order of a format.
class WordWriter {
 public:
  WordWriter(const ByteSink& sink, bool big_endian) : sink_(sink), big_endian_(big_endian) {}
  Status Put(std::uint32_t word) {
    for (int i = 0; i < 4; ++i) {
      block_.push_back(static_cast<std::uint8_t>(word >> (big_endian_ ? 24 - 8 * i : 8 * i)));
    }
    return block_.size() < kBlock ? Status() : Flush();
  }
  Status Put(float value) { return Put(std::bit_cast<std::uint32_t>(value)); }
  Status Flush() {
    Status status = sink_(block_);
    block_.clear();
    return status;
  }

 private:
  static constexpr std::size_t kBlock = 1 << 16;
  const ByteSink& sink_;
  bool big_endian_;
  std::vector<std::uint8_t> block_;
};

std::uint32_t ReadWord(const std::vector<std::uint8_t>& bytes, std::size_t at, bool big_endian) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i)
    word |= std::uint32_t{bytes[at + i]} << (big_endian ? 24 - 8 * i : 8 * i);
  return word;
}

Status CheckCache(const PointCache& cache, std::size_t mesh, const CacheOptions& options,
                  const std::string& path) {
  KPSA_CHECK_LT(mesh, cache.meshes.size());
  const PointCacheMesh& m = cache.meshes[mesh];
  KPSA_CHECK_EQ(m.frames.size(), cache.times.size() * m.vertex_count * 3);
  for (const Index vertex : options.order) KPSA_CHECK_LT(vertex, m.vertex_count);
  constexpr std::size_t kMost = 0x7fffffff;
  if (m.vertex_count > kMost || cache.times.size() > kMost) {
    return Status::Invalid("the format holds at most {} points and frames", kMost).At({path});
  }
  return {};
}

std::size_t OutputCount(const PointCacheMesh& mesh, const CacheOptions& options) {
  return options.order.empty() ? mesh.vertex_count : options.order.size();
}

Status PutFrames(const PointCacheMesh& mesh, std::size_t frame_count, const CacheOptions& options,
                 WordWriter* writer) {
  const std::size_t count = OutputCount(mesh, options);
  for (std::size_t t = 0; t < frame_count; ++t) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t vertex = options.order.empty() ? i : options.order[i];
      const float* p = &mesh.frames[(t * mesh.vertex_count + vertex) * 3];
      const bool blender = options.axes == CacheAxes::kBlender;
      KPSA_RETURN_IF_ERROR(writer->Put(p[0]));
      KPSA_RETURN_IF_ERROR(writer->Put(blender ? -p[2] : p[1]));
      KPSA_RETURN_IF_ERROR(writer->Put(blender ? p[1] : p[2]));
    }
  }
  return {};
}

// The positions behind the header of a file whose size was checked.
Status ReadFrames(const std::vector<std::uint8_t>& bytes, std::size_t at, bool big_endian,
                  PointCacheMesh* mesh) {
  mesh->frames.resize((bytes.size() - at) / 4);
  for (std::size_t i = 0; i < mesh->frames.size(); ++i) {
    mesh->frames[i] = std::bit_cast<float>(ReadWord(bytes, at + 4 * i, big_endian));
    if (!std::isfinite(mesh->frames[i])) {
      return Status::Invalid("a position of frame {}, point {} is not finite", i / 3 / mesh->vertex_count,
                             i / 3 % mesh->vertex_count);
    }
  }
  return {};
}

// 4 * (a + b * c) and a header against the size, without overflow: all counts are below 2^31.
Status CheckSize(std::size_t size, std::uint64_t header, std::uint64_t points, std::uint64_t frames) {
  const bool fits = points == 0 || frames <= (kLargestCache / 12) / points;
  if (fits && header + 12 * points * frames == size) return {};
  return Status::Invalid("has {} bytes, {} points in {} frames need another number", size, points, frames);
}

}  // namespace

Status WritePc2(const std::string& path, const PointCache& cache, std::size_t mesh,
                const CacheOptions& options, std::vector<std::string>* warnings) {
  KPSA_RETURN_IF_ERROR(CheckCache(cache, mesh, options, path));
  const PointCacheMesh& m = cache.meshes[mesh];
  const std::size_t frames = cache.times.size();
  const double first = frames == 0 ? 0 : cache.times[0];
  const double step =
      frames < 2 ? 1 / cache.fps : (cache.times.back() - first) / static_cast<double>(frames - 1);
  for (std::size_t i = 0; i < frames; ++i) {
    if (std::fabs(first + step * static_cast<double>(i) - cache.times[i]) <= 1e-3 / cache.fps) continue;
    warnings->push_back(
        fmt::format("{}: the frames are unevenly spaced, which PC2 cannot say; use .mdd", path));
    break;
  }
  return WriteFileAtomically(path, options.force, [&](const ByteSink& sink) -> Status {
    KPSA_RETURN_IF_ERROR(sink({reinterpret_cast<const std::uint8_t*>(kPc2Magic), sizeof(kPc2Magic)}));
    WordWriter writer(sink, false);
    KPSA_RETURN_IF_ERROR(writer.Put(1u));
    KPSA_RETURN_IF_ERROR(writer.Put(static_cast<std::uint32_t>(OutputCount(m, options))));
    KPSA_RETURN_IF_ERROR(writer.Put(static_cast<float>(first * cache.fps)));
    KPSA_RETURN_IF_ERROR(writer.Put(static_cast<float>(step * cache.fps)));
    KPSA_RETURN_IF_ERROR(writer.Put(static_cast<std::uint32_t>(frames)));
    KPSA_RETURN_IF_ERROR(PutFrames(m, frames, options, &writer));
    return writer.Flush();
  });
}

Status WriteMdd(const std::string& path, const PointCache& cache, std::size_t mesh,
                const CacheOptions& options) {
  KPSA_RETURN_IF_ERROR(CheckCache(cache, mesh, options, path));
  const PointCacheMesh& m = cache.meshes[mesh];
  return WriteFileAtomically(path, options.force, [&](const ByteSink& sink) -> Status {
    WordWriter writer(sink, true);
    KPSA_RETURN_IF_ERROR(writer.Put(static_cast<std::uint32_t>(cache.times.size())));
    KPSA_RETURN_IF_ERROR(writer.Put(static_cast<std::uint32_t>(OutputCount(m, options))));
    for (const double time : cache.times) KPSA_RETURN_IF_ERROR(writer.Put(static_cast<float>(time)));
    KPSA_RETURN_IF_ERROR(PutFrames(m, cache.times.size(), options, &writer));
    return writer.Flush();
  });
}

Result<PointCache> ReadPc2(const std::string& path, double fps) {
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kLargestRead);
  if (!bytes.ok()) return bytes.status();
  if (bytes->size() < kPc2Header || std::memcmp(bytes->data(), kPc2Magic, sizeof(kPc2Magic)) != 0) {
    return Status::Invalid("is no PC2 file").At({path});
  }
  const std::uint32_t version = ReadWord(*bytes, 12, false), points = ReadWord(*bytes, 16, false);
  const float start = std::bit_cast<float>(ReadWord(*bytes, 20, false));
  const float rate = std::bit_cast<float>(ReadWord(*bytes, 24, false));
  const std::uint32_t frames = ReadWord(*bytes, 28, false);
  if (version != 1) return Status::Invalid("is PC2 of version {}, expected 1", version).At({path});
  if (!std::isfinite(start) || !std::isfinite(rate))
    return Status::Invalid("has a frame that is not finite").At({path});
  if (Status status = CheckSize(bytes->size(), kPc2Header, points, points == 0 ? 0 : frames); !status.ok()) {
    return std::move(status).At({path});
  }
  PointCache cache;
  cache.fps = fps;
  cache.meshes.resize(1);
  cache.meshes[0].vertex_count = points;
  for (std::uint32_t i = 0; points > 0 && i < frames; ++i)
    cache.times.push_back((start + double{rate} * i) / fps);
  if (Status status = ReadFrames(*bytes, kPc2Header, false, &cache.meshes[0]); !status.ok()) {
    return std::move(status).At({path});
  }
  return cache;
}

Result<PointCache> ReadMdd(const std::string& path, double fps) {
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kLargestRead);
  if (!bytes.ok()) return bytes.status();
  if (bytes->size() < 8) return Status::Invalid("is no MDD file").At({path});
  const std::uint32_t frames = ReadWord(*bytes, 0, true), points = ReadWord(*bytes, 4, true);
  const std::uint64_t header = 8 + 4 * std::uint64_t{frames};
  if (Status status = CheckSize(bytes->size(), header, points, frames); !status.ok()) {
    return std::move(status).At({path});
  }
  PointCache cache;
  cache.fps = fps;
  cache.meshes.resize(1);
  cache.meshes[0].vertex_count = points;
  for (std::uint32_t i = 0; i < frames; ++i) {
    cache.times.push_back(std::bit_cast<float>(ReadWord(*bytes, 8 + 4 * std::size_t{i}, true)));
    if (!std::isfinite(cache.times.back())) return Status::Invalid("time {} is not finite", i).At({path});
  }
  if (Status status = ReadFrames(*bytes, header, true, &cache.meshes[0]); !status.ok()) {
    return std::move(status).At({path});
  }
  return cache;
}

std::string CachePathForMesh(const std::string& path, const PointCache& cache, std::size_t index) {
  KPSA_CHECK_LT(index, cache.meshes.size());
  if (cache.meshes.size() == 1) return path;
  const auto file_name = [&](std::size_t i) {
    std::string name = cache.meshes[i].name;
    for (char& c : name) {
      if (static_cast<unsigned char>(c) < 32 || std::strchr("/\\:*?\"<>|", c) != nullptr) c = '_';
    }
    return name.substr(0, 100);
  };
  std::string name = file_name(index);
  for (std::size_t i = 0; i < cache.meshes.size(); ++i) {
    if (i == index || file_name(i) != name) continue;
    name += fmt::format("-{}", index);
    break;
  }
  std::filesystem::path result(path);
  const std::string extension = result.extension().string();
  result.replace_extension();
  return fmt::format("{}.{}{}", result.string(), name, extension);
}

}  // namespace kpsa::engine
