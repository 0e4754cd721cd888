// A .glb taken apart, so that a test changes its JSON or its numbers, and put together again.
#pragma once

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/gltf_builder.h"

namespace kpsa::engine {

struct GlbParts {
  nlohmann::json json;
  std::string bin;

  explicit GlbParts(const std::string& bytes) {
    const std::uint32_t size = U32(bytes, 12);
    json = nlohmann::json::parse(bytes.substr(20, size));
    bin = bytes.substr(28 + size, U32(bytes, 20 + size));
  }
  std::string Bytes() const {
    std::string text = json.dump();
    while (text.size() % 4 != 0) text += ' ';
    return "glTF" + GltfBuilder::U32(2) + GltfBuilder::U32(28 + text.size() + bin.size()) +
           GltfBuilder::U32(text.size()) + "JSON" + text + GltfBuilder::U32(bin.size()) +
           std::string("BIN\0", 4) + bin;
  }
  // Element i of an accessor of tightly packed numbers.
  template <typename T>
  T* At(int accessor, std::size_t i, std::size_t width) {
    const nlohmann::json& a = json["accessors"][static_cast<std::size_t>(accessor)];
    const nlohmann::json& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
    const std::size_t begin =
        view.value("byteOffset", std::size_t{0}) + a.value("byteOffset", std::size_t{0});
    return reinterpret_cast<T*>(bin.data() + begin + i * width * sizeof(T));
  }

 private:
  static std::uint32_t U32(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  }
};

}  // namespace kpsa::engine
