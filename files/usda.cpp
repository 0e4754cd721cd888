#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "base/check.h"
#include "files/cache_normals.h"
#include "files/point_cache.h"
#include "files/usda_text.h"

namespace kpsa::engine {
namespace {

constexpr std::uint64_t kWarnAbove = 100'000'000;

// "[a, b, ...]" of `count` items, each as `item` puts it.
template <typename Item>
Status PutList(std::size_t count, TextWriter* out, const Item& item) {
  KPSA_RETURN_IF_ERROR(out->Put("["));
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) KPSA_RETURN_IF_ERROR(out->Put(", "));
    KPSA_RETURN_IF_ERROR(item(i));
  }
  return out->Put("]");
}
Status PutVectors(std::span<const float> xyz, TextWriter* out) {
  return PutList(xyz.size() / 3, out, [&](std::size_t i) {
    return out->Put("({}, {}, {})", xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  });
}

// "<type> <name>.timeSamples": of each frame what `value` puts; one sample a time.
template <typename Value>
Status PutSamples(const PointCache& cache, const char* attribute, TextWriter* out, const Value& value) {
  KPSA_RETURN_IF_ERROR(out->Put("        {}.timeSamples = {{\n", attribute));
  for (std::size_t t = 0; t < cache.times.size(); ++t) {
    if (t > 0 && cache.times[t] == cache.times[t - 1]) continue;
    KPSA_RETURN_IF_ERROR(out->Put("            {}: ", cache.times[t] * cache.fps));
    KPSA_RETURN_IF_ERROR(value(t));
    KPSA_RETURN_IF_ERROR(out->Put(",\n"));
  }
  return out->Put("        }}\n");
}

// The least and the largest corner of a frame's box.
std::vector<float> Extent(std::span<const float> xyz) {
  if (xyz.empty()) return {0, 0, 0, 0, 0, 0};
  std::vector<float> box = {xyz[0], xyz[1], xyz[2], xyz[0], xyz[1], xyz[2]};
  for (std::size_t i = 0; i < xyz.size(); ++i) {
    box[i % 3] = std::min(box[i % 3], xyz[i]);
    box[3 + i % 3] = std::max(box[3 + i % 3], xyz[i]);
  }
  return box;
}

Status PutGeometry(const PointCache& cache, const PointCacheMesh& mesh, TextWriter* out) {
  const auto frame = [&](std::size_t t) {
    return std::span(mesh.frames).subspan(3 * t * mesh.vertex_count, 3 * mesh.vertex_count);
  };
  KPSA_RETURN_IF_ERROR(out->Put("        int[] faceVertexCounts = "));
  KPSA_RETURN_IF_ERROR(PutList(mesh.triangles.size() / 3, out, [&](std::size_t) { return out->Put("3"); }));
  KPSA_RETURN_IF_ERROR(out->Put("\n        int[] faceVertexIndices = "));
  KPSA_RETURN_IF_ERROR(
      PutList(mesh.triangles.size(), out, [&](std::size_t i) { return out->Put("{}", mesh.triangles[i]); }));
  KPSA_RETURN_IF_ERROR(out->Put("\n"));
  KPSA_RETURN_IF_ERROR(PutSamples(cache, "float3[] extent", out,
                                  [&](std::size_t t) { return PutVectors(Extent(frame(t)), out); }));
  KPSA_RETURN_IF_ERROR(
      PutSamples(cache, "point3f[] points", out, [&](std::size_t t) { return PutVectors(frame(t), out); }));
  const std::vector<CachePart> parts = CacheParts(mesh);
  const bool flat =
      std::all_of(parts.begin(), parts.end(), [&](const CachePart& p) { return PartIsFlat(mesh, p); });
  if (mesh.triangles.empty() || flat) return {};
  KPSA_RETURN_IF_ERROR(
      out->Put("        normal3f[] normals (\n            interpolation = \"vertex\"\n        )\n"));
  return PutSamples(cache, "normal3f[] normals", out,
                    [&](std::size_t t) { return PutVectors(CacheNormals(mesh, t), out); });
}

const CacheMaterial* MaterialOf(const PointCache& cache, const CachePart& part) {
  return part.material < cache.materials.size() ? &cache.materials[part.material] : nullptr;
}

// Texture coordinates and colours.
Status PutPrimvars(const PointCache& cache, const PointCacheMesh& mesh, TextWriter* out) {
  constexpr const char* kVertex = " (\n            interpolation = \"vertex\"\n        )\n";
  if (!mesh.uvs.empty()) {
    KPSA_RETURN_IF_ERROR(out->Put("        texCoord2f[] primvars:st = "));
    KPSA_RETURN_IF_ERROR(PutList(mesh.vertex_count, out, [&](std::size_t v) {
      const float s = mesh.uvs[2 * v], t = 1 - mesh.uvs[2 * v + 1];
      return std::isfinite(s) && std::isfinite(t) ? out->Put("({}, {})", s, t) : out->Put("(0, 0)");
    }));
    KPSA_RETURN_IF_ERROR(out->Put("{}", kVertex));
  }
  std::vector<float> colors;
  for (const CachePart& part : CacheParts(mesh)) {
    const CacheMaterial* material = MaterialOf(cache, part);
    for (std::size_t i = 0; i < std::size_t{3} * part.vertex_count; ++i) {
      const std::size_t at = std::size_t{3} * part.first_vertex + i;
      colors.push_back((material == nullptr ? 1 : static_cast<float>(material->base_color[i % 3])) *
                       (mesh.colors.empty() ? 1 : mesh.colors[at]));
    }
  }
  const bool constant = mesh.colors.empty() && mesh.parts.size() <= 1;
  if (constant) colors.resize(std::min<std::size_t>(colors.size(), 3));
  KPSA_RETURN_IF_ERROR(out->Put("        color3f[] primvars:displayColor = "));
  KPSA_RETURN_IF_ERROR(PutVectors(colors, out));
  return out->Put("{}", constant ? "\n" : kVertex);
}

// Which triangles are of which material. A material cannot show vertex colours, so those go without.
Status PutBindings(const PointCache& cache, const PointCacheMesh& mesh,
                   const std::vector<std::string>& materials, TextWriter* out) {
  if (!mesh.colors.empty()) return {};
  const std::vector<CachePart> parts = CacheParts(mesh);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const CachePart& part = parts[p];
    if (MaterialOf(cache, part) == nullptr) continue;
    const std::string rel =
        fmt::format("rel material:binding = </cache/Looks/{}>\n", materials[part.material]);
    if (parts.size() == 1) return out->Put("        {}", rel);
    KPSA_RETURN_IF_ERROR(out->Put(
        "        def GeomSubset \"part{}\" (\n            prepend apiSchemas = [\"MaterialBindingAPI\"]\n"
        "        )\n        {{\n            uniform token elementType = \"face\"\n"
        "            uniform token familyName = \"materialBind\"\n            int[] indices = ",
        p));
    std::vector<std::size_t> faces;
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
      if (mesh.triangles[i] >= part.first_vertex && mesh.triangles[i] - part.first_vertex < part.vertex_count)
        faces.push_back(i / 3);
    }
    KPSA_RETURN_IF_ERROR(PutList(faces.size(), out, [&](std::size_t i) { return out->Put("{}", faces[i]); }));
    KPSA_RETURN_IF_ERROR(out->Put("\n            {}        }}\n", rel));
  }
  return {};
}

