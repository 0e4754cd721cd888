// Diffuse light in a scene of triangles: what arrives directly from lights, and what arrives after bounces,
// by path tracing (Kajiya 1986) with next-event estimation.
//
// Samples are functions of (seed, sample, dimension): the same arguments give the same light, whatever else
// is computed, in which order and on how many threads. With one seed in all frames the noise of the estimate
// does not flicker: what does not move keeps its error. Surfaces are Lambertian and two-sided. Irradiance is
// that of the side that faces the viewer, in the units of the lights; albedos are reflectances 0 .. 1 a
// channel.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "base/status.h"
#include "nodes/kernels/parallel_hook.h"
#include "nodes/kernels/ray_scene.h"

namespace kpsa::engine {

struct DiffuseLight {
  enum class Kind : std::uint8_t {
    kPoint,  // at the origin of `world`; color is radiant intensity: irradiance at 1 m, facing it
    kArea,   // the square [-0.5, 0.5]^2 of world's x and y, shining along -z; color is radiance
    kSun,    // along world's -z from everywhere; color is irradiance of a surface facing it
    kBall,  // at the origin of `world`, of the radius of its x: a disk that faces what it lights; color as of
            // a point, so that nothing near it gets more than 2 / radius^2 of it
  };
  Kind kind = Kind::kPoint;
  Matrix4 world;
  Double3 color;
};

// What a ray sees.
struct ShadingPlace {
  bool hit = false;
  Double3 position;  // world, metres
  // Unit, towards the viewer: of what shares it, where that was said; else smooth over edges of less than 50
  // degrees, and about points of very many triangles.
  Double3 normal;
  Double3 face;   // unit, towards the viewer: of the triangle itself
  Double3 along;  // across which samples turn with the surface (OnPoint), or zero
  Double3 albedo;
  double scale = 0;  // metres: distances below are rounding of the position
  Index triangle = kNoIndex;
  double u = 0, v = 0;  // it is (1 - u - v) of the way to the triangle's first corner, u to the second
};

struct PathOptions {
  std::uint32_t seed = 0;
  int samples = 1, bounces = 1;
  double largest = 0;  // of a channel of what one light gives one path at one bounce; more is scaled down,
                       // which takes light away. 0: no limit, and the mean is right
};

class PathTracer {
 public:
  // points: world positions; triangles: three indices each; albedo: three numbers a triangle. Builds the
  // search structure, which allocates. unseen: 1 for triangles that See looks through; empty: none. shares: three
  // numbers a triangle, below the number of indices; corners of one number share a normal. Empty: those of a point
  // do, over edges of less than 50 degrees.
  // Errors: those of RayScene::Build; albedo or shares of another length, a number that is too large.
  static Result<PathTracer> Build(ConstPointsView points, std::span<const Index> triangles,
                                  std::span<const float> albedo, std::span<const DiffuseLight> lights,
                                  std::span<const std::uint8_t> unseen = {},
                                  std::span<const Index> shares = {});
  // Moves points and lights, as many as there were; see RayScene::Update.
  Status Update(ConstPointsView points, std::span<const DiffuseLight> lights,
                const Parallel* parallel = nullptr);

  // The first surface along a ray; direction need not be of unit length.
  ShadingPlace Look(Double3 origin, Double3 direction) const { return First(scene_, {}, origin, direction); }
  // The first surface that is not unseen.
  ShadingPlace See(Double3 origin, Double3 direction) const {
    return seen_.has_value() ? First(*seen_, seen_triangles_, origin, direction) : Look(origin, direction);
  }
  // A point of the triangles, on the side where they are counter-clockwise; no hit where its triangles have
  // no area.
  ShadingPlace OnPoint(Index point) const;
  // Irradiance that arrives from lights; `samples` a light that has a size.
  Double3 Direct(const ShadingPlace& place, std::uint32_t seed, int samples) const;
  // Irradiance that arrives from surfaces: the mean of paths of at most `bounces` surfaces, 1 at least. Throws
  // Cancelled where the scope around it asks for that (base/cancel.h).
  Double3 Indirect(const ShadingPlace& place, const PathOptions& options) const;

 private:
  PathTracer(RayScene scene) : scene_(std::move(scene)) {}
  ShadingPlace First(const RayScene& scene, std::span<const Index> numbers, Double3 origin,
                     Double3 direction) const;
  void ComputeNormals(ConstPointsView points, const Parallel* parallel = nullptr);
  // What of a light is the same for all places.
  struct Lamp {
    DiffuseLight::Kind kind = DiffuseLight::Kind::kPoint;
    Double3 at, x, y, shines, color;  // x, y: of its frame, with their lengths; shines: unit
    double radius = 0, area = 0;
    bool has_size() const { return kind == DiffuseLight::Kind::kArea || kind == DiffuseLight::Kind::kBall; }
  };
  void SetLights(std::span<const DiffuseLight> lights);
  Double3 FromLight(const Lamp& light, const ShadingPlace& place, double u, double v) const;
  bool Sees(const ShadingPlace& place, Double3 direction, double distance) const;

  RayScene scene_;
  std::optional<RayScene> seen_;         // without the unseen triangles
  std::vector<Index> seen_triangles_;    // their numbers
  std::vector<Index> corners_;           // [3 * triangles]
  std::vector<Index> offsets_, around_;  // of each point: corners that are there
  std::vector<Double3> positions_;       // [points]
  std::vector<Double3> faces_;           // [triangles] normals of the length of twice the area
  std::vector<Double3> normals_;         // [triangles] unit; zero where a triangle has no area
  std::vector<Index> shares_;            // [3 * triangles] numbers of normals, or empty
  std::vector<Double3> corner_normals_;  // [3 * triangles]
  std::vector<Double3> albedo_;          // [triangles]
  std::vector<Lamp> lights_;
};

// A number in [0, 1) of a sample's dimension. Dimensions 2k and 2k + 1 are a Sobol sequence with Owen's
// scrambling, in an order of its own (Burley 2020, JCGT 9.4): each pair is even over the first 2^n samples,
// for every n.
double SampleNumber(std::uint32_t seed, std::uint32_t sample, std::uint32_t dimension);

}  // namespace kpsa::engine
