#include "picture/picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/check.h"
#include "base/parallel.h"
#include "base/points.h"
#include "base/scalar_math.h"
#include "nodes/kernels/ray_scene.h"

namespace kpsa::engine {
namespace {

constexpr int kSkyRays = 64;           // ambient occlusion rays a point
constexpr int kLightRays = 12;         // shadow rays a point towards the key light's disc
constexpr double kLightRadius = 0.22;  // of the key light's disc at distance 1
constexpr int kLargestSide = 8192;
constexpr double kDotRadius = 0.006;  // of a dot, in diagonals of the shape

Double3 UnitVector(Double3 v) {
  const double length = Length(v);
  return length > 0 ? v * (1 / length) : Double3{0, 0, 1};
}

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

// Both directions of sRGB's curve by roots and powers alone, good to half a byte (I. Taylor, "sRGB
// approximations").
std::uint8_t SrgbByte(double linear) {
  const double s1 = std::sqrt(std::clamp(linear, 0.0, 1.0)), s2 = std::sqrt(s1), s3 = std::sqrt(s2);
  const double encoded = linear <= 0.0031308
                             ? 12.92 * linear
                             : 0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * linear;
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(encoded, 0.0, 1.0)));
}

double LinearFromSrgb(std::uint8_t byte) {
  const double s = byte / 255.0;
  return s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878);
}

Double3 LinearFromRgb(Rgb c) { return {LinearFromSrgb(c[0]), LinearFromSrgb(c[1]), LinearFromSrgb(c[2])}; }

// All parts in one, and what a pixel interpolates of each point.
struct Surface {
  PointBuffer points;
  std::vector<Index> triangles;
  std::vector<Index> casting;       // of these, the ones that cast shadows
  std::vector<Double3> normals;     // unit, area-weighted
  std::vector<Double3> colors;      // linear
  std::vector<float> sky;           // 0 .. 1, share of the sky seen
  std::vector<float> key;           // 0 .. 1, share of the key light seen
  std::vector<std::uint8_t> matte;  // 1: heat map, without highlights
};

Double3 PointOf(ConstPointsView p, std::size_t i) { return {p.x[i], p.y[i], p.z[i]}; }

Result<Surface> Gather(const RenderInput& input) {
  Surface out;
  std::size_t count = 0;
  for (const RenderPart& part : input.parts) {
    const std::size_t n = part.points.size() / 3;
    if (part.points.size() % 3 != 0 || (!part.colors.empty() && part.colors.size() != 3 * n) ||
        (!part.scalars.empty() && part.scalars.size() != n)) {
      return Status::Invalid("a picture's part has {} coordinates, {} colour values and {} scalars",
                             part.points.size(), part.colors.size(), part.scalars.size());
    }
    count += n;
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
    }
    const auto first = static_cast<std::ptrdiff_t>(out.triangles.size());
    for (Index index : part.triangles) {
      if (index >= n) return Status::Invalid("a triangle names point {}, there are {} points", index, n);
      out.triangles.push_back(static_cast<Index>(base) + index);
    }
    base += n;
    out.triangles.resize(out.triangles.size() / 3 * 3);
    if (part.casts_shadows)
      out.casting.insert(out.casting.end(), out.triangles.begin() + first, out.triangles.end());
  }
  out.normals.resize(count);
  for (std::size_t t = 0; t < out.triangles.size(); t += 3) {
    const Index a = out.triangles[t], b = out.triangles[t + 1], c = out.triangles[t + 2];
    const Double3 n = Cross(PointOf(p, b) - PointOf(p, a), PointOf(p, c) - PointOf(p, a));
    for (Index i : {a, b, c}) out.normals[i] = out.normals[i] + n;
  }
  for (Double3& n : out.normals) n = UnitVector(n);
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

// The light that reaches every point: from the sky (within reach) and from the key light's disc.
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
}

struct Lights {
  Double3 key, fill, rim;  // unit, towards the light
};

