#include "files/vertex_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdint>

#include "files/npz.h"
#include "files/point_cache.h"
#include "files/suffix.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kMaxBytes = std::uint64_t{8} << 30;

Result<VertexFile> FromNpz(const std::string& path) {
  Result<Npz> npz = ReadNpz(path, kMaxBytes);
  if (!npz.ok()) return npz.status();
  VertexFile file;
  file.path = path;
  const auto fail = [&](const NpzArray& array, const std::string& expected) {
    return Status::Invalid("array \"{}\" has shape ({}), expected {}", array.name,
                           fmt::join(array.shape, ", "), expected)
        .At({path});
  };
  for (NpzArray& array : npz->arrays) {
    if (array.name == "times") {
      if (array.shape.size() != 1) return fail(array, "(T)");
      file.times = array.Doubles();
      continue;
    }
    if (array.shape.size() != 3 || array.shape[2] != 3) return fail(array, "(T, V, 3)");
    if (!file.arrays.empty() && array.shape[0] != file.frame_count)
      return fail(array, fmt::format("{} frames as the arrays before it", file.frame_count));
    file.frame_count = array.shape[0];
    file.arrays.push_back({array.name, array.shape[1], array.Floats()});
    array.bytes = {};
  }
  if (file.arrays.empty()) return Status::Invalid("has no arrays of vertices, shape (T, V, 3)").At({path});
  if (!file.times.empty() && file.times.size() != file.frame_count) {
    return Status::Invalid("has {} times for {} frames", file.times.size(), file.frame_count).At({path});
  }
  return file;
}

}  // namespace

std::vector<std::string> VertexFileSuffixes() { return {".npz", ".pc2", ".mdd"}; }

Result<VertexFile> ReadVertexFile(const std::string& path, double fps) {
  const std::string suffix = FileSuffix(path);
  if (suffix == ".npz") return FromNpz(path);
  if (suffix != ".pc2" && suffix != ".mdd")
    return Status::Usage("expected a file that ends in {}", fmt::join(VertexFileSuffixes(), ", ")).At({path});
  Result<PointCache> cache = suffix == ".pc2" ? ReadPc2(path, fps) : ReadMdd(path, fps);
  if (!cache.ok()) return cache.status();
  VertexFile file;
  file.path = path;
  file.times = std::move(cache->times);
  file.frame_count = file.times.size();
  for (PointCacheMesh& mesh : cache->meshes)
    file.arrays.push_back({mesh.name, mesh.vertex_count, std::move(mesh.frames)});
  return file;
}

}  // namespace kpsa::engine
