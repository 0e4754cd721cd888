// Inside wrap only: what binding (wrap.cpp, driver_frames.cpp) and running (driver_frames_run.cpp, wrap_run.cpp)
// share. Floats, four a point or a direction (x y z and a spare lane).
#pragma once

#include <cstddef>

#include "base/points.h"

namespace kpsa::engine {

inline constexpr std::size_t kWrapBlock = 64;  // ranges of points begin at multiples of this
// Three columns and the normal; the spare lanes of the columns hold the driver point's x, y and z. Without a
// frame all but these are 0.
inline constexpr std::size_t kFrameFloats = 16;

// The frames of driver points (driver_frames.h), by groups of four with equally long rings: what is of one spoke
// or of the points themselves lies together, four by four. Indices are entries of the driver times four.
struct FramesRun {
  const Index* first;         // by group: the first of its spokes, and the end
  const Index* own;           // by frame
  const Index* spokes;        // by spoke and frame
  const float* duals;         // beside them, 4 floats each
  const float* normal_duals;  // by frame, 4 floats each
};
inline constexpr std::size_t kFrameGroup = 4;

// Places of wrapped points, at rest or now, as rows of `row` floats.
struct WrapRun {
  const Index *offsets, *entries;  // influences: where their frame begins, or if points snap their place
  const float* shares;
  const float* directions;  // 6 rows: tangent and binormal at rest, divided by the shares with frames
  const float* rest;        // 13 rows: anchor, tangent, binormal, normal, and 1 where these exist
  const float* weights;     // a row; 0 for points that stay
  std::size_t row;
  float envelope;
  bool stretches;  // kSurface
};

void PackWrapDriver(ConstPointsView points, std::size_t begin, std::size_t end, float* driver) noexcept;
// driver: in_points as x y z 0. frames: kFrameFloats each, of the groups [begin, end).
void RunDriverFrames(const FramesRun& run, const float* driver, std::size_t begin, std::size_t end,
                     float* frames) noexcept;
// The 13 rows of these points; `run` without rest and weights.
void FindWrapPlaces(const WrapRun& run, const float* frames, std::size_t begin, std::size_t end,
                    float* places) noexcept;
void RunWrap(const WrapRun& run, const float* frames, ConstPointsView in, PointsView out, std::size_t begin,
             std::size_t end) noexcept;
// kSnap.
void RunSnap(const WrapRun& run, const float* driver, ConstPointsView in, PointsView out, std::size_t begin,
             std::size_t end) noexcept;

}  // namespace kpsa::engine
