#include "picture/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/points.h"
#include "base/scalar_math.h"
#include "nodes/kernels/ray_scene.h"
#include "picture/surface.h"

namespace kpsa::engine {
namespace {

constexpr int kLargestSide = 8192;

}  // namespace

Camera FrameCamera(const RenderInput& input, const RenderOptions& options, double azimuth, double elevation) {
  Camera camera;
  Double3 center;
  const double diagonal = std::max(Diagonal(input, &center), 1e-6);
  const Double3 back = {Sin(azimuth) * Cos(elevation), Sin(elevation), Cos(azimuth) * Cos(elevation)};
  Double3 right = Cross(camera.up, back);
  right = Length(right) > 1e-9 ? UnitVector(right) : Double3{1, 0, 0};
  const Double3 up = Cross(back, right);
  // As near as possible with all points inside and below the title: tan(fov / 2) from sine and cosine
  const double slope = Sin(camera.field_of_view / 2) / Cos(camera.field_of_view / 2) * 0.88;
  const double aspect = static_cast<double>(options.width) / options.height;
  // Centre the projection of the box of the points, too: a head's middle is not its picture's middle
  double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
  const auto each_point = [&](auto&& f) {
    for (const RenderPart& part : input.parts) {
      for (std::size_t i = 0; i + 2 < part.points.size(); i += 3) {
        f(Double3{part.points[i], part.points[i + 1], part.points[i + 2]} - center);
      }
    }
  };
  each_point([&](Double3 d) {
    const double at[2] = {Dot(d, right), Dot(d, up)};
    for (int k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], at[k]);
      high[k] = std::max(high[k], at[k]);
    }
  });
  if (low[0] <= high[0]) center = center + right * ((low[0] + high[0]) / 2) + up * ((low[1] + high[1]) / 2);
  double distance = diagonal * 0.5;
  each_point([&](Double3 unshifted) {
    const Double3 d = unshifted - right * ((low[0] + high[0]) / 2) - up * ((low[1] + high[1]) / 2);
    const double forward = Dot(d, back);
    distance = std::max(distance, forward + std::fabs(Dot(d, up)) / slope);
    distance = std::max(distance, forward + std::fabs(Dot(d, right)) / (slope * aspect));
  });
  camera.target = center;
  camera.eye = center + back * distance;
  return camera;
}

Result<Image> RenderMesh(const RenderInput& input, const Camera& camera, const RenderOptions& options) {
  if (options.width < 1 || options.height < 1 || options.width > kLargestSide ||
      options.height > kLargestSide) {
    return Status::Usage("a picture of {} x {} pixels: each side must be from 1 to {}", options.width,
                         options.height, kLargestSide);
  }
  Result<Surface> surface = GatherSurface(input);
  if (!surface.ok()) return surface.status();
  Result<RayScene> scene = RayScene::Build(std::as_const(surface->points).view(), surface->triangles);
  if (!scene.ok()) return scene.status();
  Double3 center;
  const double diagonal = std::max(Diagonal(input, &center), 1e-6);

  const Double3 back = UnitVector(camera.eye - camera.target);
  const Double3 right = UnitVector(Cross(camera.up, back)), up = Cross(back, right);
  // The lights belong to the camera, so that every view is lit well
  const Lights lights = {UnitVector(right * -0.62 + up * 0.70 + back * 0.80),
                         UnitVector(right * 0.9 + up * 0.05 + back * 0.5),
                         UnitVector(right * 0.7 + up * 0.5 + back * -0.6)};
  Result<RayScene> shadows = RayScene::Build(std::as_const(surface->points).view(), surface->casting);
  if (!shadows.ok()) return shadows.status();
  LightPoints(*shadows, lights.key, diagonal, &*surface);

  Image image(options.width, options.height, options.background_bottom);
  const double slope = Sin(camera.field_of_view / 2) / Cos(camera.field_of_view / 2);
  const double aspect = static_cast<double>(options.width) / options.height;
  const Double3 top = LinearFromRgb(options.background_top),
                bottom = LinearFromRgb(options.background_bottom);
  ParallelFor(static_cast<std::size_t>(options.height), 8, [&](std::size_t begin, std::size_t end) {
    std::array<Ray, 4> rays;
    std::array<RayHit, 4> hits;
    for (std::size_t row = begin; row < end; ++row) {
      const double share = (static_cast<double>(row) + 0.5) / options.height;
      const Double3 ground = top * (1 - share) + bottom * share;
      for (int column = 0; column < options.width; ++column) {
        std::array<Double3, 4> directions;
        for (std::size_t k = 0; k < 4; ++k) {
          const double x = (column + 0.25 + 0.5 * static_cast<double>(k % 2)) / options.width * 2 - 1;
          const double y =
              1 - (static_cast<double>(row) + 0.25 + 0.5 * static_cast<double>(k / 2)) / options.height * 2;
          const Double3 d = UnitVector(right * (x * slope * aspect) + up * (y * slope) - back);
          directions[k] = d;
          rays[k] = {{static_cast<float>(camera.eye.x), static_cast<float>(camera.eye.y),
                      static_cast<float>(camera.eye.z)},
                     {static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)},
                     0,
                     1e30f};
        }
        scene->ClosestHits(rays, hits);
        Double3 sum = {};
        for (std::size_t k = 0; k < 4; ++k) {
          sum = sum + (hits[k].triangle == kNoIndex ? ground
                                                    : Shade(*surface, hits[k], directions[k] * -1.0, lights));
        }
        image.Set(column, static_cast<int>(row),
                  {SrgbByte(sum.x / 4), SrgbByte(sum.y / 4), SrgbByte(sum.z / 4)});
      }
    }
  });
  return image;
}

Result<std::vector<Image>> RenderTurntable(const RenderInput& input, int count, double elevation,
                                           const RenderOptions& options) {
  std::vector<Image> frames;
  for (int i = 0; i < count; ++i) {
    Result<Image> frame =
        RenderMesh(input, FrameCamera(input, options, 2 * kPi * i / count, elevation), options);
    if (!frame.ok()) return frame.status();
    frames.push_back(std::move(*frame));
  }
  return frames;
}

}  // namespace kpsa::engine
