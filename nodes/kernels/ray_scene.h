// Rays against triangles: what pictures and light after bounces need.
//
// Embree's own triangles (base/embree.h), in floats. Every ray is answered on its own (no packets whose lanes
// could influence each other), and edges are watertight (robust mode), so that the answers depend neither on
// the number of threads nor on how rays are grouped into calls.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/points.h"
#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

// The part of the line origin + t * direction with near <= t <= far. direction need not be unit length; t
// counts in its lengths.
struct Ray {
  float origin[3] = {0, 0, 0};
  float direction[3] = {0, 0, 1};
  float near = 0;
  float far = 1e30f;
};

// Where a ray meets a triangle: the point is (1 - u - v) * p0 + u * p1 + v * p2.
struct RayHit {
  Index triangle = kNoIndex;  // kNoIndex: nothing was hit, and the other members mean nothing
  float t = 0;
  float u = 0;
  float v = 0;
};

// A search structure over a copy of the triangles. Movable; queries may run on any threads at once.
class RayScene {
 public:
  // points: positions of any unit. triangles: three indices into points each.
  // Errors: the number of indices is no multiple of 3; an index is out of range; a point is not finite.
  // A scene without triangles is valid: every ray misses.
  static Result<RayScene> Build(ConstPointsView points, std::span<const Index> triangles);

  // Moves the points, as many as there were. The structure keeps the layout that it was built with, and its
  // boxes are fitted to where the points are now: what rays meet does not depend on where the points have
  // been. (Rays through shared edges meet the triangle that the layout has first, so scenes that are to agree
  // bit for bit are built of the same points.) Allocates nothing of its own. Not while queries run.
  // Errors: a point is not finite.
  Status Update(ConstPointsView points);

  // hits[i] = the nearest hit of rays[i]. The spans have equal lengths.
  void ClosestHits(std::span<const Ray> rays, std::span<RayHit> hits) const;

  // occluded[i] = 1 if anything lies on rays[i], else 0. The spans have equal lengths.
  void Occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;

  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;
  ~RayScene();

 private:
  struct Impl;
  explicit RayScene(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kpsa::engine
