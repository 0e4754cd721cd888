#include "base/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "base/embree.h"

namespace kpsa::engine {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kFew = 8;  // triangles: they are looked at one by one
constexpr float kFar = 1e18f;    // Embree takes no larger coordinates
// What rounding to floats may do, on Embree's side too, of the largest coordinate: 16 steps
constexpr double kRounding = 2e-6;
// Where a triangle is clearly farther off than a place that is known, of squared distances: so much more, and so much of its
// own size and distance; and the squared sine of an angle that is wide enough to tell
constexpr double kClearly = 1e-9, kRounded = 1e-20, kSlender = 1e-9;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr float kLeastMargin = 1e-30f;  // Embree may take smaller numbers for 0

Double3 At(ConstPointsView points, Index i) { return {points.x[i], points.y[i], points.z[i]}; }

// The nearest place of a segment; the same bits whichever end comes first.
void ClosestOnSegment(ConstPointsView points, const Index corners[3], int from, int to, Double3 place,
                      SurfacePoint* best) {
  if (corners[from] > corners[to]) std::swap(from, to);
  const Double3 a = At(points, corners[from]), b = At(points, corners[to]), along = b - a;
  const double square = Dot(along, along), shadow = Dot(place - a, along);
  double t = square > 0 ? shadow / square : 0;
  if (!(t > 0)) t = 0;
  if (t > 1) t = 1;
  const Double3 point = t == 1 ? b : a + along * t, offset = place - point;
  const double squared = Dot(offset, offset);
  if (!(squared < best->squared)) return;
  best->squared = squared;
  best->point = point;
  best->weights[0] = best->weights[1] = best->weights[2] = 0;
  best->weights[from] = 1 - t;
  best->weights[to] += t;
}

bool IsFinite(Double3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

double Largest(Double3 v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

// A place outside of the cube that Embree knows is seen from the cube's surface: no distance grows by that.
float Clamped(double x) { return static_cast<float>(std::clamp(x, double{-kFar}, double{kFar})); }

bool Less(const SurfacePoint& a, const SurfacePoint& b) {
  return a.squared < b.squared || (a.squared == b.squared && a.triangle < b.triangle);
}

// What a line has met so far. Embree hands the context to the triangles: it comes first.
struct Line {
  RTCIntersectContext context;
  ConstPointsView points;
  const Index* triangles;
  Double3 origin, direction;
  double origin_along = 0, lengths = 1;  // t is at origin_along + t * lengths of the ray
  bool shrinks = false;                  // what lies behind the best hit does not count
  LineHit best;

  double Along(double t) const { return origin_along + t * lengths; }
  void Meet(Index t) {
    constexpr double kEdge = 1e-9;  // lines through an edge miss none of its triangles
    const Index* corner = &triangles[3 * std::size_t{t}];
    const Double3 a = At(points, corner[0]), e1 = At(points, corner[1]) - a, e2 = At(points, corner[2]) - a;
    const Double3 p = Cross(direction, e2), s = origin - a, q = Cross(s, e1);
    const double det = Dot(e1, p);
    if (!(std::fabs(det) > 1e-12 * Length(direction) * Length(e1) * Length(e2))) return;
    double v = Dot(s, p) / det, w = Dot(direction, q) / det, at = Dot(e2, q) / det;
    if (!(v >= -kEdge && w >= -kEdge && v + w <= 1 + kEdge && at >= 0)) return;
    if (at > best.t || (at == best.t && t > best.triangle)) return;
    v = std::clamp(v, 0.0, 1.0);
    w = std::clamp(w, 0.0, 1 - v);
    best = {t, {1 - v - w, v, w}, at};
  }
};

// How far a ray has to be followed, with what rounding makes of it.
float Reach(double along) {
  const double reach = along * (1 + kRounding) + 1e-18;
  return reach < kFar ? static_cast<float>(reach) : std::numeric_limits<float>::infinity();
}

// ClosestOnTriangle; or nothing, where the triangle is clearly farther off than the bound. Squared.
SurfacePoint ClosestWithin(ConstPointsView points, const Index corners[3], Double3 place, double bound) {
  SurfacePoint best;
  const Double3 a = At(points, corners[0]), b = At(points, corners[1]), c = At(points, corners[2]);
  const Double3 side[3] = {b - a, c - b, a - c}, normal = Cross(side[0], c - a);
  const double square = Dot(normal, normal);
  bool asked[3] = {true, true, true};
  if (square > 0 && std::isfinite(square)) {
    // How far inside of each side, times its length and the normal's
    const double inside[3] = {Dot(normal, Cross(side[0], place - a)), Dot(normal, Cross(side[1], place - b)),
                              Dot(normal, Cross(side[2], place - c))};
    if (inside[0] > 0 && inside[1] > 0 && inside[2] > 0) {
      const double u = inside[1], v = inside[2], w = inside[0], sum = u + v + w;
      best.weights[0] = u / sum, best.weights[1] = v / sum, best.weights[2] = w / sum;
      best.point = a * best.weights[0] + b * best.weights[1] + c * best.weights[2];
      const Double3 offset = place - best.point;
      best.squared = Dot(offset, offset);
      return best;
    }
    // The nearest place lies on a side that the place is outside of
    const double length[3] = {Dot(side[0], side[0]), Dot(side[1], side[1]), Dot(side[2], side[2])},
                 height = Dot(normal, place - a), slender = kSlender * length[0] * length[2],
                 rounded = kRounded * (Dot(place - a, place - a) + length[0] + length[2]);
    for (int k = 0; k < 3 && square > slender; ++k) {
      const double across = inside[k] * inside[k], scale = square * length[k];
      if (inside[k] > 0) {
        asked[k] = !(across > (kClearly * length[k] + rounded) * scale);
      } else if (height * height * length[k] + across > ((1 + kClearly) * bound + rounded) * scale) {
        return best;
      }
    }
  }
  for (int k = 0; k < 3; ++k) {
    if (asked[k]) ClosestOnSegment(points, corners, k, (k + 1) % 3, place, &best);
  }
  return best;
}

}  // namespace

SurfacePoint ClosestOnTriangle(ConstPointsView points, const Index corners[3], Double3 place) {
  return ClosestWithin(points, corners, place, kInfinity);
}

struct TriangleTree::Impl {
  using Row = std::array<float, 4>;  // x, y, z

  PointBuffer points;
  std::vector<Row> places;  // the same within the cube that Embree knows; no numbers where one is not finite
  std::vector<Index> triangles;
  bool beyond = false;             // a point lies outside of the cube that Embree knows
  RTCGeometry geometry = nullptr;  // the scene's
  EmbreeScene scene;               // null, of few triangles or without memory: all are looked at

  std::size_t count() const { return triangles.size() / 3; }
  ConstPointsView view() const { return points.view(); }
  void CopyIn(ConstPointsView from);
  void Build();
  void Refit();

  // All triangles that may be nearer to the place than the limit, which visit(triangle) gives anew. Squared.
  template <typename Visit>
  void ForNear(Double3 place, double limit, Visit visit) const;
  struct Box {
    Row lo, hi;
  };
  Box BoxOf(Index triangle) const;  // of its finite corners; without any, lo is above hi
  // No more than the distance of the place, which the margin rounds, from the box of the triangle's finite corners. Squared.
  float Apart(Index triangle, const Row& place, float margin) const;
  // Its nearest place; none (kNoIndex, infinitely far) beyond the limit. Squared.
  SurfacePoint On(Index triangle, Double3 place, double limit) const;
  void Follow(Line* line, Double3 start, Double3 direction, float near, float far) const;

  static void Bounds(const RTCBoundsFunctionArguments* args);
  static void Intersect(const RTCIntersectFunctionNArguments* args);
};

// The box of a triangle's finite corners, with a margin of what rounding makes of lines that pass by.
void TriangleTree::Impl::Bounds(const RTCBoundsFunctionArguments* args) {
  const Impl& tree = *static_cast<const Impl*>(args->geometryUserPtr);
  auto [lo, hi] = tree.BoxOf(args->primID);
  // Without a finite corner it has an empty box, that is in nobody's way; or, since Embree takes none of
  // those when it builds, one that is far away
  if (!(lo[0] <= hi[0])) {
    lo.fill(kFar), hi.fill(tree.scene == nullptr ? kFar : -kFar);
  } else {
    Row size;
    for (std::size_t k = 0; k < 4; ++k) size[k] = std::max(-lo[k], hi[k]);
    const float margin =
        std::max(kLeastMargin, static_cast<float>(kRounding) * std::max({size[0], size[1], size[2]}));
    for (std::size_t k = 0; k < 4; ++k) lo[k] -= margin, hi[k] += margin;
  }
  *args->bounds_o = {lo[0], lo[1], lo[2], 0, hi[0], hi[1], hi[2], 0};
}

void TriangleTree::Impl::Intersect(const RTCIntersectFunctionNArguments* args) {
  if (args->N != 1 || args->valid[0] == 0) return;
  Line& line = *reinterpret_cast<Line*>(args->context);
  line.Meet(args->primID);
  if (!line.shrinks || line.best.triangle == kNoIndex) return;
  RTCRay& ray = reinterpret_cast<RTCRayHit*>(args->rayhit)->ray;
  ray.tfar = std::min(ray.tfar, Reach(line.Along(line.best.t)));
}

void TriangleTree::Impl::CopyIn(ConstPointsView from) {
  CopyPoints(from, points.view());
  places.resize(from.count);
  beyond = false;
  for (std::size_t i = 0; i < from.count; ++i) {
    const float x = from.x[i], y = from.y[i], z = from.z[i];
    const Row place = {std::clamp(x, -kFar, kFar), std::clamp(y, -kFar, kFar), std::clamp(z, -kFar, kFar), 0};
    const bool finite = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
    places[i] = finite ? place : Row{kNone, kNone, kNone, kNone};
    beyond |= (std::isfinite(x) && place[0] != x) || (std::isfinite(y) && place[1] != y) ||
              (std::isfinite(z) && place[2] != z);
  }
}

TriangleTree::Impl::Box TriangleTree::Impl::BoxOf(Index triangle) const {
  Box box;
  box.lo.fill(kFar), box.hi.fill(-kFar);
  for (std::size_t k = 0; k < 3; ++k) {
    const Row& at = places[triangles[3 * std::size_t{triangle} + k]];
    for (std::size_t i = 0; i < 4; ++i) {  // what is no number is neither less nor more
      box.lo[i] = at[i] < box.lo[i] ? at[i] : box.lo[i];
      box.hi[i] = at[i] > box.hi[i] ? at[i] : box.hi[i];
    }
  }
  return box;
}

void TriangleTree::Impl::Build() {
  const RTCDevice device = count() > kFew ? EmbreeDevice() : nullptr;
  if (device == nullptr) return;
  geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(count()));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, &Bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, &Intersect);
  RTCError error = RTC_ERROR_NONE;
  scene = CommitEmbreeScene(geometry, &error);
}

