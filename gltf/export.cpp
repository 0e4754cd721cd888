#include "gltf/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "base/check.h"
#include "files/cache_normals.h"
#include "files/file.h"
#include "gltf/frame_shapes.h"

namespace kpsa::engine {
namespace {

using json = nlohmann::ordered_json;

constexpr int kUnsignedInt = 5125, kFloat = 5126;

// The document and its binary chunk while they grow.
class GlbFile {
 public:
  json& root() { return root_; }

  // Indices of accessors, and of the view that holds these bytes.
  int AddPositions(std::span<const float> xyz);  // with the bounds that POSITION needs
  int AddVectors(std::span<const float> xyz);
  int AddUvs(std::span<const float> uv);
  int AddIndices(std::span<const Index> indices);
  int AddNumbers(std::span<const float> values);  // of animations
  int AddBytes(std::span<const std::uint8_t> bytes);

  // Errors: more than the 4 GB that a .glb holds; those of WriteFileAtomically.
  Status Write(const std::string& path, bool force);

 private:
  enum Use { kNone = 0, kVertices = 34962, kIndices = 34963 };  // as the format numbers them
  int AddView(std::span<const std::uint8_t> bytes, Use use);
  template <typename T>
  int AddAccessor(std::span<const T> values, int component_type, const char* type, std::size_t width,
                  Use use);

