// Point caches of other programs: PC2 and MDD.
#include <cmath>

#include "files/point_cache.h"
#include "tests/fuzz/fuzzer.h"

namespace kpsa::engine {
namespace {

void CheckCache(const Result<PointCache>& cache, const char* format) {
  if (!cache.ok()) return RequireRefusal(cache.status());
  Reached(format);
  Require(cache->meshes.size() == 1, "not one mesh");
  const PointCacheMesh& mesh = cache->meshes.front();
  Require(mesh.frames.size() == 3 * mesh.vertex_count * cache->times.size(), "frames of another size");
  for (const float number : mesh.frames) Require(std::isfinite(number), "a position that is not finite");
  for (const double time : cache->times) Require(std::isfinite(time), "a time that is not finite");
}

}  // namespace

KPSA_FUZZER(caches) {
  const std::string path = FuzzedFile("cache", bytes);
  CheckCache(ReadPc2(path), "pc2");
  CheckCache(ReadMdd(path), "mdd");
}

}  // namespace kpsa::engine