void TriangleTree::Impl::Refit() {
  if (scene == nullptr) return Build();  // there may be memory now
  if (RefitEmbreeScene(scene, geometry) != RTC_ERROR_NONE) scene = nullptr;
}

template <typename Visit>
void TriangleTree::Impl::ForNear(Double3 place, double limit, Visit visit) const {
  if (!IsFinite(place) || std::isnan(limit)) return;
  if (scene == nullptr) {
    for (Index t = 0; t < count(); ++t) visit(t);
    return;
  }
  struct Search {
    const Impl* tree;
    Visit visit;
    double limit, rounding, reach = kInfinity;
    Row row;  // the place in floats, and what that may be off by
    float margin;
    void SetReach() { reach = std::sqrt(limit) * (1 + kRounding) + rounding; }
    float Radius() const {
      return reach < 4 * double{kFar} ? static_cast<float>(reach) : std::numeric_limits<float>::infinity();
    }
  };
  RTCPointQuery query = {Clamped(place.x), Clamped(place.y), Clamped(place.z), 0, 0};
  const float size = std::max({std::fabs(query.x), std::fabs(query.y), std::fabs(query.z)});
  Search search{.tree = this,
                .visit = visit,
                .limit = limit,
                .rounding = kRounding * double{size} + 1e-18,
                .row = {query.x, query.y, query.z, 0},
                .margin = static_cast<float>(kRounding) * size};
  search.SetReach();
  query.radius = search.Radius();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  const auto meet = [](RTCPointQueryFunctionArguments* args) {
    auto& at = *static_cast<Search*>(args->userPtr);
    // A leaf holds several triangles, and Embree looks at its box alone
    if (at.tree->Apart(args->primID, at.row, at.margin) > at.reach * at.reach) return false;
    const double now = at.visit(args->primID);
    if (!(now < at.limit)) return false;
    at.limit = now;
    at.SetReach();
    args->query->radius = at.Radius();
    return true;
  };
  rtcPointQuery(scene.get(), &query, &context, meet, &search);
}

