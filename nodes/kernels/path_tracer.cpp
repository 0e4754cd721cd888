#include "nodes/kernels/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/cancel.h"
#include "base/check.h"
#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

constexpr double kNudge = 1e-5;  // of the place's scale: rays start that far above a surface

Double3 PointOf(ConstPointsView p, std::size_t i) { return {p.x[i], p.y[i], p.z[i]}; }
Double3 Times(Double3 a, Double3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

// Two directions that make a right-handed frame with the unit vector n (Duff et al. 2017, JCGT 6.1).
void Frame(Double3 n, Double3* s, Double3* t) {
  const double sign = n.z >= 0 ? 1 : -1, a = -1 / (sign + n.z), b = n.x * n.y * a;
  *s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  *t = {b, sign + n.y * n.y * a, -n.y};
}

// Cosine-weighted about n (Malley's method); v counts from `along`, where that is not zero.
Double3 CosineDirection(Double3 n, Double3 along, double u, double v) {
  const double radius = std::sqrt(u), height = std::sqrt(std::max(0.0, 1 - u));
  double sine, cosine;
  SinCos(2 * kPi * v, &sine, &cosine);
  Double3 s = UnitOrZero(along - n * Dot(n, along)), t = Cross(n, s);
  if (!(Length(s) > 0)) Frame(n, &s, &t);
  return s * (radius * cosine) + t * (radius * sine) + n * height;
}

std::uint32_t Mixed(std::uint32_t x) {  // a bijection with good avalanche (C. Wellons, "hash prospector")
  x ^= x >> 16;
  x *= 0x21f0aaadu;
  x ^= x >> 15;
  x *= 0xd35a2d97u;
  return x ^ x >> 15;
}

// The pair of dimensions that says where on a light, after those of a path's directions.
std::uint32_t LightPair(int bounce, std::size_t light) {
  return 64 + static_cast<std::uint32_t>(bounce) + 64 * static_cast<std::uint32_t>(light);
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

std::uint32_t Reversed(std::uint32_t x) {
  x = (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
  x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
  x = (x & 0x0f0f0f0fu) << 4 | (x >> 4 & 0x0f0f0f0fu);
  x = (x & 0x00ff00ffu) << 8 | (x >> 8 & 0x00ff00ffu);
  return x << 16 | x >> 16;
}

// Owen's scrambling of a reversed number: each bit is flipped by a hash of those below it (Laine and Karras
// 2011, with Burley's constants).
std::uint32_t Scrambled(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  return x ^ x * 0x8d22f6e6u;
}

// Dimensions 2 pair and 2 pair + 1 of a sample.
struct NumberPair {
  double u = 0, v = 0;
};
NumberPair SamplePair(std::uint32_t seed, std::uint32_t sample, std::uint32_t pair) {
  const std::uint32_t own = Mixed(seed ^ Mixed(pair + 0x9e3779b9u));
  const std::uint32_t index = Reversed(Scrambled(Reversed(sample), own));
  // Both numbers are computed in reversed order of bits. The first dimension is the index itself; bit k of
  // the second is the sum of the index's bits j with an odd binomial (j over k), that is k's bits among j's
  std::uint32_t second = index;
  second ^= second >> 1 & 0x55555555u;
  second ^= second >> 2 & 0x33333333u;
  second ^= second >> 4 & 0x0f0f0f0fu;
  second ^= second >> 8 & 0x00ff00ffu;
  second ^= second >> 16;
  return {Reversed(Scrambled(index, own + 0x68bc21ebu)) * 0x1p-32,
          Reversed(Scrambled(second, own + 0x02e5be93u)) * 0x1p-32};
}

}  // namespace

double SampleNumber(std::uint32_t seed, std::uint32_t sample, std::uint32_t dimension) {
  const NumberPair pair = SamplePair(seed, sample, dimension / 2);
  return dimension % 2 == 0 ? pair.u : pair.v;
}

Result<PathTracer> PathTracer::Build(ConstPointsView points, std::span<const Index> triangles,
                                     std::span<const float> albedo, std::span<const DiffuseLight> lights,
                                     std::span<const std::uint8_t> unseen, std::span<const Index> shares) {
  Result<RayScene> scene = RayScene::Build(points, triangles);
  if (!scene.ok()) return scene.status();
  if (albedo.size() != triangles.size())
    return Status::Invalid("{} albedo numbers for {} triangles", albedo.size(), triangles.size() / 3);
  if (!shares.empty() && shares.size() != triangles.size())
    return Status::Invalid("{} corners share normals, there are {}", shares.size(), triangles.size());
  for (const Index share : shares) {
    if (share >= triangles.size())
      return Status::Invalid("a corner has normal {}, expected a number below {}", share, triangles.size());
  }
  PathTracer tracer(std::move(*scene));
  tracer.shares_.assign(shares.begin(), shares.end());
  tracer.lights_.resize(lights.size());
  tracer.SetLights(lights);
  tracer.corners_.assign(triangles.begin(), triangles.end());
  if (std::find(unseen.begin(), unseen.end(), 1) != unseen.end()) {
    std::vector<Index> seen;
    for (Index t = 0; 3 * std::size_t{t} < triangles.size(); ++t) {
      if (unseen[t] != 0) continue;
      tracer.seen_triangles_.push_back(t);
      seen.insert(seen.end(), &triangles[3 * std::size_t{t}], &triangles[3 * std::size_t{t}] + 3);
    }
    Result<RayScene> rest = RayScene::Build(points, seen);
    if (!rest.ok()) return rest.status();
    tracer.seen_ = std::move(*rest);
  }
  tracer.offsets_.resize(points.count + 1);
  for (Index p : triangles) ++tracer.offsets_[p + 1];
  for (std::size_t p = 0; p < points.count; ++p) tracer.offsets_[p + 1] += tracer.offsets_[p];
  tracer.around_.resize(triangles.size());
  std::vector<Index> next(tracer.offsets_.begin(), tracer.offsets_.end() - 1);
  for (std::size_t c = 0; c < triangles.size(); ++c)
    tracer.around_[next[triangles[c]]++] = static_cast<Index>(c / 3);
  for (std::size_t t = 0; t < albedo.size(); t += 3)
    tracer.albedo_.push_back({albedo[t], albedo[t + 1], albedo[t + 2]});
  tracer.positions_.resize(points.count);
  tracer.faces_.resize(triangles.size() / 3);
  tracer.normals_.resize(triangles.size() / 3);
  tracer.corner_normals_.resize(triangles.size());
  tracer.ComputeNormals(points);
  return tracer;
}

Status PathTracer::Update(ConstPointsView points, std::span<const DiffuseLight> lights,
                          const Parallel* parallel) {
  KPSA_CHECK_EQ(lights.size(), lights_.size());
  KPSA_RETURN_IF_ERROR(scene_.Update(points));
  if (seen_.has_value()) KPSA_RETURN_IF_ERROR(seen_->Update(points));
  SetLights(lights);
  ComputeNormals(points, parallel);
  return Status();
}

// Those of corners are of the triangles that share them, by their areas; where nobody said which, of all about the
// point that are turned away from this one by no more than a crease, or of all of them where there are so many that
// comparing each with each would take long.
void PathTracer::ComputeNormals(ConstPointsView points, const Parallel* parallel) {
  constexpr double kCrease = 0.6427876096865394;  // cosine of 50 degrees
  constexpr std::size_t kMany = 128, kGrain = 1024;
  for (std::size_t i = 0; i < points.count; ++i) positions_[i] = PointOf(points, i);
  ForRanges(parallel, faces_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Double3 a = positions_[corners_[3 * t]];
      faces_[t] = Cross(positions_[corners_[3 * t + 1]] - a, positions_[corners_[3 * t + 2]] - a);
      normals_[t] = UnitOrZero(faces_[t]);
    }
  });
  if (!shares_.empty()) {
    std::vector<Double3> sums(shares_.size());
    for (std::size_t c = 0; c < shares_.size(); ++c) sums[shares_[c]] = sums[shares_[c]] + faces_[c / 3];
    for (std::size_t c = 0; c < shares_.size(); ++c) corner_normals_[c] = UnitOrZero(sums[shares_[c]]);
    return;
  }
  ForRanges(parallel, points.count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const std::span<const Index> around(around_.data() + offsets_[p], offsets_[p + 1] - offsets_[p]);
      const auto set = [&](Index t, Double3 normal) {
        for (std::size_t c = 3 * std::size_t{t}; c < 3 * std::size_t{t} + 3; ++c) {
          if (corners_[c] == p) corner_normals_[c] = normal;
        }
      };
      if (around.size() > kMany) {
        Double3 sum;
        for (const Index t : around) sum = sum + faces_[t];
        const Double3 normal = UnitOrZero(sum);
        for (const Index t : around) set(t, normal);
        continue;
      }
      for (const Index t : around) {
        Double3 sum;
        for (const Index other : around) {
          if (Dot(normals_[other], normals_[t]) >= kCrease) sum = sum + faces_[other];
        }
        set(t, UnitOrZero(sum));
      }
    }
  });
}

