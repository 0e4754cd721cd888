#include "nodes/kernels/path_tracer.h"

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"

namespace kpsa {
namespace {

constexpr double kNudge = 1e-5;  // of the place's scale: rays start that far above a surface

Double3 PointOf(ConstPointsView p, std::size_t i) { return {p.x[i], p.y[i], p.z[i]}; }
Double3 Times(Double3 a, Double3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

Double3 UnitOrZero(Double3 v) {
  const double length = Length(v);
  return length > 0 ? v * (1 / length) : Double3();
}

// Two directions that make a right-handed frame with the unit vector n (Duff et al. 2017, JCGT 6.1).
void Frame(Double3 n, Double3* s, Double3* t) {
  const double sign = n.z >= 0 ? 1 : -1, a = -1 / (sign + n.z), b = n.x * n.y * a;
  *s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  *t = {b, sign + n.y * n.y * a, -n.y};
}

// Cosine-weighted about n (Malley's method).
Double3 CosineDirection(Double3 n, double u, double v) {
  const double radius = std::sqrt(u), height = std::sqrt(std::max(0.0, 1 - u));
  double sine, cosine;
  SinCos(2 * kPi * v, &sine, &cosine);
  Double3 s, t;
  Frame(n, &s, &t);
  return s * (radius * cosine) + t * (radius * sine) + n * height;
}

std::uint32_t Mixed(std::uint32_t x) {  // a bijection with good avalanche (C. Wellons, "hash prospector")
  x ^= x >> 16;
  x *= 0x21f0aaadu;
  x ^= x >> 15;
  x *= 0xd35a2d97u;
  return x ^ x >> 15;
}

Ray MakeRay(Double3 origin, Double3 direction, double far) {
  Ray ray;
  for (int i = 0; i < 3; ++i) {
    ray.origin[i] = static_cast<float>(origin[i]);
    ray.direction[i] = static_cast<float>(direction[i]);
  }
  ray.far = static_cast<float>(far);
  return ray;
}

// Unit normals of triangles' corners: of all triangles about the point that are turned away from this one by
// no more than a crease, by their areas.
std::vector<Double3> CornerNormals(std::size_t points, std::span<const Index> triangles,
                                   const std::vector<Double3>& faces) {
  constexpr double kCrease = 0.6427876096865394;  // cosine of 50 degrees
  std::vector<Index> offsets(points + 1, 0), around(triangles.size());
  for (Index p : triangles) ++offsets[p + 1];
  for (std::size_t p = 0; p < points; ++p) offsets[p + 1] += offsets[p];
  std::vector<Index> next(offsets.begin(), offsets.end() - 1);
  for (std::size_t c = 0; c < triangles.size(); ++c) around[next[triangles[c]]++] = static_cast<Index>(c / 3);
  std::vector<Double3> units, normals;
  for (const Double3& face : faces) units.push_back(UnitOrZero(face));
  for (std::size_t c = 0; c < triangles.size(); ++c) {
    Double3 sum;
    for (Index i = offsets[triangles[c]]; i < offsets[triangles[c] + 1]; ++i) {
      if (Dot(units[around[i]], units[c / 3]) >= kCrease) sum = sum + faces[around[i]];
    }
    normals.push_back(UnitOrZero(sum));
  }
  return normals;
}

}  // namespace

double SampleNumber(std::uint32_t seed, std::uint32_t sample, std::uint32_t dimension) {
  // Steps of two dimensions by powers of the plastic number; further pairs of dimensions are other rotations
  constexpr std::uint32_t kSteps[2] = {3242174889u, 2447445414u};
  const std::uint32_t shift = Mixed(seed ^ Mixed(dimension + 0x9e3779b9u));
  // Pairs of dimensions take the samples in orders of their own
  const std::uint32_t order = dimension < 2 ? sample : Mixed(sample ^ Mixed((dimension / 2) * 0x85ebca6bu));
  return (shift + order * kSteps[dimension % 2]) * 0x1p-32;
}

Result<PathTracer> PathTracer::Build(ConstPointsView points, std::span<const Index> triangles,
                                     std::span<const float> albedo, std::vector<DiffuseLight> lights) {
  Result<RayScene> scene = RayScene::Build(points, triangles);
  if (!scene.ok()) return scene.status();
  if (albedo.size() != triangles.size())
    return Status::Invalid("{} albedo numbers for {} triangles", albedo.size(), triangles.size() / 3);
  PathTracer tracer(std::move(*scene));
  tracer.lights_ = std::move(lights);
  std::vector<Double3> faces;  // normals of the length of twice the area
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Double3 a = PointOf(points, triangles[t]);
    faces.push_back(Cross(PointOf(points, triangles[t + 1]) - a, PointOf(points, triangles[t + 2]) - a));
    tracer.albedo_.push_back({albedo[t], albedo[t + 1], albedo[t + 2]});
  }
  tracer.corner_normals_ = CornerNormals(points.count, triangles, faces);
  for (const Double3& face : faces) tracer.normals_.push_back(UnitOrZero(face));
  return tracer;
}

ShadingPlace PathTracer::Look(Double3 origin, Double3 direction) const {
  ShadingPlace place;
  const Double3 unit = UnitOrZero(direction);
  const Ray ray = MakeRay(origin, unit, 1e30);
  RayHit hit;
  scene_.ClosestHits({&ray, 1}, {&hit, 1});
  if (hit.triangle == kNoIndex) return place;
  const Double3 flat = normals_[hit.triangle];
  const Double3* const corners = &corner_normals_[3 * std::size_t{hit.triangle}];
  const Double3 smooth = UnitOrZero(corners[0] * (1.0 - hit.u - hit.v) + corners[1] * double{hit.u} +
                                    corners[2] * double{hit.v});
  const double side = Dot(flat, unit) > 0 ? -1 : 1;
  place.hit = true;
  place.position = origin + unit * hit.t;
  place.face = flat * side;
  place.normal = Dot(smooth, unit) * side < 0 ? smooth * side : place.face;
  place.albedo = albedo_[hit.triangle];
  place.scale = std::max({Length(place.position), static_cast<double>(hit.t), 1e-3});
  return place;
}

bool PathTracer::Sees(const ShadingPlace& place, Double3 direction, double distance) const {
  if (!(Dot(direction, place.face) > 0))
    return false;  // behind the surface, though not behind its shading normal
  const double nudge = kNudge * place.scale;
  const Ray ray = MakeRay(place.position + place.face * nudge, direction, distance - 2 * nudge);
  if (!(ray.far > 0)) return true;
  std::uint8_t occluded = 0;
  scene_.Occluded({&ray, 1}, {&occluded, 1});
  return occluded == 0;
}

Double3 PathTracer::FromLight(const DiffuseLight& light, const ShadingPlace& place, double u,
                              double v) const {
  const Double3 shines = UnitOrZero(TransformVector(light.world, {0, 0, -1}));
  if (light.kind == DiffuseLight::Kind::kSun) {
    const double cosine = -Dot(shines, place.normal);
    if (!(cosine > 0) || !Sees(place, shines * -1.0, 1e30)) return {};
    return light.color * cosine;
  }
  const bool area = light.kind == DiffuseLight::Kind::kArea;
  const Double3 at = TransformPoint(light.world, area ? Double3{u - 0.5, v - 0.5, 0} : Double3());
  const Double3 way = at - place.position;
  const double distance = Length(way);
  if (!(distance > 0)) return {};
  const Double3 direction = way * (1 / distance);
  double strength = Dot(direction, place.normal) / (distance * distance);
  if (area) {
    const Double3 x = TransformVector(light.world, {1, 0, 0}), y = TransformVector(light.world, {0, 1, 0});
    strength *= -Dot(direction, shines) * Length(Cross(x, y));
    if (!(Dot(direction, shines) < 0)) return {};
  }
  if (!(strength > 0) || !Sees(place, direction, distance)) return {};
  return light.color * strength;
}

Double3 PathTracer::Direct(const ShadingPlace& place, std::uint32_t seed, int samples) const {
  Double3 sum;
  if (!place.hit) return sum;
  for (std::size_t l = 0; l < lights_.size(); ++l) {
    const bool area = lights_[l].kind == DiffuseLight::Kind::kArea;
    const int count = area ? std::max(samples, 1) : 1;
    Double3 light;
    for (int s = 0; s < count; ++s) {
      const auto sample = static_cast<std::uint32_t>(s);
      const std::uint32_t own = seed + static_cast<std::uint32_t>(l) * 0x632be5abu;
      light =
          light + FromLight(lights_[l], place, SampleNumber(own, sample, 0), SampleNumber(own, sample, 1));
    }
    sum = sum + light * (1.0 / count);
  }
  return sum;
}

// E = pi / N sum L_i over cosine-weighted directions, with L = albedo / pi (E_direct + E_bounced) there.
Double3 PathTracer::Indirect(const ShadingPlace& place, std::uint32_t seed, int samples, int bounces) const {
  Double3 sum;
  if (!place.hit) return sum;
  for (int s = 0; s < samples; ++s) {
    Double3 through = {1, 1, 1};
    ShadingPlace from = place;
    for (int bounce = 0; bounce < bounces; ++bounce) {
      const auto sample = static_cast<std::uint32_t>(s), dimension = static_cast<std::uint32_t>(4 * bounce);
      const Double3 direction = CosineDirection(from.normal, SampleNumber(seed, sample, dimension),
                                                SampleNumber(seed, sample, dimension + 1));
      if (!(Dot(direction, from.face) > 0)) break;
      const ShadingPlace next = Look(from.position + from.face * (kNudge * from.scale), direction);
      if (!next.hit) break;
      through = Times(through, next.albedo);
      for (std::size_t l = 0; l < lights_.size(); ++l) {
        const std::uint32_t own = seed + static_cast<std::uint32_t>(l) * 0x632be5abu;
        sum = sum + Times(through, FromLight(lights_[l], next, SampleNumber(own, sample, dimension + 2),
                                             SampleNumber(own, sample, dimension + 3)));
      }
      from = next;
    }
  }
  return sum * (1.0 / std::max(samples, 1));
}

}  // namespace kpsa
