// Diffuse light in a scene of triangles: what arrives directly from lights, and what arrives after bounces,
// by path tracing (Kajiya 1986) with next-event estimation.
//
// Samples are hashes of (seed, sample, dimension): the same arguments give the same light, whatever else is
// computed, in which order and on how many threads. Surfaces are Lambertian and two-sided. Irradiance is that
// of the side that faces the viewer, in the units of the lights; albedos are reflectances 0 .. 1 a channel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "base/status.h"
#include "nodes/kernels/ray_scene.h"

namespace kpsa {

struct DiffuseLight {
  enum class Kind : std::uint8_t {
    kPoint,  // at the origin of `world`; color is radiant intensity: irradiance at 1 m, facing it
    kArea,   // the square [-0.5, 0.5]^2 of world's x and y, shining along -z; color is radiance
    kSun,    // along world's -z from everywhere; color is irradiance of a surface facing it
  };
  Kind kind = Kind::kPoint;
  Matrix4 world;
  Double3 color;
};

// What a ray sees.
struct ShadingPlace {
  bool hit = false;
  Double3 position;  // world, metres
  Double3 normal;    // unit, towards the viewer: smooth over edges of less than 50 degrees
  Double3 face;      // unit, towards the viewer: of the triangle itself
  Double3 albedo;
  double scale = 0;  // metres: distances below are rounding of the position
};

class PathTracer {
 public:
  // points: world positions; triangles: three indices each; albedo: three numbers a triangle. Builds the
  // search structure, which allocates. Errors: those of RayScene::Build; albedo of another length.
  static Result<PathTracer> Build(ConstPointsView points, std::span<const Index> triangles,
                                  std::span<const float> albedo, std::vector<DiffuseLight> lights);

  // The first surface along a ray; direction need not be of unit length.
  ShadingPlace Look(Double3 origin, Double3 direction) const;
  // Irradiance that arrives from lights; `samples` a light that has an area.
  Double3 Direct(const ShadingPlace& place, std::uint32_t seed, int samples) const;
  // Irradiance that arrives from surfaces: the mean of `samples` paths of at most `bounces` surfaces, 1 at
  // least.
  Double3 Indirect(const ShadingPlace& place, std::uint32_t seed, int samples, int bounces) const;

 private:
  PathTracer(RayScene scene) : scene_(std::move(scene)) {}
  Double3 FromLight(const DiffuseLight& light, const ShadingPlace& place, double u, double v) const;
  bool Sees(const ShadingPlace& place, Double3 direction, double distance) const;

  RayScene scene_;
  std::vector<Double3> normals_;         // [triangles] unit; zero where a triangle has no area
  std::vector<Double3> corner_normals_;  // [3 * triangles]
  std::vector<Double3> albedo_;          // [triangles]
  std::vector<DiffuseLight> lights_;
};

// A number in [0, 1) of a sample's dimension: scrambled golden-ratio sequences (Roberts' R2), even over
// samples.
double SampleNumber(std::uint32_t seed, std::uint32_t sample, std::uint32_t dimension);

}  // namespace kpsa
