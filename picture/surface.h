// What a picture is shaded from: all its parts in one, with the light that reaches their points.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/points.h"
#include "base/status.h"
#include "base/types.h"
#include "nodes/kernels/ray_scene.h"
#include "picture/image.h"
#include "picture/picture.h"

namespace kpsa::engine {

// All parts in one, and what a pixel interpolates of each point.
struct Surface {
  PointBuffer points;
  std::vector<Index> triangles;
  std::vector<Index> casting;                   // of these, the ones that cast shadows
  std::vector<Index> shares;                    // the first of the points whose normal and light are one
  std::vector<Double3> normals;                 // unit, area-weighted
  std::vector<Double3> colors;                  // linear
  std::vector<float> sky;                       // 0 .. 1, share of the sky seen
  std::vector<float> key;                       // 0 .. 1, share of the key light seen
  std::vector<std::uint8_t> matte;              // 1: heat map, without highlights
  std::vector<const SurfaceTexture*> textures;  // by triangle, null: none; of the parts. Empty: none at all
  std::vector<std::array<float, 2>> uvs;        // by point; likewise empty
};

struct Lights {
  Double3 key, fill, rim;  // unit, towards the light
};

// All parts, lit by nothing yet. Errors: a span of wrong length, a triangle that names no point.
Result<Surface> GatherSurface(const RenderInput& input);
// The light that reaches every point: from the sky (within reach) and from the key light's disc.
// `to_key`: unit; `diagonal`: of the shape, metres.
void LightPoints(const RayScene& scene, Double3 to_key, double diagonal, Surface* surface);
// The light, linear, that goes from where a ray hits towards `view`, a unit vector. `size`: of the sample there,
// metres.
Double3 Shade(const Surface& surface, const RayHit& hit, Double3 view, const Lights& lights, double size);

// Of the box around all points; *center is its middle.
double Diagonal(const RenderInput& input, Double3* center);
Double3 UnitVector(Double3 v);  // +Z for a vector without length
std::uint8_t SrgbByte(double linear);
Double3 LinearFromRgb(Rgb c);

}  // namespace kpsa::engine
