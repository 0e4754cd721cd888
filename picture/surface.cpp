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

Status CheckPart(const RenderPart& part) {
  const std::size_t n = part.points.size() / 3;
  const auto fits = [](std::size_t size, std::size_t expected) { return size == 0 || size == expected; };
  if (part.points.size() % 3 != 0 || !fits(part.colors.size(), 3 * n) || !fits(part.scalars.size(), n)) {
    return Status::Invalid("a picture's part has {} coordinates, {} colour values and {} scalars",
                           part.points.size(), part.colors.size(), part.scalars.size());
  }
  if (!fits(part.smooth.size(), n) || !fits(part.texture.size(), n) ||
      part.uvs.size() != 2 * part.texture.size())
    return Status::Invalid(
        "a picture's part of {} points shares {} normals and has {} textures and {} coordinates", n,
        part.smooth.size(), part.texture.size(), part.uvs.size());
  for (const Index first : part.smooth) {
    if (first >= n) return Status::Invalid("a normal is shared with point {}, there are {} points", first, n);
  }
  for (const Index texture : part.texture) {
    if (texture != kNoIndex && texture >= part.textures.size())
      return Status::Invalid("a point is covered by texture {} of {}", texture, part.textures.size());
  }
  return {};
}

// What covers the part's triangles, from `first` on in the surface; nothing while no part had any.
void GatherTextures(const RenderPart& part, std::size_t base, std::size_t first, Surface* out) {
  const bool covered = !part.texture.empty() && part.scalars.empty();
  if (!covered && out->textures.empty()) return;
  out->textures.resize(first / 3, nullptr);
  out->uvs.resize(base, {0, 0});
  for (std::size_t t = first; t < out->triangles.size(); t += 3) {
    const Index texture = covered ? part.texture[out->triangles[t] - base] : kNoIndex;
    out->textures.push_back(texture == kNoIndex ? nullptr : &part.textures[texture]);
  }
  for (std::size_t i = 0; i < part.points.size() / 3; ++i)
    out->uvs.push_back(covered ? std::array{part.uvs[2 * i], part.uvs[2 * i + 1]} : std::array{0.0f, 0.0f});
}

// What the texture there says, of a sample of that size.
Double3 TexelColor(const Surface& surface, const RayHit& hit, const Index* corner,
                   const std::array<double, 3>& w, double size) {
  const SurfaceTexture& texture = *surface.textures[hit.triangle];
  const ConstPointsView p = surface.points.view();
  Double3 corners[3];
  double uvs[3][2], at[2] = {0, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    corners[k] = PointOf(p, corner[k]);
    for (std::size_t i = 0; i < 2; ++i) {
      uvs[k][i] = double{surface.uvs[corner[k]][i]};
      at[i] += uvs[k][i] * w[k];
    }
  }
  return texture.At(at[0], at[1], TexelsOf(texture, corners, uvs, size));
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

Result<Surface> GatherSurface(const RenderInput& input) {
  Surface out;
  std::size_t count = 0;
  for (const RenderPart& part : input.parts) {
    KPSA_RETURN_IF_ERROR(CheckPart(part));
    count += part.points.size() / 3;
  }
  out.points = PointBuffer(count);
  const PointsView p = out.points.view();
  std::size_t base = 0;
  for (const RenderPart& part : input.parts) {
    const std::size_t n = part.points.size() / 3;
    for (std::size_t i = 0; i < n; ++i) {
      p.x[base + i] = part.points[3 * i];
      p.y[base + i] = part.points[3 * i + 1];
      p.z[base + i] = part.points[3 * i + 2];
      Double3 color = part.color;
      if (!part.colors.empty()) color = {part.colors[3 * i], part.colors[3 * i + 1], part.colors[3 * i + 2]};
      if (!part.scalars.empty()) color = LinearFromRgb(TurboColor(part.scalars[i] / input.scalar_max));
      out.colors.push_back(color);
      out.matte.push_back(part.scalars.empty() ? 0 : 1);
      out.shares.push_back(static_cast<Index>(base + (part.smooth.empty() ? i : part.smooth[i])));
    }
    const auto first = static_cast<std::ptrdiff_t>(out.triangles.size());
    for (Index index : part.triangles) {
      if (index >= n) return Status::Invalid("a triangle names point {}, there are {} points", index, n);
      out.triangles.push_back(static_cast<Index>(base) + index);
    }
    out.triangles.resize(out.triangles.size() / 3 * 3);
    GatherTextures(part, base, static_cast<std::size_t>(first), &out);
    base += n;
    if (part.casts_shadows)
      out.casting.insert(out.casting.end(), out.triangles.begin() + first, out.triangles.end());
  }
  out.normals.resize(count);
  for (std::size_t t = 0; t < out.triangles.size(); t += 3) {
    const Index a = out.triangles[t], b = out.triangles[t + 1], c = out.triangles[t + 2];
    const Double3 n = Cross(PointOf(p, b) - PointOf(p, a), PointOf(p, c) - PointOf(p, a));
    for (Index i : {a, b, c}) out.normals[out.shares[i]] = out.normals[out.shares[i]] + n;
  }
  for (Double3& n : out.normals) n = UnitVector(n);
  for (std::size_t i = 0; i < count; ++i) out.normals[i] = out.normals[out.shares[i]];
  return out;
}

double Diagonal(const RenderInput& input, Double3* center) {
  Double3 low = {1e30, 1e30, 1e30}, high = {-1e30, -1e30, -1e30};
  for (const RenderPart& part : input.parts) {
    for (std::size_t i = 0; i < part.points.size(); ++i) {
      const int axis = static_cast<int>(i % 3);
      low[axis] = std::min(low[axis], static_cast<double>(part.points[i]));
      high[axis] = std::max(high[axis], static_cast<double>(part.points[i]));
    }
  }
  if (low.x > high.x) low = high = {0, 0, 0};
  *center = (low + high) * 0.5;
  return Length(high - low);
}

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
