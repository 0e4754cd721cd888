// What an untouched character is made of, before it has points: bones, what they may do, the shape around
// them, and the clips that move them. Metres, radians, Y up, the character looks along +Z, its left is +X.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/scalar_math.h"
#include "base/types.h"
#include "kpsa/training/random.h"

namespace kpsa::engine::untouched {

// A joint at `at` whose X axis points to `tip`; turning about its Z axis, which is near `hinge`, bends it.
struct Bone {
  std::string name;
  int parent = -1;  // an earlier one
  Double3 at, tip;
  Double3 hinge = {1, 0, 0};
  double radius = 0.05;  // about that of the surface around it: its reach
};

// A set of motions that act together, such as those of an arm.
struct Group {
  double coherence = 0;  // how much of a pose all its motions have in common, 0 to 1
  double lag = 0;        // radians by which each bone of a chain follows the one before it, in cycles
};

enum class MotionKind : std::uint8_t { kTurn, kTravel, kMorph };
struct MotionRange {
  MotionKind kind = MotionKind::kTurn;
  std::size_t of = 0;        // bone or morph
  int axis = 0;              // of the bone; travel is along the world's axes, of a bone without a parent
  double low = 0, high = 0;  // radians, metres, weight
  std::size_t group = 0;
  int depth = 0;  // in its chain
};

// A closed surface: where its distance is 0. The distance is about that in metres, negative inside.
struct Part {
  std::function<double(Double3)> distance;
  Double3 low, high;       // a box around it
  double share = 1;        // of the character's points
  std::vector<int> bones;  // that may move it
};

// A smooth bump: points nearer to its centre than its radius move.
struct Morph {
  std::string name;
  Double3 center, move;
  double radius = 0.03;
};

// How a clip's curves are made. The first three are for training, the last for the test.
enum class Formula : std::uint8_t {
  kCycles,  // a base frequency and harmonics, in step with the others of the group
  kSines,   // three frequencies and phases of its own for every motion
  kEvents,  // some motions at a time go somewhere, stay and come back
  kMoves,   // minimum-jerk moves between random poses; what hangs farther out comes later and overshoots
};
struct ClipDesign {
  std::string name;
  Formula formula = Formula::kSines;
  std::vector<double> shares;  // by group: of its ranges; 0: it rests
};

struct Design {
  std::vector<Bone> bones;
  std::vector<Part> parts;
  std::vector<Morph> morphs;
  std::vector<Group> groups;
  std::vector<MotionRange> motions;
  std::vector<ClipDesign> clips;
  int weight_falloff = 4;  // weights go down with this power of the distance
  int weight_rounds = 4;   // of smoothing

  int AddBone(Bone bone) {
    bones.push_back(std::move(bone));
    return static_cast<int>(bones.size()) - 1;
  }
  void AddTurn(int bone, int axis, double low_degrees, double high_degrees, std::size_t group,
               int depth = 0) {
    motions.push_back({MotionKind::kTurn, static_cast<std::size_t>(bone), axis, low_degrees * kPi / 180,
                       high_degrees * kPi / 180, group, depth});
  }
};

// Between a and b.
inline double Between(Random& random, double a, double b) { return a + (b - a) * random.Unit(); }
// From a to b, both included.
inline int Count(Random& random, int a, int b) {
  return a + static_cast<int>(random.Below(static_cast<std::size_t>(b - a + 1)));
}

// A biped with fingers, a head with morph targets, and a creature of eight arms; others for other seeds.
Design DesignBody(std::uint64_t seed);
Design DesignHead(std::uint64_t seed);
Design DesignCreature(std::uint64_t seed);

}  // namespace kpsa::engine::untouched
