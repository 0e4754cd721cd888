#include "base/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/check.h"

namespace kpsa {
namespace {

constexpr Index kLeaf = 4;  // triangles
constexpr int kMaxDepth = 40;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

// What rounding may make of squared distances: boxes are left out only beyond it.
double Slack(double squared, double scale) { return squared * (1 + 1e-9) + 1e-20 * scale * scale; }

double BoxSquared(const float* box, Double3 p) {
  double sum = 0;
  for (int a = 0; a < 3; ++a) {
    const double below = box[a] - p[a], above = p[a] - box[3 + a];
    const double out = below > 0 ? below : above > 0 ? above : 0;
    sum += out * out;
  }
  return box[0] <= box[3] ? sum : kInfinity;
}

// Of a box and a place, for the rounding between them: its own, so that one far triangle costs the others
// nothing.
double Scale(const float* box, Double3 p) {
  double scale = 0;
  for (int a = 0; a < 3; ++a)
    scale = std::max({scale, std::fabs(double{box[a]}), std::fabs(double{box[3 + a]}), std::fabs(p[a])});
  return scale;
}

// The squared distance to the box of node `n`, or infinity beyond `limit`, squared as well.
double BoxWithin(std::span<const float> boxes, Index n, Double3 place, double limit) {
  const float* box = boxes.data() + 6 * std::size_t{n};
  const double squared = BoxSquared(box, place);
  return squared <= Slack(limit, Scale(box, place)) ? squared : kInfinity;
}

bool IsFinite(Double3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

bool Less(const SurfacePoint& a, const SurfacePoint& b) {
  return a.squared < b.squared || (a.squared == b.squared && a.triangle < b.triangle);
}

// Where the line enters the box, or infinity; a little too early rather than too late.
double BoxEntry(const float* box, Double3 origin, Double3 direction, double margin) {
  double enter = 0, leave = kInfinity;
  for (int a = 0; a < 3; ++a) {
    const double lo = box[a] - margin, hi = box[3 + a] + margin;
    if (!(lo <= hi)) return kInfinity;
    if (direction[a] == 0) {
      if (origin[a] < lo || origin[a] > hi) return kInfinity;
      continue;
    }
    double t0 = (lo - origin[a]) / direction[a], t1 = (hi - origin[a]) / direction[a];
    if (t0 > t1) std::swap(t0, t1);
    enter = std::max(enter, t0);
    leave = std::min(leave, t1);
  }
  return enter <= leave ? enter : kInfinity;
}

}  // namespace

SurfacePoint ClosestOnTriangle(ConstPointsView points, const Index corners[3], Double3 place) {
  SurfacePoint best;
  const Double3 a = At(points, corners[0]), b = At(points, corners[1]), c = At(points, corners[2]);
  const Double3 normal = Cross(b - a, c - a);
  const double square = Dot(normal, normal);
  if (square > 0 && std::isfinite(square)) {
    const double u = Dot(normal, Cross(c - b, place - b)), v = Dot(normal, Cross(a - c, place - c)),
                 w = Dot(normal, Cross(b - a, place - a));
    if (u > 0 && v > 0 && w > 0) {  // above the inside
      const double sum = u + v + w;
      best.weights[0] = u / sum, best.weights[1] = v / sum, best.weights[2] = w / sum;
      best.point = a * best.weights[0] + b * best.weights[1] + c * best.weights[2];
      const Double3 offset = place - best.point;
      best.squared = Dot(offset, offset);
      return best;
    }
  }
  for (int k = 0; k < 3; ++k) ClosestOnSegment(points, corners, k, (k + 1) % 3, place, &best);
  return best;
}

TriangleTree::TriangleTree(ConstPointsView points, std::span<const Index> triangles)
    : triangles_(triangles.begin(), triangles.end()) {
  KPSA_CHECK_EQ(triangles.size() % 3, 0u);
  const auto count = static_cast<Index>(triangles.size() / 3);
  std::vector<std::array<float, 3>> centers(count);
  for (Index t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index i = triangles[3 * t + k];
      KPSA_CHECK_LT(i, points.count);
      const float place[3] = {points.x[i], points.y[i], points.z[i]};
      for (std::size_t a = 0; a < 3; ++a) centers[t][a] += std::isfinite(place[a]) ? place[a] / 3 : 0;
    }
    order_.push_back(t);
  }
  if (count == 0) return;
  // Halves along the widest axis until few are left; the first child follows its parent
  struct Range {
    Index first, count, parent;
  };
  std::vector<Range> open = {{0, count, kNoIndex}};
  while (!open.empty()) {
    const Range range = open.back();
    open.pop_back();
    const auto self = static_cast<Index>(nodes_.size());
    if (range.parent != kNoIndex) nodes_[range.parent].right = self;
    nodes_.push_back({});
    const auto begin = order_.begin() + range.first, end = begin + range.count;
    nodes_[self].least = *std::min_element(begin, end);
    if (range.count <= kLeaf) {
      nodes_[self].first = range.first;
      nodes_[self].count = range.count;
      continue;
    }
    std::array<float, 3> lo = centers[*begin], hi = lo;
    for (auto it = begin; it != end; ++it) {
      for (std::size_t a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], centers[*it][a]);
        hi[a] = std::max(hi[a], centers[*it][a]);
      }
    }
    std::size_t axis = 0;
    for (std::size_t a = 1; a < 3; ++a) {
      if (hi[a] - lo[a] > hi[axis] - lo[axis]) axis = a;
    }
    const Index half = range.count / 2;
    std::nth_element(begin, begin + half, end, [&](Index a, Index b) {
      return centers[a][axis] < centers[b][axis] || (centers[a][axis] == centers[b][axis] && a < b);
    });
    open.push_back({range.first + half, range.count - half, self});
    open.push_back({range.first, half, kNoIndex});
  }
}

