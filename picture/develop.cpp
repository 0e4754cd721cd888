// From the light that a camera's picture holds to pixels (picture/camera_picture.h).
#include <algorithm>
#include <cmath>

#include "picture/camera_picture.h"

namespace kpsa::engine {
namespace {

double SrgbCurve(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

// Everything up to 0.8 as it is, beyond it a curve that reaches 1 at infinity.
double Compressed(double x) { return x <= 0.8 ? x : 1 - 0.2 * 0.2 / (x - 0.6); }

}  // namespace

Image LightError(const CameraImage& a, const CameraImage& b, double error_max) {
  Image image(static_cast<int>(a.width), static_cast<int>(a.height), {24, 26, 30});
  for (std::size_t p = 0; p < a.hit.size(); ++p) {
    double squares = 0;
    for (std::size_t k = 3 * p; k < 3 * p + 3; ++k) {
      const double d = double{a.indirect[k]} - b.indirect[k];
      squares += d * d;
    }
    const Rgb color = TurboColor(std::sqrt(squares) / error_max);
    std::copy(color.begin(), color.end(), image.rgb.begin() + static_cast<std::ptrdiff_t>(3 * p));
  }
  return image;
}

Image Develop(const CameraImage& picture, double exposure, CameraLayer layer) {
  Image image(static_cast<int>(picture.width), static_cast<int>(picture.height), {24, 26, 30});
  for (std::size_t p = 0; p < picture.hit.size(); ++p) {
    if (picture.hit[p] == 0) continue;
    for (std::size_t k = 3 * p; k < 3 * p + 3; ++k) {
      double light = layer == CameraLayer::kIndirect ? 0 : picture.direct[k];
      if (layer != CameraLayer::kDirect) light += std::max(0.0f, picture.indirect[k]);
      const double radiance = picture.albedo[k] * light * exposure / 3.14159265358979323846;
      image.rgb[k] = static_cast<std::uint8_t>(std::lround(255 * SrgbCurve(Compressed(radiance))));
    }
  }
  return image;
}

}  // namespace kpsa::engine
