// A character whose buffer views are compressed by meshoptimizer's encoders.
#pragma once

#include <meshoptimizer.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/rig/grid_character.h"

namespace kpsa::engine {

inline std::vector<std::uint8_t> EncodeAttributes(const void* data, std::size_t count, std::size_t stride) {
  std::vector<std::uint8_t> encoded(meshopt_encodeVertexBufferBound(count, stride));
  encoded.resize(meshopt_encodeVertexBuffer(encoded.data(), encoded.size(), data, count, stride));
  EXPECT_FALSE(encoded.empty());
  return encoded;
}
inline std::vector<std::uint8_t> EncodeIndices(const std::vector<unsigned>& indices, std::size_t vertices,
                                               bool triangles) {
  std::vector<std::uint8_t> encoded(triangles ? meshopt_encodeIndexBufferBound(indices.size(), vertices)
                                              : meshopt_encodeIndexSequenceBound(indices.size(), vertices));
  encoded.resize(
      triangles
          ? meshopt_encodeIndexBuffer(encoded.data(), encoded.size(), indices.data(), indices.size())
          : meshopt_encodeIndexSequence(encoded.data(), encoded.size(), indices.data(), indices.size()));
  EXPECT_FALSE(encoded.empty());
  return encoded;
}

// A document whose views stand compressed in buffer 0; buffer 1, which they fall back to, has no data.
class Compressed {
 public:
  explicit Compressed(GltfBuilder builder) : out(std::move(builder)), plain_(std::move(out.buffer)) {
    out.buffer.clear();
    out.root["extensionsUsed"] =
        out.root["extensionsRequired"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  }

  // Replaces the view of an accessor by these compressed bytes.
  void Put(int accessor, const char* mode, const char* filter, std::size_t count, std::size_t stride,
           const std::vector<std::uint8_t>& encoded) {
    nlohmann::json& view = View(accessor);
    while (out.buffer.size() % 4 != 0) out.buffer.push_back(0);
    view["buffer"] = 1;
    view["byteOffset"] = fallback_size_;
    view["byteLength"] = count * stride;
    nlohmann::json extension = {{"buffer", 0},
                                {"byteOffset", out.buffer.size()},
                                {"byteLength", encoded.size()},
                                {"byteStride", stride},
                                {"count", count},
                                {"mode", mode}};
    if (filter != nullptr) extension["filter"] = filter;
    view["extensions"] = {{"EXT_meshopt_compression", extension}};
    out.buffer.insert(out.buffer.end(), encoded.begin(), encoded.end());
    fallback_size_ += count * stride;
  }
  // As it is, without loss.
  void PutAttributes(int accessor, std::size_t stride) {
    const std::vector<std::uint8_t> data = Plain(accessor);
    Put(accessor, "ATTRIBUTES", nullptr, data.size() / stride, stride,
        EncodeAttributes(data.data(), data.size() / stride, stride));
  }
  std::vector<std::uint8_t> Plain(int accessor) {
    const nlohmann::json& view = View(accessor);
    const auto begin = plain_.begin() + view["byteOffset"].get<std::ptrdiff_t>();
    return std::vector<std::uint8_t>(begin, begin + view["byteLength"].get<std::ptrdiff_t>());
  }
  nlohmann::json& View(int accessor) {
    return out.root["bufferViews"][out.root["accessors"][static_cast<std::size_t>(accessor)]["bufferView"]
                                       .get<std::size_t>()];
  }
  nlohmann::json& Extension(int accessor) { return View(accessor)["extensions"]["EXT_meshopt_compression"]; }
  std::string Text() {
    out.root["buffers"] = {
        {{"byteLength", out.buffer.size()}, {"uri", "data:application/octet-stream;base64," + out.Base64()}},
        {{"byteLength", fallback_size_},
         {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
    return out.Text();
  }
  std::string Glb() {
    out.root["buffers"] = {{{"byteLength", out.buffer.size()}}, {{"byteLength", fallback_size_}}};
    return out.Glb();
  }

  GltfBuilder out;

 private:
  std::vector<std::uint8_t> plain_;
  std::size_t fallback_size_ = 0;
};

// All of it without loss; indices as triangles or as any sequence.
inline Compressed CompressAll(const GridCharacter& grid, bool triangles) {
  Compressed compressed(grid.builder);
  for (const auto& [accessor, stride] : std::vector<std::pair<int, std::size_t>>{{grid.position, 12},
                                                                                 {grid.joint, 4},
                                                                                 {grid.weight, 16},
                                                                                 {grid.color, 4},
                                                                                 {grid.uv, 8},
                                                                                 {grid.normal, 12},
                                                                                 {grid.delta, 12},
                                                                                 {grid.matrix, 64},
                                                                                 {grid.time, 4},
                                                                                 {grid.turn, 16}})
    compressed.PutAttributes(accessor, stride);
  const std::vector<unsigned> indices(grid.indices.begin(), grid.indices.end());
  compressed.Put(grid.index, triangles ? "TRIANGLES" : "INDICES", "NONE", indices.size(), 2,
                 EncodeIndices(indices, grid.vertex_count, triangles));
  return compressed;
}

}  // namespace kpsa::engine
