// Inside wrap only: what binding (wrap.cpp, driver_frames.cpp) and running (wrap_run.cpp) share. Floats, four
// a point or a direction (x y z and a spare lane).
#pragma once

#include <cstddef>

#include "base/points.h"

namespace kpsa::engine {

inline constexpr std::size_t kWrapBlock = 64;    // ranges of points begin at multiples of this
inline constexpr std::size_t kFrameFloats = 16;  // three columns and the normal

// The frames of driver points (driver_frames.h).
struct FramesRun {
  const Index *own, *edge_offsets, *triangle_offsets;  // by frame
  const Index* edge_points;
  const float* duals;         // by edge
  const Index* around;        // triangles around the point
  const float* normal_duals;  // by frame
};

// Places of wrapped points, at rest or now, as rows of `row` floats.
struct WrapRun {
  const Index *offsets, *entries, *frame_of;  // influences; frame_of: kNoIndex: none
  const float* shares;
  const float* directions;  // 8 a point: tangent and binormal at rest, divided by the shares with frames
  const float* rest;        // 13 rows: anchor, tangent, binormal, normal, and 1 where these exist
  const float* weights;     // a row; 0 for points that stay
  std::size_t row;
  float envelope;
  bool snaps, stretches;  // kSnap, kSurface
};

// driver: in_points as x y z 0. triangles: 3 points each; normals: 4 floats each, twice the area long.
void RunTriangleNormals(const Index* triangles, const float* driver, std::size_t begin, std::size_t end,
                        float* normals) noexcept;
// frames: kFrameFloats each.
void RunDriverFrames(const FramesRun& run, const float* driver, const float* normals, std::size_t begin,
                     std::size_t end, float* frames) noexcept;
// The 13 rows of these points; `run` without rest and weights.
void FindWrapPlaces(const WrapRun& run, const float* driver, const float* frames, std::size_t begin,
                    std::size_t end, float* places) noexcept;
void RunWrap(const WrapRun& run, const float* driver, const float* frames, ConstPointsView in, PointsView out,
             std::size_t begin, std::size_t end) noexcept;

}  // namespace kpsa::engine