ShadingPlace PathTracer::First(const RayScene& scene, std::span<const Index> numbers, Double3 origin,
                               Double3 direction) const {
  ShadingPlace place;
  const Double3 unit = UnitOrZero(direction);
  const Ray ray = MakeRay(origin, unit, 1e30);
  RayHit hit;
  scene.ClosestHits({&ray, 1}, {&hit, 1});
  if (hit.triangle == kNoIndex) return place;
  place.triangle = numbers.empty() ? hit.triangle : numbers[hit.triangle];
  place.u = hit.u, place.v = hit.v;
  const Double3 flat = normals_[place.triangle];
  const Double3* const corners = &corner_normals_[3 * std::size_t{place.triangle}];
  const Double3 smooth =
      UnitOrZero(corners[0] * (1.0 - place.u - place.v) + corners[1] * place.u + corners[2] * place.v);
  const double side = Dot(flat, unit) > 0 ? -1 : 1;
  place.hit = true;
  place.position = origin + unit * hit.t;
  place.face = flat * side;
  place.normal = Dot(smooth, unit) * side < 0 ? smooth * side : place.face;
  place.albedo = albedo_[place.triangle];
  place.scale = std::max({Length(place.position), static_cast<double>(hit.t), 1e-3});
  return place;
}

ShadingPlace PathTracer::OnPoint(Index point) const {
  ShadingPlace place;
  Double3 sum;
  for (Index i = offsets_[point]; i < offsets_[point + 1]; ++i) sum = sum + faces_[around_[i]];
  place.normal = place.face = UnitOrZero(sum);
  place.position = positions_[point];
  place.hit = Length(place.normal) > 0;
  place.scale = std::max(Length(place.position), 1e-3);
  if (!place.hit) return place;
  place.triangle = around_[offsets_[point]];
  place.albedo = albedo_[place.triangle];
  const Index* corner = &corners_[3 * std::size_t{place.triangle}];
  place.along = positions_[corner[0] == point ? corner[1] : corner[0]] - place.position;
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

void PathTracer::SetLights(std::span<const DiffuseLight> lights) {
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const Matrix4& world = lights[l].world;
    Lamp& lamp = lights_[l];
    lamp.kind = lights[l].kind;
    lamp.color = lights[l].color;
    lamp.at = TransformPoint(world, {});
    lamp.x = TransformVector(world, {1, 0, 0}), lamp.y = TransformVector(world, {0, 1, 0});
    lamp.shines = UnitOrZero(TransformVector(world, {0, 0, -1}));
    lamp.radius = Length(lamp.x);
    lamp.area = Length(Cross(lamp.x, lamp.y));
  }
}

