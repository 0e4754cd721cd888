// Pictures that cover surfaces.
#pragma once

#include <memory>
#include <vector>

#include "base/types.h"
#include "gltf/textures.h"
#include "picture/image.h"

namespace kpsa::engine {

// A picture and halves of it, halves of these and so on, each pixel the mean of four in linear light.
class Texture {
 public:
  explicit Texture(Image picture);
  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }

  // Linear colour at (u, v), v downwards, (0, 0) the upper left corner. `texels`: along a side of what is to be
  // averaged, in texels of the whole picture. Black where a coordinate is not finite.
  Double3 At(double u, double v, double texels, gltf::Wrap wrap_u, gltf::Wrap wrap_v, bool nearest) const;

 private:
  std::vector<Image> levels_;  // the largest first
};

// How a surface is covered by one.
struct SurfaceTexture {
  std::shared_ptr<const Texture> texture;
  gltf::Wrap wrap_u = gltf::Wrap::kRepeat, wrap_v = gltf::Wrap::kRepeat;
  bool nearest = false;
  Double3 At(double u, double v, double texels) const {
    return texture->At(u, v, texels, wrap_u, wrap_v, nearest);
  }
};

// Texels along a side of a sample of `size` metres on a triangle of these corners; uvs: u v of each.
double TexelsOf(const SurfaceTexture& texture, const Double3 (&corners)[3], const double (&uvs)[3][2],
                double size);

}  // namespace kpsa::engine
