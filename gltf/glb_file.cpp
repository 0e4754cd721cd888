#include "gltf/glb_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "files/file.h"

namespace kpsa::engine {
namespace {
using json = nlohmann::ordered_json;
constexpr int kUnsignedInt = 5125, kFloat = 5126;
}  // namespace

GlbFile::GlbFile() : root_(new json({{"asset", {{"version", "2.0"}, {"generator", "kpsa"}}}})) {}
GlbFile::~GlbFile() = default;

int GlbFile::AddView(std::span<const std::uint8_t> bytes, Use use) {
  bytes_.resize((bytes_.size() + 3) / 4 * 4);
  json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
  if (use != kNone) view["target"] = static_cast<int>(use);
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  (*root_)["bufferViews"].push_back(std::move(view));
  return static_cast<int>((*root_)["bufferViews"].size()) - 1;
}

template <typename T>
int GlbFile::AddAccessor(std::span<const T> values, int component_type, const char* type, std::size_t width,
                         Use use) {
  const int view = AddView({reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()}, use);
  (*root_)["accessors"].push_back({{"bufferView", view},
                                   {"componentType", component_type},
                                   {"type", type},
                                   {"count", values.size() / width}});
  return static_cast<int>((*root_)["accessors"].size()) - 1;
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
  (*root_)["accessors"].back()["min"] = low;
  (*root_)["accessors"].back()["max"] = high;
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
  if (!bytes_.empty()) (*root_)["buffers"].push_back({{"byteLength", bytes_.size()}});
  std::string text = (*root_).dump(-1, ' ', false, json::error_handler_t::replace);
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

}  // namespace kpsa::engine