Double3 PathTracer::FromLight(const Lamp& light, const ShadingPlace& place, double u, double v) const {
  if (light.kind == DiffuseLight::Kind::kSun) {
    const double cosine = -Dot(light.shines, place.normal);
    if (!(cosine > 0) || !Sees(place, light.shines * -1.0, 1e30)) return {};
    return light.color * cosine;
  }
  Double3 at = light.at, axis;
  if (light.kind == DiffuseLight::Kind::kArea) {
    at = at + light.x * (u - 0.5) + light.y * (v - 0.5);
    axis = light.shines;
  } else if (light.kind == DiffuseLight::Kind::kBall) {
    axis = UnitOrZero(place.position - at);
    const double radius = std::sqrt(u) * light.radius;
    double sine, cosine;
    SinCos(2 * kPi * v, &sine, &cosine);
    Double3 s, t;
    Frame(axis, &s, &t);
    at = at + s * (radius * cosine) + t * (radius * sine);
  }
  const Double3 way = at - place.position;
  const double distance = Length(way);
  if (!(distance > 0)) return {};
  const Double3 direction = way * (1 / distance);
  double strength = Dot(direction, place.normal) / (distance * distance);
  if (!(strength > 0)) return {};
  if (light.has_size()) strength *= -Dot(direction, axis);
  if (light.kind == DiffuseLight::Kind::kArea) strength *= light.area;
  if (!(strength > 0) || !Sees(place, direction, distance)) return {};
  return light.color * strength;
}

