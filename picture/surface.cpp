#include "picture/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

constexpr int kSkyRays = 64;           // ambient occlusion rays a point
constexpr int kLightRays = 12;         // shadow rays a point towards the key light's disc
constexpr double kLightRadius = 0.22;  // of the key light's disc at distance 1

Double3 Times(Double3 a, Double3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

// Two directions that make a right-handed frame with the unit vector n (Duff et al. 2017, JCGT 6.1).
void Frame(Double3 n, Double3* s, Double3* t) {
  const double sign = n.z >= 0 ? 1 : -1, a = -1 / (sign + n.z), b = n.x * n.y * a;
  *s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  *t = {b, sign + n.y * n.y * a, -n.y};
}

// Point k of n on the unit disc: a Fibonacci spiral, even in area.
void DiscPoint(int k, int n, double* x, double* y) {
  const double radius = std::sqrt((k + 0.5) / n), angle = k * 2.39996322972865332;
  *x = radius * Cos(angle);
  *y = radius * Sin(angle);
}

// Both directions of sRGB's curve are by roots and powers alone, good to half a byte (I. Taylor, "sRGB
// approximations").
double LinearFromSrgb(std::uint8_t byte) {
  const double s = byte / 255.0;
  return s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878);
}

Double3 PointOf(ConstPointsView p, std::size_t i) { return {p.x[i], p.y[i], p.z[i]}; }

// What the texture there says, of a sample of that size.
Double3 TexelColor(const Surface& surface, const RayHit& hit, const Index* corner,
                   const std::array<double, 3>& w, double size) {
  CoveredPlace place;
  place.weights = w;
  for (std::size_t k = 0; k < 3; ++k) {
    place.corners[k] = PointOf(surface.points.view(), corner[k]);
    place.uvs[k] = {double{surface.uvs[corner[k]][0]}, double{surface.uvs[corner[k]][1]}};
  }
  return TexelAt(*surface.textures[hit.triangle], place, size);
}

}  // namespace

Double3 UnitVector(Double3 v) {
  const double length = Length(v);
  return length > 0 ? v * (1 / length) : Double3{0, 0, 1};
}

std::uint8_t SrgbByte(double linear) {
  const double s1 = std::sqrt(std::clamp(linear, 0.0, 1.0)), s2 = std::sqrt(s1), s3 = std::sqrt(s2);
  const double encoded = linear <= 0.0031308
                             ? 12.92 * linear
                             : 0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * linear;
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(encoded, 0.0, 1.0)));
}

Double3 LinearFromRgb(Rgb c) { return {LinearFromSrgb(c[0]), LinearFromSrgb(c[1]), LinearFromSrgb(c[2])}; }

void LightPoints(const RayScene& scene, Double3 to_key, double diagonal, Surface* surface) {
  const std::size_t count = surface->points.count();
  surface->sky.resize(count);
  surface->key.resize(count);
  const ConstPointsView p = std::as_const(surface->points).view();
  Double3 key_s, key_t;
  Frame(to_key, &key_s, &key_t);
  ParallelFor(count, 256, [&](std::size_t begin, std::size_t end) {
    std::array<Ray, kSkyRays> rays;
    std::array<std::uint8_t, kSkyRays> blocked;
    for (std::size_t i = begin; i < end; ++i) {
      if (surface->shares[i] != i) continue;
      const Double3 n = surface->normals[i];
      const Double3 origin = PointOf(p, i) + n * (diagonal * 1e-3);
      Double3 s, t;
      Frame(n, &s, &t);
      const auto aim = [&](Ray& ray, Double3 d, double far) {
        ray = {{static_cast<float>(origin.x), static_cast<float>(origin.y), static_cast<float>(origin.z)},
               {static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)},
               0,
               static_cast<float>(far)};
      };
      for (int k = 0; k < kSkyRays; ++k) {  // cosine-weighted: the disc lifted to the hemisphere
        double x, y;
        DiscPoint(k, kSkyRays, &x, &y);
        aim(rays[static_cast<std::size_t>(k)],
            s * x + t * y + n * std::sqrt(std::max(0.0, 1 - x * x - y * y)), diagonal * 0.35);
      }
      scene.Occluded(rays, blocked);
      int seen = 0;
      for (std::uint8_t b : blocked) seen += b == 0;
      surface->sky[i] = static_cast<float>(seen) / kSkyRays;
      for (int k = 0; k < kLightRays; ++k) {
        double x, y;
        DiscPoint(k, kLightRays, &x, &y);
        aim(rays[static_cast<std::size_t>(k)],
            to_key + key_s * (x * kLightRadius) + key_t * (y * kLightRadius), 1e30);
      }
      scene.Occluded(std::span(rays).first(kLightRays), std::span(blocked).first(kLightRays));
      seen = 0;
      for (int k = 0; k < kLightRays; ++k) seen += blocked[static_cast<std::size_t>(k)] == 0;
      surface->key[i] = static_cast<float>(seen) / kLightRays;
    }
  });
  for (std::size_t i = 0; i < count; ++i) {
    surface->sky[i] = surface->sky[surface->shares[i]];
    surface->key[i] = surface->key[surface->shares[i]];
  }
}

