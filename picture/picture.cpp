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

struct Axes {
  Double3 right, up, back;
};

Axes AxesOf(const Camera& camera, double azimuth, double elevation) {
  Axes axes;
  axes.back = {Sin(azimuth) * Cos(elevation), Sin(elevation), Cos(azimuth) * Cos(elevation)};
  axes.right = Cross(camera.up, axes.back);
  axes.right = Length(axes.right) > 1e-9 ? UnitVector(axes.right) : Double3{1, 0, 0};
  axes.up = Cross(axes.back, axes.right);
  return axes;
}

template <typename F>
void EachPoint(const RenderInput& input, F&& f) {
  for (const RenderPart& part : input.parts) {
    for (std::size_t i = 0; i + 2 < part.points.size(); i += 3)
      f(Double3{part.points[i], part.points[i + 1], part.points[i + 2]});
  }
}

// From the camera's target, as near as possible with all points between title and caption.
double DistanceTo(const RenderInput& input, const Camera& camera, const RenderOptions& options,
                  const Axes& axes) {
  // tan(fov / 2) from sine and cosine
  const double slope = Sin(camera.field_of_view / 2) / Cos(camera.field_of_view / 2) * 0.84;
  const double aspect = static_cast<double>(options.width) / options.height;
  double distance = 0;
  EachPoint(input, [&](Double3 point) {
    const Double3 d = point - camera.target;
    const double forward = Dot(d, axes.back);
    distance = std::max(distance, forward + std::fabs(Dot(d, axes.up)) / slope);
    distance = std::max(distance, forward + std::fabs(Dot(d, axes.right)) / (slope * aspect));
  });
  return distance;
}

}  // namespace

Camera FrameCamera(const RenderInput& input, const RenderOptions& options, double azimuth, double elevation) {
  Camera camera;
  Double3 center;
  const double diagonal = std::max(Diagonal(input, &center), 1e-6);
  const Axes axes = AxesOf(camera, azimuth, elevation);
  // Centre the projection of the box of the points, too: a head's middle is not its picture's middle
  double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
  EachPoint(input, [&](Double3 point) {
    const double at[2] = {Dot(point - center, axes.right), Dot(point - center, axes.up)};
    for (int k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], at[k]);
      high[k] = std::max(high[k], at[k]);
    }
  });
  if (low[0] <= high[0])
    center = center + axes.right * ((low[0] + high[0]) / 2) + axes.up * ((low[1] + high[1]) / 2);
  camera.target = center;
  camera.eye = center + axes.back * std::max(diagonal * 0.5, DistanceTo(input, camera, options, axes));
  return camera;
}

std::vector<Camera> FrameAround(const RenderInput& input, const RenderOptions& options, int count,
                                double elevation) {
  std::vector<Camera> cameras(static_cast<std::size_t>(count));
  Double3 center;
  double distance = std::max(Diagonal(input, &center), 1e-6) * 0.5;
  const auto azimuth = [&](std::size_t i) { return 2 * kPi * static_cast<double>(i) / count; };
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    cameras[i].target = center;
    distance =
        std::max(distance, DistanceTo(input, cameras[i], options, AxesOf(cameras[i], azimuth(i), elevation)));
  }
  for (std::size_t i = 0; i < cameras.size(); ++i)
    cameras[i].eye = center + AxesOf(cameras[i], azimuth(i), elevation).back * distance;
  return cameras;
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
          const double size = hits[k].t * slope / options.height;  // of one of 2 x 2 samples of a pixel
          sum = sum + (hits[k].triangle == kNoIndex
                           ? ground
                           : Shade(*surface, hits[k], directions[k] * -1.0, lights, size));
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
  for (const Camera& camera : FrameAround(input, options, count, elevation)) {
    Result<Image> frame = RenderMesh(input, camera, options);
    if (!frame.ok()) return frame.status();
    frames.push_back(std::move(*frame));
  }
  return frames;
}

}  // namespace kpsa::engine
