// A chain of joints laid along a curve: every bone keeps its length and ends on the curve; beyond the curve's
// end the chain goes straight on. Frames are carried from joint to joint by the smallest turns, so that
// nothing flips, and twisted on top. World space, double, no allocation, any thread.
#pragma once

#include <span>

#include "base/matrix.h"
#include "nodes/kernels/wire.h"

namespace kpsa::engine {

struct SplineChainPose {
  Matrix4 parent;               // world matrix of the first joint's parent
  std::span<const Matrix4> in;  // local matrices of the joints below
  Matrix4 tip;                  // local matrix of the end
  CurveShape shape;
  std::span<const Double3> vertices;      // of the curve, now
  double start_twist = 0, end_twist = 0;  // radians about the first and the last bone
};

// Local matrices of the joints, `out` as many as `pose.in`; the first one is moved to the curve's start.
// Bones or curves without length leave the turn of their joint alone.
void SolveSplineChain(const SplineChainPose& pose, std::span<Matrix4> out);

}  // namespace kpsa::engine
