#include <fmt/format.h>

#include <set>

#include "base/check.h"
#include "files/file.h"
#include "files/point_cache.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kWarnAbove = 100'000'000;

// Text in blocks, with its length.
class TextWriter {
 public:
  explicit TextWriter(const ByteSink& sink) : sink_(sink) {}
  template <typename... Args>
  Status Put(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(block_), format, std::forward<Args>(args)...);
    return block_.size() < (1 << 16) ? Status() : Flush();
  }
  Status Flush() {
    written_ += block_.size();
    Status status = sink_({reinterpret_cast<const std::uint8_t*>(block_.data()), block_.size()});
    block_.clear();
    return status;
  }
  std::uint64_t written() const { return written_; }

 private:
  const ByteSink& sink_;
  std::string block_;
  std::uint64_t written_ = 0;
};

// A prim name: letters, digits and underscores, not starting with a digit, not yet in `taken`.
std::string PrimName(const std::string& name, std::set<std::string>* taken) {
  std::string prim;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    prim += plain ? c : '_';
  }
  if (prim.empty() || (prim[0] >= '0' && prim[0] <= '9')) prim = "_" + prim;
  std::string unique = prim;
  for (int i = 1; !taken->insert(unique).second; ++i) unique = fmt::format("{}_{}", prim, i);
  return unique;
}

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < 32 ? ' ' : c;
  }
  return quoted + "\"";
}

Status PutMesh(const PointCache& cache, const PointCacheMesh& mesh, const std::string& prim,
               TextWriter* out) {
  KPSA_CHECK_EQ(mesh.frames.size(), cache.times.size() * mesh.vertex_count * 3);
  KPSA_RETURN_IF_ERROR(out->Put("    def Mesh \"{}\"\n    {{\n        custom string sourceName = {}\n", prim,
                                Quoted(mesh.name)));
  KPSA_RETURN_IF_ERROR(
      out->Put("        uniform token subdivisionScheme = \"none\"\n        int[] faceVertexCounts = ["));
  for (std::size_t i = 0; i < mesh.triangles.size() / 3; ++i)
    KPSA_RETURN_IF_ERROR(out->Put("{}3", i == 0 ? "" : ", "));
  KPSA_RETURN_IF_ERROR(out->Put("]\n        int[] faceVertexIndices = ["));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    KPSA_RETURN_IF_ERROR(out->Put("{}{}", i == 0 ? "" : ", ", mesh.triangles[i]));
  }
  KPSA_RETURN_IF_ERROR(out->Put("]\n        point3f[] points.timeSamples = {{\n"));
  for (std::size_t t = 0; t < cache.times.size(); ++t) {
    if (t > 0 && cache.times[t] == cache.times[t - 1]) continue;  // one sample a time
    KPSA_RETURN_IF_ERROR(out->Put("            {}: [", cache.times[t] * cache.fps));
    for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
      const float* p = &mesh.frames[(t * mesh.vertex_count + v) * 3];
      KPSA_RETURN_IF_ERROR(out->Put("{}({}, {}, {})", v == 0 ? "" : ", ", p[0], p[1], p[2]));
    }
    KPSA_RETURN_IF_ERROR(out->Put("],\n"));
  }
  return out->Put("        }}\n    }}\n");
}

}  // namespace

Status WriteUsda(const std::string& path, const PointCache& cache, bool force,
                 std::vector<std::string>* warnings) {
  std::uint64_t size = 0;
  KPSA_RETURN_IF_ERROR(WriteFileAtomically(path, force, [&](const ByteSink& sink) -> Status {
    TextWriter out(sink);
    const double first = cache.times.empty() ? 0 : cache.times.front() * cache.fps;
    const double last = cache.times.empty() ? 0 : cache.times.back() * cache.fps;
    KPSA_RETURN_IF_ERROR(
        out.Put("#usda 1.0\n(\n    defaultPrim = \"cache\"\n    startTimeCode = {}\n    endTimeCode = {}\n"
                "    timeCodesPerSecond = {}\n    framesPerSecond = {}\n    metersPerUnit = 1\n"
                "    upAxis = \"Y\"\n)\n\ndef Xform \"cache\"\n{{\n",
                first, last, cache.fps, cache.fps));
    std::set<std::string> taken;
    for (const PointCacheMesh& mesh : cache.meshes) {
      KPSA_RETURN_IF_ERROR(PutMesh(cache, mesh, PrimName(mesh.name, &taken), &out));
    }
    KPSA_RETURN_IF_ERROR(out.Put("}}\n"));
    KPSA_RETURN_IF_ERROR(out.Flush());
    size = out.written();
    return {};
  }));
  if (size > kWarnAbove) {
    warnings->push_back(
        fmt::format("{} has {} MB; text is a poor container for that much, consider .npz, .mdd or .pc2", path,
                    size / 1'000'000));
  }
  return {};
}

}  // namespace kpsa::engine