void TriangleTree::Fit(ConstPointsView points, std::span<float> boxes) const {
  KPSA_CHECK_LE(BoxFloats(), boxes.size());
  constexpr float kFar = std::numeric_limits<float>::infinity();
  for (std::size_t n = nodes_.size(); n-- > 0;) {  // children before their parents
    const Node& node = nodes_[n];
    float* box = boxes.data() + 6 * n;
    for (std::size_t a = 0; a < 3; ++a) box[a] = kFar, box[3 + a] = -kFar;
    if (node.count == 0) {
      for (const std::size_t child : {n + 1, std::size_t{node.right}}) {
        const float* other = boxes.data() + 6 * child;
        for (std::size_t a = 0; a < 3; ++a) {
          box[a] = std::min(box[a], other[a]);
          box[3 + a] = std::max(box[3 + a], other[3 + a]);
        }
      }
      continue;
    }
    for (Index e = node.first; e < node.first + node.count; ++e) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Index i = triangles_[3 * std::size_t{order_[e]} + k];
        const float place[3] = {points.x[i], points.y[i], points.z[i]};
        if (!std::isfinite(place[0]) || !std::isfinite(place[1]) || !std::isfinite(place[2])) continue;
        for (std::size_t a = 0; a < 3; ++a) {
          box[a] = std::min(box[a], place[a]);
          box[3 + a] = std::max(box[3 + a], place[a]);
        }
      }
    }
  }
}

// Depth first, the nearer child first: near(node) is its distance (or what else children go by), or infinity
// to leave it out (asked again when its turn comes); visit(triangle).
template <typename Near, typename Visit>
void TriangleTree::Walk(Near near, Visit visit) const {
  if (nodes_.empty()) return;
  std::array<Index, kMaxDepth> open;
  std::size_t depth = 0;
  open[depth++] = 0;
  while (depth > 0) {
    const Index n = open[--depth];
    if (near(n) == kInfinity) continue;
    const Node& node = nodes_[n];
    if (node.count > 0) {
      for (Index e = node.first; e < node.first + node.count; ++e) visit(order_[e]);
      continue;
    }
    const bool left_first = near(n + 1) <= near(node.right);
    KPSA_CHECK_LE(depth + 2, open.size());
    open[depth++] = left_first ? node.right : n + 1;
    open[depth++] = left_first ? n + 1 : node.right;
  }
}

SurfacePoint TriangleTree::Closest(ConstPointsView points, std::span<const float> boxes, Double3 place,
                                   double max_distance) const {
  SurfacePoint best;
  const double limit = max_distance * max_distance;
  if (!IsFinite(place) || std::isnan(limit)) return best;
  const auto near = [&](Index n) { return BoxWithin(boxes, n, place, std::min(best.squared, limit)); };
  Walk(near, [&](Index t) {
    SurfacePoint found = ClosestOnTriangle(points, &triangles_[3 * std::size_t{t}], place);
    found.triangle = t;
    if (found.squared <= limit && found.squared < kInfinity && Less(found, best)) best = found;
  });
  return best;
}

SurfacePoint TriangleTree::Lowest(ConstPointsView points, std::span<const float> boxes, Double3 place,
                                  double max_distance) const {
  SurfacePoint best;
  const double limit = max_distance * max_distance;
  if (!IsFinite(place) || std::isnan(limit)) return best;
  const auto lowest = [&](Index n) {
    const double least = nodes_[n].least;
    return least < best.triangle && BoxWithin(boxes, n, place, limit) < kInfinity ? least : kInfinity;
  };
  Walk(lowest, [&](Index t) {
    if (t >= best.triangle) return;
    SurfacePoint found = ClosestOnTriangle(points, &triangles_[3 * std::size_t{t}], place);
    found.triangle = t;
    if (found.squared <= limit && found.squared < kInfinity) best = found;
  });
  return best;
}

void TriangleTree::ClosestSeveral(ConstPointsView points, std::span<const float> boxes, Double3 place,
                                  std::size_t count, double max_distance,
                                  std::vector<SurfacePoint>* found) const {
  found->clear();
  const double limit = max_distance * max_distance;
  if (count == 0 || !IsFinite(place) || std::isnan(limit)) return;
  const auto near = [&](Index n) {
    return BoxWithin(boxes, n, place, found->size() < count ? limit : found->back().squared);
  };
  Walk(near, [&](Index t) {
    SurfacePoint one = ClosestOnTriangle(points, &triangles_[3 * std::size_t{t}], place);
    one.triangle = t;
    if (!(one.squared <= limit && one.squared < kInfinity)) return;
    found->insert(std::upper_bound(found->begin(), found->end(), one, Less), one);
    if (found->size() > count) found->pop_back();
  });
}

LineHit TriangleTree::FirstHit(ConstPointsView points, std::span<const float> boxes, Double3 origin,
                               Double3 direction) const {
  LineHit best;
  if (!IsFinite(origin) || !IsFinite(direction)) return best;
  const auto near = [&](Index n) {
    const float* box = boxes.data() + 6 * std::size_t{n};
    const double t = BoxEntry(box, origin, direction, 1e-9 * Scale(box, origin));
    return t <= best.t ? t : kInfinity;
  };
  constexpr double kEdge = 1e-9;  // lines through an edge miss none of its triangles
  Walk(near, [&](Index t) {
    const Index* corner = &triangles_[3 * std::size_t{t}];
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
  });
  return best;
}

}  // namespace kpsa
