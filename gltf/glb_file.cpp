#include "gltf/glb_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "files/file.h"

namespace kpsa::engine {
namespace {

using json = nlohmann::ordered_json;

constexpr int kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
enum Use { kNone = 0, kVertices = 34962, kIndices = 34963 };  // as the format numbers them

template <typename T>
std::span<const std::uint8_t> BytesOf(std::span<const T> values) {
  return {reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()};
}

}  // namespace

// The document and its binary chunk while they grow.
struct GlbFile::Document {
  json root = {{"asset", {{"version", "2.0"}, {"generator", "kpsa"}}}};
  std::vector<std::uint8_t> bytes;

  std::size_t Add(const char* list, json item) {
    root[list].push_back(std::move(item));
    return root[list].size() - 1;
  }
  json& node(std::size_t at) { return root["nodes"][at]; }

  int AddView(std::span<const std::uint8_t> view_bytes, Use use) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", view_bytes.size()}};
    if (use != kNone) view["target"] = static_cast<int>(use);
    bytes.insert(bytes.end(), view_bytes.begin(), view_bytes.end());
    return static_cast<int>(Add("bufferViews", std::move(view)));
  }

  template <typename T>
  int AddAccessor(std::span<const T> values, int component_type, const char* type, std::size_t width,
                  Use use) {
    const int view = AddView(BytesOf(values), use);
    return static_cast<int>(Add("accessors", {{"bufferView", view},
                                              {"componentType", component_type},
                                              {"type", type},
                                              {"count", values.size() / width}}));
  }

  // Of the accessor that was added last.
  void AddBounds(std::span<const float> xyz, bool with_zero) {
    json low = json::array(), high = json::array();
    for (std::size_t c = 0; c < 3; ++c) {
      float least = with_zero ? 0 : xyz[c], most = least;
      for (std::size_t i = c; i < xyz.size(); i += 3) {
        least = std::min(least, xyz[i]);
        most = std::max(most, xyz[i]);
      }
      low.push_back(least), high.push_back(most);
    }
    root["accessors"].back()["min"] = low;
    root["accessors"].back()["max"] = high;
  }
};

GlbFile::GlbFile() : document_(std::make_unique<Document>()) {}
GlbFile::~GlbFile() = default;

int GlbFile::AddPositions(std::span<const float> xyz) {
  const int accessor = AddVectors(xyz);
  document_->AddBounds(xyz, false);
  return accessor;
}

int GlbFile::AddVectors(std::span<const float> xyz) {
  return document_->AddAccessor(xyz, kFloat, "VEC3", 3, kVertices);
}

int GlbFile::AddSparsePositions(std::size_t count, std::span<const Index> indices,
                                std::span<const float> xyz) {
  json accessor = {{"componentType", kFloat}, {"type", "VEC3"}, {"count", count}};
  if (!indices.empty()) {
    const int index_view = document_->AddView(BytesOf(indices), kNone);
    accessor["sparse"] = {{"count", indices.size()},
                          {"indices", {{"bufferView", index_view}, {"componentType", kUnsignedInt}}},
                          {"values", {{"bufferView", document_->AddView(BytesOf(xyz), kNone)}}}};
  }
  const std::size_t at = document_->Add("accessors", std::move(accessor));
  document_->AddBounds(xyz, indices.size() < count);
  return static_cast<int>(at);
}

int GlbFile::AddUvs(std::span<const float> uv) {
  return document_->AddAccessor(uv, kFloat, "VEC2", 2, kVertices);
}

int GlbFile::AddJoints(std::span<const Index> joints, std::size_t joint_count) {
  if (joint_count <= 256) {
    const std::vector<std::uint8_t> few(joints.begin(), joints.end());
    return document_->AddAccessor<std::uint8_t>(few, kUnsignedByte, "VEC4", 4, kVertices);
  }
  const std::vector<std::uint16_t> many(joints.begin(), joints.end());
  return document_->AddAccessor<std::uint16_t>(many, kUnsignedShort, "VEC4", 4, kVertices);
}

int GlbFile::AddWeights(std::span<const float> weights) {
  return document_->AddAccessor(weights, kFloat, "VEC4", 4, kVertices);
}

int GlbFile::AddIndices(std::span<const Index> indices) {
  return document_->AddAccessor(indices, kUnsignedInt, "SCALAR", 1, kIndices);
}

int GlbFile::AddMatrices(std::span<const float> columns) {
  return document_->AddAccessor(columns, kFloat, "MAT4", 16, kNone);
}

int GlbFile::AddTimes(std::span<const float> times) {
  const int accessor = AddNumbers(times);
  document_->root["accessors"].back()["min"] = {times.front()};
  document_->root["accessors"].back()["max"] = {times.back()};
  return accessor;
}