Double3 PathTracer::Direct(const ShadingPlace& place, std::uint32_t seed, int samples) const {
  Double3 sum;
  if (!place.hit) return sum;
  for (std::size_t l = 0; l < lights_.size(); ++l) {
    const int count = lights_[l].has_size() ? std::max(samples, 1) : 1;
    Double3 light;
    for (int s = 0; s < count; ++s) {
      const NumberPair at = SamplePair(seed, static_cast<std::uint32_t>(s), LightPair(0, l));
      light = light + FromLight(lights_[l], place, at.u, at.v);
    }
    sum = sum + light * (1.0 / count);
  }
  return sum;
}

constexpr int kSamplesUnasked = 64;  // some tens of microseconds

// E = pi / N sum L_i over cosine-weighted directions, with L = albedo / pi (E_direct + E_bounced) there.
Double3 PathTracer::Indirect(const ShadingPlace& place, const PathOptions& options) const {
  Double3 sum;
  if (!place.hit) return sum;
  const double largest = options.largest > 0 ? options.largest : std::numeric_limits<double>::infinity();
  for (int s = 0; s < options.samples; ++s) {
    if (s % kSamplesUnasked == 0) ThrowIfCancelled();
    const auto sample = static_cast<std::uint32_t>(s);
    Double3 through = {1, 1, 1};
    ShadingPlace from = place;
    for (int bounce = 0; bounce < options.bounces; ++bounce) {
      const NumberPair way = SamplePair(options.seed, sample, static_cast<std::uint32_t>(bounce));
      const Double3 direction = CosineDirection(from.normal, from.along, way.u, way.v);
      if (!(Dot(direction, from.face) > 0)) break;
      const ShadingPlace next = Look(from.position + from.face * (kNudge * from.scale), direction);
      if (!next.hit) break;
      through = Times(through, next.albedo);
      for (std::size_t l = 0; l < lights_.size(); ++l) {
        NumberPair at;
        if (lights_[l].has_size()) at = SamplePair(options.seed, sample, LightPair(bounce, l));
        const Double3 light = Times(through, FromLight(lights_[l], next, at.u, at.v));
        const double most = std::max({light.x, light.y, light.z});
        sum = sum + (most > largest ? light * (largest / most) : light);
      }
      from = next;
    }
  }
  return sum * (1.0 / std::max(options.samples, 1));
}

}  // namespace kpsa::engine