float TriangleTree::Impl::Apart(Index triangle, const Row& place, float margin) const {
  const auto [lo, hi] = BoxOf(triangle);
  Row out;
  for (std::size_t k = 0; k < 4; ++k) {
    const float apart = std::max(lo[k] - place[k], place[k] - hi[k]) - margin;
    out[k] = apart > 0 ? apart * apart : 0;  // what is no number is neither below nor above
  }
  return (1 - 2 * static_cast<float>(kRounding)) * (out[0] + out[1] + out[2]);
}

SurfacePoint TriangleTree::Impl::On(Index triangle, Double3 place, double limit) const {
  SurfacePoint found = ClosestWithin(view(), &triangles[3 * std::size_t{triangle}], place, limit);
  if (!(found.squared <= limit && found.squared < kInfinity)) return {};
  found.triangle = triangle;
  return found;
}

void TriangleTree::Impl::Follow(Line* line, Double3 start, Double3 direction, float near, float far) const {
  rtcInitIntersectContext(&line->context);
  RTCRayHit query = {};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.ray.org_x = Clamped(start.x), query.ray.org_y = Clamped(start.y), query.ray.org_z = Clamped(start.z);
  query.ray.dir_x = static_cast<float>(direction.x);
  query.ray.dir_y = static_cast<float>(direction.y);
  query.ray.dir_z = static_cast<float>(direction.z);
  query.ray.tnear = near;
  query.ray.tfar = far;
  query.ray.mask = 0xffffffffu;
  rtcIntersect1(scene.get(), &line->context, &query);
}

