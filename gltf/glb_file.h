// A .glb that is being written: the document and its binary chunk. Nothing outside gltf/ includes this.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

class GlbFile {
 public:
  GlbFile();
  ~GlbFile();
  nlohmann::ordered_json& root() { return *root_; }

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

  std::unique_ptr<nlohmann::ordered_json> root_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace kpsa::engine
