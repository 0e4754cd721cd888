// The pictures of base colours that a glTF file holds or names, as bytes, for whoever draws. The reader of what
// deforms (gltf/import.h) reads none of this.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/types.h"

namespace kpsa::engine::gltf {

// How texture coordinates beyond 0 and 1 are taken (glTF 2.0, 5.26).
enum class Wrap : std::uint8_t { kRepeat, kMirror, kClamp };

// What covers a material: texel coordinates are `place` of TEXCOORD_n, the top left of the picture at (0, 0).
struct BaseTexture {
  std::size_t image = 0;  // in BaseTextures::images
  std::size_t uv_set = 0;
  Wrap wrap_u = Wrap::kRepeat, wrap_v = Wrap::kRepeat;
  bool nearest = false;  // magnified without interpolation
  // KHR_texture_transform: u' = a u + b v + c, v' = d u + e v + f
  std::array<double, 6> place = {1, 0, 0, 0, 1, 0};
};

struct BaseTextures {
  struct Image {
    std::string where;  // for messages: the file and the place in it
    std::vector<std::uint8_t> bytes;
  };
  std::vector<std::optional<BaseTexture>> materials;  // by material of the file
  std::vector<Image> images;                          // each once
};

// Those of some materials of a file: images within it, in data URIs and files of its folder. What cannot be read
// is left out, with a note that says where it stands and why. `budget`: bytes that may still be read; it is taken
// from.
BaseTextures ReadBaseTextures(const std::string& path, std::span<const Index> materials,
                              std::uint64_t* budget, std::vector<std::string>* notes);

}  // namespace kpsa::engine::gltf
