// How far clips move the nodes of a character away from rest.
#pragma once

#include <algorithm>
#include <map>
#include <vector>

#include "gltf/import.h"

namespace kpsa::engine {

struct MotionRange {
  double min = 0, max = 0;  // rest, 0, is always inside
  void Add(double value) {
    min = std::min(min, value);
    max = std::max(max, value);
  }
  void Add(const MotionRange& other) {
    Add(other.min);
    Add(other.max);
  }
  double size() const { return std::max(-min, max); }
};

// What clips do to one glTF node, relative to its rest.
struct Motion {
  MotionRange rotate[3];  // degrees, as Euler angles in the rest pose's axes, X first, that follow the motion
  MotionRange translate[3];  // metres, in the rest pose's axes
  MotionRange scale[3];      // of the scale at rest, less 1
  std::vector<MotionRange> weights;
  void Add(const Motion& other);
};

using ClipMotion = std::map<Index, Motion>;  // by the glTF nodes that the clip animates
// At its keys and, where it goes beyond them in between (cubic splines, angles of a turn), 4 times a frame.
ClipMotion MeasureClip(const gltf::Character& character, const gltf::Clip& clip);

// The clip, of those that may be it, whose motion goes least beyond that of all others together: one to test
// on what extremes have taught. The first one of equals, or of more than kMostClipsCompared. `motions` and
// `may` are by clip; one may.
std::size_t TamestClip(const gltf::Character& character, const std::vector<ClipMotion>& motions,
                       const std::vector<bool>& may);
inline constexpr std::size_t kMostClipsCompared = 64;

}  // namespace kpsa::engine