TriangleTree::TriangleTree() = default;
TriangleTree::TriangleTree(TriangleTree&&) noexcept = default;
TriangleTree& TriangleTree::operator=(TriangleTree&&) noexcept = default;
TriangleTree::~TriangleTree() = default;

TriangleTree::TriangleTree(ConstPointsView points, std::span<const Index> triangles) {
  KPSA_CHECK_EQ(triangles.size() % 3, 0u);
  for (const Index i : triangles) KPSA_CHECK_LT(i, points.count);
  if (triangles.empty()) return;
  impl_ = std::make_unique<Impl>();
  impl_->points = PointBuffer(points.count);
  impl_->CopyIn(points);
  impl_->triangles.assign(triangles.begin(), triangles.end());
  impl_->Build();
}

std::span<const Index> TriangleTree::triangles() const {
  return impl_ == nullptr ? std::span<const Index>() : impl_->triangles;
}

ConstPointsView TriangleTree::points() const { return impl_ == nullptr ? ConstPointsView() : impl_->view(); }

void TriangleTree::Move(ConstPointsView points) {
  if (impl_ == nullptr) return;
  const ConstPointsView now = impl_->view();
  KPSA_CHECK_EQ(points.count, now.count);
  const std::size_t bytes = points.count * sizeof(float);
  if (std::memcmp(points.x, now.x, bytes) == 0 && std::memcmp(points.y, now.y, bytes) == 0 &&
      std::memcmp(points.z, now.z, bytes) == 0)
    return;
  impl_->CopyIn(points);
  impl_->Refit();
}

