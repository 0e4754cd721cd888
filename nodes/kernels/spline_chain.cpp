#include "nodes/kernels/spline_chain.h"

#include <algorithm>
#include <cmath>

#include "nodes/kernels/constraint_math.h"
#include "nodes/kernels/matrix_parts.h"

namespace kpsa::engine {
namespace {

constexpr int kSamplesPerSpan = 16;  // chords leave the curve between two of them

Double3 JointPlace(const Matrix4& m) { return {m(0, 3), m(1, 3), m(2, 3)}; }

// Walks along the curve in chords.
class CurveWalk {
 public:
  explicit CurveWalk(const SplineChainPose& pose)
      : shape_(pose.shape), vertices_(pose.vertices), place_(shape_.Point(vertices_, 0)) {}
  Double3 place() const { return place_; }

  // Moves to the first place of the curve ahead that is `length` away.
  void Step(double length) {
    const double end = static_cast<double>(shape_.spans());
    while (u_ < end) {
      double low = u_;
      double high = std::min((std::floor(u_ * kSamplesPerSpan) + 1) / kSamplesPerSpan, end);
      if (!(Length(shape_.Point(vertices_, high) - place_) >= length)) {
        u_ = high;
        continue;
      }
      for (int i = 0; i < 60 && low < high; ++i) {
        const double mid = 0.5 * (low + high);
        (Length(shape_.Point(vertices_, mid) - place_) >= length ? high : low) = mid;
      }
      u_ = high;
      place_ = shape_.Point(vertices_, u_);
      return;
    }
    // Straight on from the end: |end + s t - place| = length
    const Double3 last = shape_.Point(vertices_, end), back = last - place_;
    Double3 t;
    if (!Direction(last - shape_.Point(vertices_, end - 1.0 / kSamplesPerSpan), 0, &t) &&
        !Direction(back, 0, &t))
      return;
    if (beyond_) {
      place_ = place_ + t * length;
      return;
    }
    const double along = Dot(back, t), rest = length * length - Dot(back, back) + along * along;
    place_ = last + t * (std::sqrt(std::max(rest, 0.0)) - along);
    beyond_ = true;
  }

 private:
  const CurveShape& shape_;
  std::span<const Double3> vertices_;
  Double3 place_;
  double u_ = 0;
  bool beyond_ = false;
};

}  // namespace

void SolveSplineChain(const SplineChainPose& pose, std::span<Matrix4> out) {
  CurveWalk walk(pose);
  Matrix4 above = pose.parent;
  double twisted = 0;
  const std::size_t joints = pose.in.size();
  for (std::size_t i = 0; i < joints; ++i) {
    Matrix4 local = pose.in[i];
    if (i == 0) {
      const Double3 start = TransformPoint(InverseOrIdentity(above), walk.place());
      local(0, 3) = start.x, local(1, 3) = start.y, local(2, 3) = start.z;
    }
    Matrix4 world = above * local;
    const Double3 place = JointPlace(world);
    const Double3 bone = TransformVector(world, JointPlace(i + 1 < joints ? pose.in[i + 1] : pose.tip));
    walk.Step(Length(bone));
    Double3 from, to;
    Quaternion turn;
    if (Direction(bone, 0, &from) && Direction(walk.place() - place, 0, &to)) {
      const double share = joints > 1 ? static_cast<double>(i) / static_cast<double>(joints - 1) : 0;
      const double twist = pose.start_twist + (pose.end_twist - pose.start_twist) * share;
      turn = ShortestArc(from, to, {world(0, 1), world(1, 1), world(2, 1)});
      if (twist != twisted) turn = Normalized(AxisAngle(to, twist - twisted) * turn);
      twisted = twist;
    }
    if (!(turn == Quaternion())) {  // about its own place
      const Matrix4 turned = InverseOrIdentity(above) * (RotationFromUnit(turn) * world);
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) local(row, column) = turned(row, column);
      }
    }
    out[i] = local;
    above = above * local;
  }
}

}  // namespace kpsa::engine
