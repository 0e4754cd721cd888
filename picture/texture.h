// Pictures that cover surfaces.
#pragma once

#include <array>
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
};

// A place on a covered triangle, of which everything is interpolated.
struct CoveredPlace {
  std::array<Double3, 3> corners;            // in the world
  std::array<std::array<double, 2>, 3> uvs;  // of them
  std::array<double, 3> weights;             // of them, of sum 1
};
// The colour there, of a sample of `size` metres.
Double3 TexelAt(const SurfaceTexture& texture, const CoveredPlace& place, double size);

}  // namespace kpsa::engine