SurfacePoint TriangleTree::Closest(Double3 place, double max_distance, Index near) const {
  SurfacePoint best;
  if (impl_ == nullptr) return best;
  const double limit = max_distance * max_distance;
  if (near < impl_->count()) best = impl_->On(near, place, limit);
  impl_->ForNear(place, std::min(limit, best.squared), [&](Index t) {
    const SurfacePoint found = impl_->On(t, place, std::min(limit, best.squared));
    if (Less(found, best)) best = found;
    return best.squared;
  });
  return best;
}

SurfacePoint TriangleTree::Lowest(Double3 place, double max_distance) const {
  SurfacePoint best;
  if (impl_ == nullptr) return best;
  const double limit = max_distance * max_distance;
  impl_->ForNear(place, limit, [&](Index t) {
    if (t < best.triangle) {
      const SurfacePoint found = impl_->On(t, place, limit);
      if (found.triangle == t) best = found;
    }
    return limit;
  });
  return best;
}

void TriangleTree::ClosestSeveral(Double3 place, std::size_t count, double max_distance,
                                  std::vector<SurfacePoint>* found) const {
  found->clear();
  if (impl_ == nullptr || count == 0) return;
  const double limit = max_distance * max_distance;
  impl_->ForNear(place, limit, [&](Index t) {
    const SurfacePoint one = impl_->On(t, place, found->size() < count ? limit : found->back().squared);
    if (one.triangle != kNoIndex && (found->size() < count || Less(one, found->back()))) {
      if (found->size() == count) found->pop_back();
      found->insert(std::upper_bound(found->begin(), found->end(), one, Less), one);
    }
    return found->size() < count ? limit : found->back().squared;
  });
}

LineHit TriangleTree::FirstHit(Double3 origin, Double3 direction) const {
  const double size = Largest(direction);
  if (impl_ == nullptr || !IsFinite(origin) || !IsFinite(direction) || size == 0) return {};
  Line line{{}, impl_->view(), impl_->triangles.data(), origin, direction, 0, 1, false, {}};
  // Rays start where the line is nearest to the coordinates' origin, and go both ways. From there neither
  // their start nor their direction is rounded by more than the margin of what they meet
  Double3 unit{direction.x / size, direction.y / size, direction.z / size};
  line.lengths = size * Length(unit);
  unit = unit * (1 / Length(unit));
  line.origin_along = Dot(origin, unit);
  const Double3 middle = origin - unit * line.origin_along;
  const auto all = [&] {
    for (Index t = 0; t < impl_->count(); ++t) line.Meet(t);
  };
  if (impl_->scene == nullptr || !(Largest(middle) < kFar)) {
    all();
    return line.best;
  }
  // Backwards the nearest one comes last
  if (line.origin_along < 0) impl_->Follow(&line, middle, unit * -1, 0, Reach(-line.origin_along));
  line.shrinks = true;
  const double near = std::max(0.0, line.origin_along) * (1 - kRounding), far = line.Along(line.best.t);
  if (far >= 0 && near < kFar) impl_->Follow(&line, middle, unit, static_cast<float>(near), Reach(far));
  if (impl_->beyond && !(std::fabs(line.Along(line.best.t)) < kFar)) all();
  return line.best;
}

}  // namespace kpsa::engine
