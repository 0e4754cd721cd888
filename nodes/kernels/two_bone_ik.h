// Analytic IK of two bones: the joint at the middle bends until the end is as far from the start as the goal
// is, the start swings there on the shortest way, and both turn about the line to the goal towards the pole.
// World space, double, no allocation, any thread.
#pragma once

#include <optional>

#include "base/matrix.h"

namespace kpsa::engine {

struct TwoBonePose {  // before the solve: what a clip or the rest pose says
  Double3 start, mid, end;
  Quaternion start_turn;  // world rotation of the start joint
};

// Known when bound; from the rest pose.
struct TwoBoneRest {
  Double3 bend_axis;      // in the start joint's axes: how the middle bends where a pose is straight
  double pole_angle = 0;  // from the bend to the pole about the line from start to end, to be kept
};

struct TwoBoneGoal {
  Double3 place;
  std::optional<Double3> pole;  // none: the bend stays in the plane that the swing takes it to
  double twist = 0;             // radians about the line from start to goal, on top
};

struct TwoBoneTurns {
  Quaternion mid;    // turns the lower bone about the middle joint, first
  Quaternion start;  // then all about the start joint
};

// Goals out of reach: the bones point straight at them, or fold as far as they can. A bone without length, a
// goal at the start joint or a pole on the line leave alone what they cannot decide. Numbers that are not
// finite give no turn.
TwoBoneTurns SolveTwoBones(const TwoBonePose& pose, const TwoBoneRest& rest, const TwoBoneGoal& goal);

// The rest's part of a solve. pole: where it is at rest; arms that are straight there bend towards it. Its
// angle is kept only if `keep_pole_angle`.
TwoBoneRest BindTwoBones(const TwoBonePose& rest, std::optional<Double3> pole, bool keep_pole_angle);

}  // namespace kpsa::engine