int GlbFile::AddNumbers(std::span<const float> values) {
  return document_->AddAccessor(values, kFloat, "SCALAR", 1, kNone);
}

int GlbFile::AddKeys(std::span<const float> values, std::size_t width) {
  return document_->AddAccessor(values, kFloat, width == 3 ? "VEC3" : "VEC4", width, kNone);
}

void GlbFile::AddImage(const CacheImage& image) {
  const int view = document_->AddView(image.bytes, kNone);
  const std::size_t at = document_->Add("images", {{"bufferView", view}, {"mimeType", image.type}});
  document_->Add("textures", {{"source", at}});
}

void GlbFile::AddMaterial(const CacheMaterial& material) {
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
  document_->Add("materials", std::move(out));
}

std::size_t GlbFile::AddMesh(const GlbMesh& mesh) {
  json out = {{"name", mesh.name}, {"primitives", json::array()}};
  for (const GlbPrimitive& from : mesh.primitives) {
    json primitive;
    if (from.indices < 0) {
      primitive["mode"] = 0;
    } else {
      primitive["indices"] = from.indices;
    }
    for (const auto& [name, accessor] : from.attributes) primitive["attributes"][name] = accessor;
    if (from.material != kNoIndex) primitive["material"] = from.material;
    for (const GlbPrimitive::Target& target : from.targets) {
      json to = {{"POSITION", target.position}};
      if (target.normal >= 0) to["NORMAL"] = target.normal;
      primitive["targets"].push_back(std::move(to));
    }
    out["primitives"].push_back(std::move(primitive));
  }
  if (!mesh.weights.empty()) out["weights"] = mesh.weights;
  if (!mesh.target_names.empty()) out["extras"]["targetNames"] = mesh.target_names;
  return document_->Add("meshes", std::move(out));
}

std::size_t GlbFile::AddSkin(const std::vector<std::size_t>& joints, int inverse_binds) {
  return document_->Add("skins", {{"joints", joints}, {"inverseBindMatrices", inverse_binds}});
}

std::size_t GlbFile::AddNode(const std::string& name) { return document_->Add("nodes", {{"name", name}}); }

void GlbFile::AddToScene(std::size_t node) {
  document_->root["scene"] = 0;
  document_->root["scenes"][0]["nodes"].push_back(node);
}

void GlbFile::AddChild(std::size_t parent, std::size_t node) {
  document_->node(parent)["children"].push_back(node);
}

void GlbFile::SetTransform(std::size_t node, const char* path, const std::vector<float>& values) {
  document_->node(node)[path] = values;
}

void GlbFile::SetMesh(std::size_t node, std::size_t mesh) { document_->node(node)["mesh"] = mesh; }
void GlbFile::SetSkin(std::size_t node, std::size_t skin) { document_->node(node)["skin"] = skin; }

void GlbFile::AddChannel(int input, int output, std::size_t node, const char* path) {
  json& animation = document_->root["animations"][0];
  animation["samplers"].push_back({{"input", input}, {"output", output}});
  animation["channels"].push_back(
      {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
}

void GlbFile::NameAnimation(const std::string& name) {
  if (document_->root.contains("animations"))
    document_->root["animations"][0]["name"] = name.empty() ? "cache" : name;
}

Status GlbFile::Write(const std::string& path, bool force) {
  std::vector<std::uint8_t>& bytes = document_->bytes;
  json& root = document_->root;
  bytes.resize((bytes.size() + 3) / 4 * 4);
  if (!bytes.empty()) root["buffers"].push_back({{"byteLength", bytes.size()}});
  std::string text = root.dump(-1, ' ', false, json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t total = 12 + 8 + text.size() + (bytes.empty() ? 0 : 8 + bytes.size());
  if (total > 0xffffffffu)
    return Status::Invalid("would have {} bytes, .glb holds at most 4 GB", total).At({path});
  std::vector<std::uint8_t> head;
  const auto put = [&](std::uint64_t word) {
    for (int i = 0; i < 4; ++i) head.push_back(static_cast<std::uint8_t>(word >> (8 * i)));
  };
  put(0x46546c67), put(2), put(total), put(text.size()), put(0x4e4f534a);
  head.insert(head.end(), text.begin(), text.end());
  if (!bytes.empty()) put(bytes.size()), put(0x004e4942);
  return WriteFileAtomically(path, force, [&](const ByteSink& sink) -> Status {
    KPSA_RETURN_IF_ERROR(sink(head));
    return sink(bytes);
  });
}

}  // namespace kpsa::engine
