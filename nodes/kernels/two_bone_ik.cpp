#include "nodes/kernels/two_bone_ik.h"

#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "nodes/kernels/constraint_math.h"

namespace kpsa::engine {
namespace {

constexpr double kNothing = 1e-12;  // of the bones' length: below it there is no length or no way to go
constexpr double kStraight = 1e-7;  // sine of a bend whose plane says nothing

// The axis about which the lower bone is bent against the upper one; false where they are straight.
bool BendAxis(Double3 upper, Double3 lower, Double3* axis) {
  Double3 u, l;
  return Direction(upper, 0, &u) && Direction(lower, 0, &l) && Direction(Cross(u, l), kStraight, axis);
}

// The angle by which the lower bone turns away from the upper one's direction, for an end at `distance`.
// Half-angle form: no cosine near 1, where it would know half of the digits only.
double BendFor(double upper, double lower, double distance) {
  const double longest = upper + lower, shortest = std::fabs(upper - lower);
  const double over = std::max(0.0, (longest - distance) * (longest + distance));
  const double under = std::max(0.0, (distance - shortest) * (distance + shortest));
  return 2 * Atan2(std::sqrt(over), std::sqrt(under));
}

}  // namespace

TwoBoneTurns SolveTwoBones(const TwoBonePose& pose, const TwoBoneRest& rest, const TwoBoneGoal& goal) {
  TwoBoneTurns turns;
  const Double3 upper = pose.mid - pose.start, lower = pose.end - pose.mid, way = goal.place - pose.start;
  const double upper_length = Length(upper), lower_length = Length(lower);
  const double length = upper_length + lower_length, distance = Length(way);
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(distance)) return turns;
  Double3 bone = upper, axis;  // the axis of the bend
  if (!Direction(upper, kNothing * length, &bone)) {
    if (!Direction(lower, 0, &bone)) return turns;
  }
  if (!BendAxis(upper, lower, &axis)) axis = Perpendicular(bone, Rotate(pose.start_turn, rest.bend_axis));

  // Bend and swing, where there is any way to go
  Double3 end = pose.end - pose.start;
  if (Length(goal.place - pose.end) > kNothing * length) {
    if (upper_length > kNothing * length && lower_length > kNothing * length) {
      double now = 0;
      AngleAbout(axis, upper, lower, &now);
      turns.mid = AxisAngle(axis, BendFor(upper_length, lower_length, distance) - now);
      end = upper + Rotate(turns.mid, lower);
    }
    Double3 from, to;
    if (Direction(end, kNothing * length, &from) && Direction(way, kNothing * length, &to))
      turns.start = ShortestArc(from, to, axis);
  }

  // About the line from start to end
  Double3 line;
  if (!Direction(Rotate(turns.start, end), kNothing * length, &line)) return turns;
  double about = goal.twist, to_pole = 0;
  // Where the arm is straight, the bend's side counts: it is where the middle would go
  const Double3 side = Rotate(turns.start, Cross(end, axis));
  if (goal.pole.has_value() && AngleAbout(line, side, *goal.pole - pose.start, &to_pole))
    about += to_pole - rest.pole_angle;
  if (std::isfinite(about) && std::fabs(about) > kNothing)
    turns.start = Normalized(AxisAngle(line, about) * turns.start);
  return turns;
}

TwoBoneRest BindTwoBones(const TwoBonePose& rest, std::optional<Double3> pole, bool keep_pole_angle) {
  TwoBoneRest bound;
  const Double3 upper = rest.mid - rest.start, lower = rest.end - rest.mid, end = rest.end - rest.start;
  Double3 axis, bone, line;
  if (!Direction(upper, 0, &bone) && !Direction(lower, 0, &bone)) return bound;
  const Double3 to_pole = pole.has_value() ? *pole - rest.start : Double3();
  if (!BendAxis(upper, lower, &axis)) axis = Perpendicular(bone, Cross(to_pole, bone));
  bound.bend_axis = Rotate(Conjugate(rest.start_turn), axis);
  double angle = 0;
  if (keep_pole_angle && pole.has_value() && Direction(end, 0, &line) &&
      AngleAbout(line, Cross(end, axis), to_pole, &angle))
    bound.pole_angle = angle;
  return bound;
}

}  // namespace kpsa::engine