  json root_ = {{"asset", {{"version", "2.0"}, {"generator", "kpsa"}}}};
  std::vector<std::uint8_t> bytes_;
};

int GlbFile::AddView(std::span<const std::uint8_t> bytes, Use use) {
  bytes_.resize((bytes_.size() + 3) / 4 * 4);
  json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
  if (use != kNone) view["target"] = static_cast<int>(use);
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  root_["bufferViews"].push_back(std::move(view));
  return static_cast<int>(root_["bufferViews"].size()) - 1;
}

template <typename T>
int GlbFile::AddAccessor(std::span<const T> values, int component_type, const char* type, std::size_t width,
                         Use use) {
  const int view = AddView({reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()}, use);
  root_["accessors"].push_back({{"bufferView", view},
                                {"componentType", component_type},
                                {"type", type},
                                {"count", values.size() / width}});
  return static_cast<int>(root_["accessors"].size()) - 1;
}

int GlbFile::AddPositions(std::span<const float> xyz) {
  const int accessor = AddVectors(xyz);
  json low = json::array(), high = json::array();
  for (std::size_t c = 0; c < 3; ++c) {
    float least = xyz[c], most = xyz[c];
    for (std::size_t i = c; i < xyz.size(); i += 3) {
      least = std::min(least, xyz[i]);
      most = std::max(most, xyz[i]);
    }
    low.push_back(least), high.push_back(most);
  }
  root_["accessors"].back()["min"] = low;
  root_["accessors"].back()["max"] = high;
  return accessor;
}

int GlbFile::AddVectors(std::span<const float> xyz) { return AddAccessor(xyz, kFloat, "VEC3", 3, kVertices); }
int GlbFile::AddUvs(std::span<const float> uv) { return AddAccessor(uv, kFloat, "VEC2", 2, kVertices); }
int GlbFile::AddIndices(std::span<const Index> indices) {
  return AddAccessor(indices, kUnsignedInt, "SCALAR", 1, kIndices);
}
int GlbFile::AddNumbers(std::span<const float> values) {
  return AddAccessor(values, kFloat, "SCALAR", 1, kNone);
}
int GlbFile::AddBytes(std::span<const std::uint8_t> bytes) { return AddView(bytes, kNone); }

Status GlbFile::Write(const std::string& path, bool force) {
  bytes_.resize((bytes_.size() + 3) / 4 * 4);
  if (!bytes_.empty()) root_["buffers"].push_back({{"byteLength", bytes_.size()}});
  std::string text = root_.dump(-1, ' ', false, json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t total = 12 + 8 + text.size() + (bytes_.empty() ? 0 : 8 + bytes_.size());
  if (total > 0xffffffffu)
    return Status::Invalid("would have {} bytes, .glb holds at most 4 GB", total).At({path});
  std::vector<std::uint8_t> head;
  const auto put = [&](std::uint64_t word) {
    for (int i = 0; i < 4; ++i) head.push_back(static_cast<std::uint8_t>(word >> (8 * i)));
  };
  put(0x46546c67), put(2), put(total), put(text.size()), put(0x4e4f534a);
  head.insert(head.end(), text.begin(), text.end());
  if (!bytes_.empty()) put(bytes_.size()), put(0x004e4942);
  return WriteFileAtomically(path, force, [&](const ByteSink& sink) -> Status {
    KPSA_RETURN_IF_ERROR(sink(head));
    return sink(bytes_);
  });
}

// The part's rows of what has `width` numbers a vertex.
std::span<const float> Rows(const float* values, const CachePart& part, std::size_t width) {
  return {values + width * part.first_vertex, width * part.vertex_count};
}

json Primitive(const PointCacheMesh& mesh, const CachePart& part, const FrameShapes& shapes,
               const FrameNormals& normals, GlbFile* glb) {
  json primitive, attributes;
  attributes["POSITION"] = glb->AddPositions(Rows(shapes.rest.data(), part, 3));
  std::vector<Index> triangles = PartTriangles(mesh, part);
  const bool with_normals = !triangles.empty() && !PartIsFlat(mesh, part);
  if (triangles.empty()) {
    primitive["mode"] = 0;
  } else {
    for (Index& vertex : triangles) vertex -= part.first_vertex;
    if (with_normals) attributes["NORMAL"] = glb->AddVectors(Rows(normals.rest.data(), part, 3));
    primitive["indices"] = glb->AddIndices(triangles);
  }
  if (PartHasUvs(mesh, part)) attributes["TEXCOORD_0"] = glb->AddUvs(Rows(mesh.uvs.data(), part, 2));
  if (!mesh.colors.empty()) attributes["COLOR_0"] = glb->AddVectors(Rows(mesh.colors.data(), part, 3));
  primitive["attributes"] = std::move(attributes);
  if (part.material != kNoIndex) primitive["material"] = part.material;
  for (std::size_t k = 0; k < shapes.shapes.size(); ++k) {
    json target = {{"POSITION", glb->AddPositions(Rows(shapes.shapes[k].data(), part, 3))}};
    if (with_normals) target["NORMAL"] = glb->AddVectors(Rows(normals.shapes[k].data(), part, 3));
    primitive["targets"].push_back(target);
  }
  return primitive;
}

void AddMesh(const PointCacheMesh& mesh, const FrameShapes& shapes, const std::string& clip,
             int times_accessor, GlbFile* glb) {
  const FrameNormals normals = NormalsOfFrames(mesh, shapes);
  json out = {{"name", mesh.name}, {"primitives", json::array()}};
  for (const CachePart& part : CacheParts(mesh)) {
    if (part.vertex_count > 0) out["primitives"].push_back(Primitive(mesh, part, shapes, normals, glb));
  }
  const std::size_t node = glb->root()["nodes"].size();
  if (!shapes.shapes.empty()) {
    // All weights of the first key, then of the second
    const std::vector<float>& values = shapes.weights;
    const int output = glb->AddNumbers(values);
    json& animation = glb->root()["animations"][0];
    animation["name"] = clip.empty() ? "cache" : clip;
    animation["samplers"].push_back({{"input", times_accessor}, {"output", output}});
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", node}, {"path", "weights"}}}});
    out["weights"] = std::vector<float>(values.begin(),
                                        values.begin() + static_cast<std::ptrdiff_t>(shapes.shapes.size()));
    for (std::size_t k = 0; k < shapes.shapes.size(); ++k)
      out["extras"]["targetNames"].push_back(fmt::format("shape{}", k + 1));
  }
  glb->root()["meshes"].push_back(out);
  glb->root()["nodes"].push_back({{"name", mesh.name}, {"mesh", glb->root()["meshes"].size() - 1}});
  glb->root()["scene"] = 0;
  glb->root()["scenes"][0]["nodes"].push_back(node);
}

void AddMaterial(const CacheMaterial& material, GlbFile* glb) {
  json& root = glb->root();
  json shading = {{"baseColorFactor", material.base_color},
                  {"metallicFactor", material.metallic},
                  {"roughnessFactor", material.roughness}};
  if (material.image != kNoIndex) shading["baseColorTexture"] = {{"index", material.image}};
  json out;
  if (!material.name.empty()) out["name"] = material.name;
  out["pbrMetallicRoughness"] = std::move(shading);
  if (material.double_sided) out["doubleSided"] = true;
  if (material.alpha_mode != "OPAQUE") out["alphaMode"] = material.alpha_mode;
  if (material.alpha_mode == "MASK") out["alphaCutoff"] = material.alpha_cutoff;
  root["materials"].push_back(std::move(out));
}

double Diagonal(const PointCache& cache) {
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
  bool any = false;
  for (const PointCacheMesh& mesh : cache.meshes) {
    for (std::size_t i = 0; i < mesh.frames.size(); ++i) {
      low[i % 3] = std::min<double>(low[i % 3], mesh.frames[i]);
      high[i % 3] = std::max<double>(high[i % 3], mesh.frames[i]);
      any = true;
    }
  }
  return any ? std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) : 0;
}

}  // namespace

Result<MorphGlbReport> WriteMorphGlb(const std::string& path, const PointCache& cache,
                                     const MorphGlbOptions& options) {
  std::vector<float> times;
  const double shift = cache.times.empty() ? 0 : std::min(cache.times.front(), 0.0);
  for (const double time : cache.times) {
    const auto value = static_cast<float>(time - shift);
    if (!times.empty() && value <= times.back()) {
      return Status::Invalid("cannot be written: glTF wants times that ascend, {} s follows {} s", value,
                             times.back())
          .At({path});
    }
    times.push_back(value);
  }
  MorphGlbReport report;
  report.diagonal = Diagonal(cache);
  GlbFile glb;
  const int times_accessor = times.size() > 1 ? glb.AddNumbers(times) : -1;
  if (times.size() > 1) {
    glb.root()["accessors"].back()["min"] = {times.front()};
    glb.root()["accessors"].back()["max"] = {times.back()};
  }
  for (const CacheImage& image : cache.images) {
    const int view = glb.AddBytes(image.bytes);
    glb.root()["images"].push_back({{"bufferView", view}, {"mimeType", image.type}});
    glb.root()["textures"].push_back({{"source", glb.root()["images"].size() - 1}});
  }
  for (const CacheMaterial& material : cache.materials) AddMaterial(material, &glb);
  double square_sum = 0, count = 0;
  for (const PointCacheMesh& mesh : cache.meshes) {
    KPSA_CHECK_EQ(mesh.frames.size(), times.size() * mesh.vertex_count * 3);
    report.targets.push_back(0);
    if (mesh.frames.empty()) continue;
    for (const float value : mesh.frames) {
      if (!std::isfinite(value))
        return Status::Invalid("mesh \"{}\" has points that are not finite", mesh.name).At({path});
    }
    const FrameShapes shapes = ShapesOfFrames(mesh, times.size(), options.tolerance * report.diagonal,
                                              std::max(options.max_targets, 0));
    report.targets.back() = static_cast<int>(shapes.shapes.size());
    report.max_residual = std::max(report.max_residual, shapes.max_residual);
    square_sum += shapes.square_sum;
    count += static_cast<double>(mesh.frames.size() / 3);
    AddMesh(mesh, shapes, cache.clip, times_accessor, &glb);
  }
  if (count > 0) report.rms_residual = std::sqrt(square_sum / count);
  KPSA_RETURN_IF_ERROR(glb.Write(path, options.force));
  return report;
}

}  // namespace kpsa::engine