Double3 Shade(const Surface& surface, const RayHit& hit, Double3 view, const Lights& lights) {
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
  Result<Surface> surface = Gather(input);
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

std::vector<float> PointDistances(std::span<const float> a, std::span<const float> b) {
  KPSA_CHECK_EQ(a.size(), b.size());
  std::vector<float> out(a.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Double3 d = {double{a[3 * i]} - b[3 * i], double{a[3 * i + 1]} - b[3 * i + 1],
                       double{a[3 * i + 2]} - b[3 * i + 2]};
    out[i] = static_cast<float>(Length(d));
  }
  return out;
}

RenderPart MakeDots(const RenderDots& dots, double radius) {
  struct Balls {
    std::vector<float> points;
    std::vector<Index> triangles;
  };
  // An octahedron, every edge halved and blown up: corners 0 .. 5, then the middles of the edges
  constexpr int kCorners[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<Double3> ball;
  for (const auto& c : kCorners)
    ball.push_back({static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])});
  std::vector<Index> sides;
  const auto middle = [&](Index a, Index b) {
    const Double3 m = UnitVector(ball[a] + ball[b]);
    for (Index i = 6; i < ball.size(); ++i) {
      if (Length(ball[i] - m) < 1e-9) return i;
    }
    ball.push_back(m);
    return static_cast<Index>(ball.size() - 1);
  };
  for (Index x : {0u, 1u}) {
    for (Index y : {2u, 3u}) {
      for (Index z : {4u, 5u}) {
        const bool outwards = (x + y + z) % 2 == 0;
        const Index a = x, b = outwards ? y : z, c = outwards ? z : y;
        const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        for (Index corner : {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca}) sides.push_back(corner);
      }
    }
  }
  auto balls = std::make_shared<Balls>();
  for (std::size_t d = 0; d + 2 < dots.points.size(); d += 3) {
    const auto first = static_cast<Index>(balls->points.size() / 3);
    for (const Double3& p : ball) {
      for (int k = 0; k < 3; ++k)
        balls->points.push_back(dots.points[d + static_cast<std::size_t>(k)] +
                                static_cast<float>(radius * p[k]));
    }
    for (Index corner : sides) balls->triangles.push_back(first + corner);
  }
  RenderPart part;
  part.points = balls->points, part.triangles = balls->triangles;
  part.color = {0.85, 0.03, 0.02};
  part.casts_shadows =
      false;  // light is known at points alone: a ball on a large triangle would darken all of it
  part.owner = balls;
  return part;
}

Result<Image> RenderComparison(const RenderInput& full, const RenderInput& accelerated, const Camera& camera,
                               const RenderOptions& options, const RenderDots* dots,
                               const std::string& title) {
  if (full.parts.size() != accelerated.parts.size()) {
    return Status::Usage("{} parts cannot be compared with {}", full.parts.size(), accelerated.parts.size());
  }
  std::vector<std::vector<float>> distances(full.parts.size());
  RenderInput heat = full;
  float largest = 0;
  for (std::size_t i = 0; i < full.parts.size(); ++i) {
    if (full.parts[i].points.size() != accelerated.parts[i].points.size()) {
      return Status::Usage("part {} has {} coordinates in one pose and {} in the other", i,
                           full.parts[i].points.size(), accelerated.parts[i].points.size());
    }
    distances[i] = PointDistances(full.parts[i].points, accelerated.parts[i].points);
    for (float d : distances[i]) largest = std::max(largest, d);
    heat.parts[i].scalars = distances[i];
  }
  RenderInput dotted;
  std::vector<std::pair<const RenderInput*, std::string>> panels = {
      {&full, "full"}, {&accelerated, title}, {&heat, "error " + Millimetres(largest) + " max"}};
  if (dots != nullptr) {
    dotted = full;
    Double3 center;
    dotted.parts.push_back(MakeDots(*dots, kDotRadius * Diagonal(full, &center)));
    panels.insert(panels.begin() + 1, {&dotted, dots->title});
  }
  std::vector<Image> images;
  for (const auto& [input, caption] : panels) {
    Result<Image> image = RenderMesh(*input, camera, options);
    if (!image.ok()) return image.status();
    images.push_back(std::move(*image));
    DrawTitle(images.back(), caption);
  }
  DrawLegend(images.back(), full.scalar_max);
  return SideBySide(images);
}

}  // namespace kpsa::engine
