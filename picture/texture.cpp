#include "picture/texture.h"

#include <algorithm>
#include <cmath>

#include "picture/surface.h"

namespace kpsa::engine {
namespace {

// Half as wide and high, at least 1; a last odd row or column goes into the one before it.
Image Halved(const Image& from) {
  Image to(std::max(1, from.width / 2), std::max(1, from.height / 2), {0, 0, 0});
  for (int y = 0; y < to.height; ++y) {
    const int y0 = std::min(2 * y, from.height - 1), y1 = y + 1 < to.height ? y0 + 1 : from.height - 1;
    for (int x = 0; x < to.width; ++x) {
      const int x0 = std::min(2 * x, from.width - 1), x1 = x + 1 < to.width ? x0 + 1 : from.width - 1;
      Double3 sum;
      for (int i = y0; i <= y1; ++i) {
        for (int k = x0; k <= x1; ++k) sum = sum + LinearFromRgb(from.At(k, i));
      }
      sum = sum * (1.0 / ((y1 - y0 + 1) * (x1 - x0 + 1)));
      to.Set(x, y, {SrgbByte(sum.x), SrgbByte(sum.y), SrgbByte(sum.z)});
    }
  }
  return to;
}

// Texel i of a side of `count`, beyond its ends as the sampler says.
int Wrapped(double i, int count, gltf::Wrap wrap) {
  if (wrap == gltf::Wrap::kClamp) return static_cast<int>(std::clamp(i, 0.0, count - 1.0));
  const double period = wrap == gltf::Wrap::kMirror ? 2.0 * count : count;
  const int within = static_cast<int>(std::clamp(i - period * std::floor(i / period), 0.0, period - 1));
  return within < count ? within : 2 * count - 1 - within;
}

}  // namespace

Texture::Texture(Image picture) {
  levels_.push_back(std::move(picture));
  while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(Halved(levels_.back()));
}

Double3 Texture::At(double u, double v, double texels, gltf::Wrap wrap_u, gltf::Wrap wrap_v,
                    bool nearest) const {
  if (!std::isfinite(u) || !std::isfinite(v)) return {};
  const double level = texels > 1 ? std::round(std::log2(std::min(texels, 1e9))) : 0;
  const Image& image = levels_[std::min(static_cast<std::size_t>(level), levels_.size() - 1)];
  const auto at = [&](double x, double y) {
    return LinearFromRgb(image.At(Wrapped(x, image.width, wrap_u), Wrapped(y, image.height, wrap_v)));
  };
  const double x = u * image.width, y = v * image.height;
  if (nearest && texels <= 1) return at(std::floor(x), std::floor(y));
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
  const double a = x - 0.5 - left, b = y - 0.5 - top;
  return (at(left, top) * (1 - a) + at(left + 1, top) * a) * (1 - b) +
         (at(left, top + 1) * (1 - a) + at(left + 1, top + 1) * a) * b;
}

Double3 TexelAt(const SurfaceTexture& texture, const CoveredPlace& place, double size) {
  const auto& [corners, uvs, w] = place;
  const Texture& picture = *texture.texture;
  const double area = Length(Cross(corners[1] - corners[0], corners[2] - corners[0]));
  const double covered = std::fabs((uvs[1][0] - uvs[0][0]) * (uvs[2][1] - uvs[0][1]) -
                                   (uvs[2][0] - uvs[0][0]) * (uvs[1][1] - uvs[0][1])) *
                         picture.width() * picture.height();
  const double texels = area > 0 && std::isfinite(covered) ? size * std::sqrt(covered / area) : 0;
  return picture.At(uvs[0][0] * w[0] + uvs[1][0] * w[1] + uvs[2][0] * w[2],
                    uvs[0][1] * w[0] + uvs[1][1] * w[1] + uvs[2][1] * w[2], texels, texture.wrap_u,
                    texture.wrap_v, texture.nearest);
}

}  // namespace kpsa::engine
