// Builds small glTF documents in memory. `root` is open for any change before the text is taken.
#pragma once

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace kpsa::engine {

class GltfBuilder {
 public:
  nlohmann::json root = {{"asset", {{"version", "2.0"}}}};
  std::vector<std::uint8_t> buffer;

  // Component types by C++ type.
  template <typename T>
  static int ComponentType() {
    if constexpr (std::is_same_v<T, std::int8_t>) return 5120;
    if constexpr (std::is_same_v<T, std::uint8_t>) return 5121;
    if constexpr (std::is_same_v<T, std::int16_t>) return 5122;
    if constexpr (std::is_same_v<T, std::uint16_t>) return 5123;
    if constexpr (std::is_same_v<T, std::uint32_t>) return 5125;
    return 5126;
  }

  template <typename T>
  int View(const std::vector<T>& values, int stride = 0) {
    while (buffer.size() % 4 != 0) buffer.push_back(0);
    nlohmann::json view = {
        {"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", values.size() * sizeof(T)}};
    if (stride != 0) view["byteStride"] = stride;
    const std::size_t at = buffer.size();
    buffer.resize(at + values.size() * sizeof(T));
    if (!values.empty()) std::memcpy(&buffer[at], values.data(), values.size() * sizeof(T));
    return Push("bufferViews", view);
  }

  // `type` is SCALAR, VEC2, VEC3, VEC4 or MAT4. The index of the accessor.
  template <typename T>
  int Accessor(const std::vector<T>& values, const std::string& type, bool normalized = false) {
    nlohmann::json accessor = {{"bufferView", View(values)},
                               {"componentType", ComponentType<T>()},
                               {"type", type},
                               {"count", values.size() / Width(type)}};
    if (normalized) accessor["normalized"] = true;
    return Push("accessors", accessor);
  }

  static std::size_t Width(const std::string& type) {
    return type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
  }

  int Push(const char* array, const nlohmann::json& value) {
    root[array].push_back(value);
    return static_cast<int>(root[array].size()) - 1;
  }

  // The document with its buffer as a data URI.
  std::string Text() const {
    nlohmann::json copy = root;
    if (!buffer.empty() && !copy.contains("buffers")) {
      copy["buffers"] = {
          {{"byteLength", buffer.size()}, {"uri", "data:application/octet-stream;base64," + Base64()}}};
    }
    return copy.dump();
  }

  std::string Glb() const {
    nlohmann::json copy = root;
    if (!buffer.empty() && !copy.contains("buffers")) copy["buffers"] = {{{"byteLength", buffer.size()}}};
    std::string json = copy.dump(), bin(buffer.begin(), buffer.end());
    while (json.size() % 4 != 0) json += ' ';
    while (bin.size() % 4 != 0) bin += '\0';
    std::string glb = "glTF" + U32(2) + U32(12 + 8 + json.size() + (bin.empty() ? 0 : 8 + bin.size()));
    glb += U32(json.size()) + "JSON" + json;
    if (!bin.empty()) glb += U32(bin.size()) + std::string("BIN\0", 4) + bin;
    return glb;
  }

  static std::string U32(std::size_t value) {
    std::string text;
    for (int i = 0; i < 4; ++i) text += static_cast<char>(value >> (8 * i) & 0xff);
    return text;
  }

  std::string Base64() const {
    static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < buffer.size(); i += 3) {
      std::uint32_t bits = 0;
      for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < buffer.size() ? buffer[i + k] : 0u);
      for (std::size_t k = 0; k < 4; ++k) {
        text += i + k > buffer.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63];
      }
    }
    return text;
  }

  // A triangle with two joints, a morph target and a clip: every section of a document, and valid.
  // Nodes: 0 mesh (skinned), 1 root joint, 2 joint below a plain node 3.
  static GltfBuilder Character() {
    GltfBuilder b;
    const int position = b.Accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int joints = b.Accessor<std::uint8_t>({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, "VEC4");
    const int weights = b.Accessor<float>({0.25f, 0.75f, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    const int indices = b.Accessor<std::uint16_t>({0, 1, 2}, "SCALAR");
    const int delta = b.Accessor<float>({0, 0, 0, 0, 0, 2, 0, 0, 0}, "VEC3");
    std::vector<float> matrices(32, 0.f);
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t k = 0; k < 4; ++k) matrices[16 * i + 5 * k] = 1;
    }
    const int inverse_bind = b.Accessor(matrices, "MAT4");
    const int times = b.Accessor<float>({0, 1, 3}, "SCALAR");
    const int turn = b.Accessor<float>({0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1}, "VEC4");
    const int morph = b.Accessor<float>({0, 1, 0.5f}, "SCALAR");
    b.Push("meshes",
           {{"name", "tri"},
            {"extras", {{"targetNames", {"up"}}}},
            {"weights", {0.5}},
            {"primitives",
             {{{"attributes", {{"POSITION", position}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}}},
               {"indices", indices},
               {"material", 0},
               {"targets", {{{"POSITION", delta}}}}}}}});
    b.Push("materials",
           {{"name", "Skin"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0.25, 1}}}}});
    b.Push("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", inverse_bind}, {"skeleton", 1}});
    b.Push("nodes", {{"name", "body"}, {"mesh", 0}, {"skin", 0}});
    b.Push("nodes", {{"name", "root"}, {"children", {3}}, {"translation", {0, 1, 0}}});
    b.Push("nodes", {{"name", "tip"}, {"rotation", {0, 0, 0, 1}}, {"scale", {1, 1, 1}}});
    b.Push("nodes", {{"children", {2}}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1}}});
    b.Push("scenes", {{"nodes", {0, 1}}});
    b.root["scene"] = 0;
    b.Push("animations", {{"name", "wave"},
                          {"samplers",
                           {{{"input", times}, {"output", turn}},
                            {{"input", times}, {"output", morph}, {"interpolation", "STEP"}}}},
                          {"channels",
                           {{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}},
                            {{"sampler", 1}, {"target", {{"node", 0}, {"path", "weights"}}}}}}});
    return b;
  }
};

}  // namespace kpsa::engine