Status PutMesh(const PointCache& cache, const PointCacheMesh& mesh, const std::string& prim,
               const std::vector<std::string>& materials, TextWriter* out) {
  KPSA_CHECK_EQ(mesh.frames.size(), cache.times.size() * mesh.vertex_count * 3);
  const std::vector<CachePart> parts = CacheParts(mesh);
  const bool double_sided = std::any_of(parts.begin(), parts.end(), [&](const CachePart& part) {
    return MaterialOf(cache, part) != nullptr && MaterialOf(cache, part)->double_sided;
  });
  KPSA_RETURN_IF_ERROR(
      out->Put("    def Mesh \"{}\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {{\n"
               "        custom string sourceName = {}\n        uniform token subdivisionScheme = \"none\"\n"
               "        uniform token orientation = \"rightHanded\"\n        uniform bool doubleSided = {}\n",
               prim, Quoted(mesh.name), double_sided ? 1 : 0));
  KPSA_RETURN_IF_ERROR(PutGeometry(cache, mesh, out));
  KPSA_RETURN_IF_ERROR(PutPrimvars(cache, mesh, out));
  KPSA_RETURN_IF_ERROR(PutBindings(cache, mesh, materials, out));
  return out->Put("    }}\n");
}

// The materials below "Looks"; *names by material.
Status PutMaterials(const PointCache& cache, std::vector<std::string>* names, TextWriter* out) {
  if (cache.materials.empty()) return {};
  std::set<std::string> taken;
  KPSA_RETURN_IF_ERROR(out->Put("    def Scope \"Looks\"\n    {{\n"));
  for (const CacheMaterial& material : cache.materials) {
    const std::string& name = names->emplace_back(PrimName(material.name, &taken));
    const std::array<double, 4>& color = material.base_color;
    KPSA_RETURN_IF_ERROR(
        out->Put("        def Material \"{0}\"\n        {{\n"
                 "            token outputs:surface.connect = </cache/Looks/{0}/surface.outputs:surface>\n"
                 "            def Shader \"surface\"\n            {{\n"
                 "                uniform token info:id = \"UsdPreviewSurface\"\n"
                 "                color3f inputs:diffuseColor = ({1}, {2}, {3})\n"
                 "                float inputs:opacity = {4}\n                float inputs:metallic = {5}\n"
                 "                float inputs:roughness = {6}\n                token outputs:surface\n"
                 "            }}\n        }}\n",
                 name, color[0], color[1], color[2], material.alpha_mode == "BLEND" ? color[3] : 1,
                 material.metallic, material.roughness));
  }
  return out->Put("    }}\n");
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
    if (!cache.rig.empty())
      KPSA_RETURN_IF_ERROR(out.Put("    custom string kpsa:rig = {}\n", Quoted(cache.rig)));
    std::vector<std::string> materials;
    KPSA_RETURN_IF_ERROR(PutMaterials(cache, &materials, &out));
    std::set<std::string> taken = {"Looks"};
    for (const PointCacheMesh& mesh : cache.meshes) {
      KPSA_RETURN_IF_ERROR(PutMesh(cache, mesh, PrimName(mesh.name, &taken), materials, &out));
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
