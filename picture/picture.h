// Pictures of meshes: shaded clay with soft light, or a heat map of a number a point. What `kpsa render`
// draws.
//
// Light is computed at the points (ambient occlusion and the shadow of the key light, by rays) and
// interpolated, so that pictures are free of noise; pixels are shaded with interpolated normals, 2 x 2 samples
// each. Points that share a normal are one place with one light; an edge between others is hard. The same input gives the same picture at any number of threads.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "base/types.h"
#include "picture/image.h"
#include "picture/texture.h"

namespace kpsa::engine {

// One surface. The spans must outlive the calls that are given the part, by `owner` or otherwise.
struct RenderPart {
  std::span<const float> points;     // 3 a point (x y z), metres, world space
  std::span<const Index> triangles;  // 3 indices each, counter-clockwise from outside
  std::span<const float> colors;     // 3 a point, linear light 0 .. 1; or empty: `color` everywhere
  std::span<const float> scalars;    // 1 a point, metres; or empty: the part is drawn as clay
  std::span<const Index> smooth;     // 1 a point: the first of those that share its normal; or empty: its own
  // What the colours are multiplied with: textures, 1 a point (that of a triangle's first counts; kNoIndex: none)
  // and 2 texture coordinates a point; or all empty. Scalars hide them.
  std::span<const SurfaceTexture> textures;
  std::span<const Index> texture;
  std::span<const float> uvs;
  Double3 color = {0.62, 0.43, 0.35};  // linear light
  bool casts_shadows = true;
  std::shared_ptr<const void> owner;  // keeps alive what the spans refer to, where nobody else does
};

struct RenderInput {
  std::vector<RenderPart> parts;
  double scalar_max = 1e-3;  // metres: the scalar drawn as the top of the colour scale
  double tolerance = 0;      // metres: marked on the legend of that scale; 0: none
};

// A perspective camera. The field of view is the vertical one.
struct Camera {
  Double3 eye = {0, 0, 1};
  Double3 target = {0, 0, 0};
  Double3 up = {0, 1, 0};
  double field_of_view = 0.35;  // radians
};

struct RenderOptions {
  int width = 480;
  int height = 600;
  Rgb background_top = {250, 250, 252};
  Rgb background_bottom = {206, 210, 218};
};

// A camera that sees every point of `input`: `azimuth` about Y (0: from +Z, the front; positive: towards +X),
// `elevation` above the horizon, in radians. For animations, frame one pose and keep the camera.
Camera FrameCamera(const RenderInput& input, const RenderOptions& options, double azimuth, double elevation);

// The picture of the parts. Errors: those of RayScene::Build; a size below 1 or above 8192; a span of wrong
// length.
Result<Image> RenderMesh(const RenderInput& input, const Camera& camera, const RenderOptions& options = {});

// Cameras from all around, at the azimuths 2 pi i / count, that turn about the middle of the input's box at one distance.
std::vector<Camera> FrameAround(const RenderInput& input, const RenderOptions& options, int count,
                                double elevation);
// What they see.
Result<std::vector<Image>> RenderTurntable(const RenderInput& input, int count, double elevation,
                                           const RenderOptions& options = {});

// distances[i] = |a_i - b_i| of two sets of points (3 floats each): the scalars of a heat map.
std::vector<float> PointDistances(std::span<const float> a, std::span<const float> b);

// Small balls at points of the shape: where something is measured.
struct RenderDots {
  std::string title;
  std::vector<float> points;  // 3 each, metres, world space
};
// Their surface. `radius` in metres.
RenderPart MakeDots(const RenderDots& dots, double radius);

// Three pictures side by side from one camera: "full", the accelerated one with its title, and the heat map
// of their distance, titled with its maximum, with its legend beside it; with dots a fourth, of the full shape with them, after the
// first. `full` and `accelerated` hold the same parts with different points.
Result<Image> RenderComparison(const RenderInput& full, const RenderInput& accelerated, const Camera& camera,
                               const RenderOptions& options = {}, const RenderDots* dots = nullptr,
                               const std::string& title = "accelerated");

}  // namespace kpsa::engine