Double3 Shade(const Surface& surface, const RayHit& hit, Double3 view, const Lights& lights, double size) {
  const Index* corner = &surface.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  const std::array<double, 3> w = {1.0 - hit.u - hit.v, hit.u, hit.v};
  Double3 n = {}, color = {};
  double sky = 0, key = 0, matte = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Index i = corner[k];
    n = n + surface.normals[i] * w[k];
    color = color + surface.colors[i] * w[k];
    sky += surface.sky[i] * w[k];
    key += surface.key[i] * w[k];
    matte += surface.matte[i] * w[k];
  }
  n = UnitVector(n);
  // An open surface seen from behind; the smooth normal alone may turn away at a silhouette, too
  const ConstPointsView p = surface.points.view();
  const Double3 a = PointOf(p, corner[0]),
                facet = Cross(PointOf(p, corner[1]) - a, PointOf(p, corner[2]) - a);
  if (Dot(facet, view) < 0) n = n * -1.0;
  if (!surface.textures.empty() && surface.textures[hit.triangle] != nullptr) {
    // What is seen at a slant is larger than it looks; a texture knows no direction, so half of that
    const double facing = std::fabs(Dot(UnitVector(facet), view));
    color = Times(color, TexelColor(surface, hit, corner, w, size / std::sqrt(std::max(facing, 0.05))));
  }
  // Sky from above, ground bounce from below, key with a soft terminator, weak fill
  const double up = 0.5 + 0.5 * n.y;
  const Double3 ambient =
      (Double3{0.50, 0.54, 0.60} * up + Double3{0.34, 0.29, 0.26} * (1 - up)) * (sky * sky);
  const double wrapped = std::max(0.0, (Dot(n, lights.key) + 0.12) / 1.12);
  const Double3 diffuse = Double3{1.0, 0.96, 0.90} * (1.02 * wrapped * key) +
                          Double3{0.62, 0.74, 0.95} * (0.22 * std::max(0.0, Dot(n, lights.fill)) * sky) +
                          ambient * 0.82;
  Double3 out = Times(color, diffuse);
  if (matte < 0.5) {
    const double facing = 1 - std::max(0.0, Dot(n, view)), fresnel = facing * facing * facing * facing;
    const double h = std::max(0.0, Dot(n, UnitVector(lights.key + view)));
    const double h2 = h * h, h4 = h2 * h2, h8 = h4 * h4, h16 = h8 * h8, h32 = h16 * h16;
    const double rim = std::max(0.0, Dot(n, lights.rim)) * fresnel * 0.35 * sky;
    out = out + Double3{1, 0.98, 0.95} * (0.07 * h32 * key + 0.035 * h8 * key) + Double3{0.8, 0.9, 1} * rim;
  }
  return out;
}

}  // namespace kpsa::engine
