// The creature: eight tapering arms of ten joints around a mantle.
#include <algorithm>
#include <array>

#include "base/scalar_math.h"
#include "bench/untouched_design.h"
#include "scenes/implicit.h"

namespace kpsa::engine::untouched {
namespace {

using scenes::Cone;
using scenes::Ellipsoid;
using scenes::SmoothUnion;

constexpr std::size_t kArms = 8, kJoints = 10;
// Groups of motions: how each arm bends, how it sways, then how all arms twist, and the mantle.
constexpr std::size_t kBend = 0, kSway = kArms, kTwist = 2 * kArms, kMantle = kTwist + 1,
                      kGroupsOfCreature = kMantle + 1;

std::vector<double> Shares(double bend, double sway, double twist, double mantle) {
  std::vector<double> shares(kGroupsOfCreature, bend);
  std::fill_n(shares.begin() + kSway, kArms, sway);
  shares[kTwist] = twist, shares[kMantle] = mantle;
  return shares;
}

}  // namespace

Design DesignCreature(std::uint64_t seed) {
  Random random(seed ^ 0xc4ea);
  Design design;
  design.weight_falloff = Count(random, 3, 6);
  design.weight_rounds = Count(random, 2, 6);
  design.groups.resize(kGroupsOfCreature);
  for (std::size_t arm = 0; arm < kArms; ++arm) {
    design.groups[kBend + arm] = {0.6, Between(random, 0.3, 0.8)};
    design.groups[kSway + arm] = {0.6, Between(random, 0.3, 0.8)};
  }

  const double body = Between(random, 0.09, 0.13), tall = body * Between(random, 1.1, 1.7);
  const int root = design.AddBone({"body", -1, {0, 0, 0}, {0, 0.3 * tall, 0}, {1, 0, 0}, body});
  for (int axis = 0; axis < 3; ++axis) {
    design.motions.push_back({MotionKind::kTravel, 0, axis, -0.1, 0.1, kMantle, 0});
    design.AddTurn(root, axis, -20, 20, kMantle);
  }
  const int mantle =
      design.AddBone({"mantle", root, {0, 0.5 * tall, 0}, {0, 1.3 * tall, 0}, {1, 0, 0}, body});
  design.AddTurn(mantle, 2, -25, 25, kMantle, 1);
  design.AddTurn(mantle, 1, -25, 25, kMantle, 1);

  struct Joint {
    Double3 a, b;
    double ra, rb;
  };
  std::vector<Joint> joints;
  double reach = 0;
  for (std::size_t arm = 0; arm < kArms; ++arm) {
    const double around = (static_cast<double>(arm) + 0.5 + Between(random, -0.12, 0.12)) * 2 * kPi / kArms;
    const double length = body * Between(random, 4, 6), thick = body * Between(random, 0.3, 0.4),
                 droop = Between(random, 0.1, 0.5), taper = Between(random, 0.18, 0.3);
    const Double3 out = {Cos(around), 0, Sin(around)}, hinge = Cross(out, {0, 1, 0});
    Double3 at = out * (0.75 * body);
    int parent = root;
    for (std::size_t k = 0; k < kJoints; ++k) {
      const double from = static_cast<double>(k) / kJoints, to = from + 1.0 / kJoints;
      const double down = droop * (1 - 1.6 * from);
      const Double3 tip = at + (out * Cos(down) - Double3{0, Sin(down), 0}) * (length / kJoints);
      const Joint joint{at, tip, thick * (1 - (1 - taper) * from), thick * (1 - (1 - taper) * to)};
      parent = design.AddBone(
          {"arm" + std::to_string(arm + 1) + "_" + std::to_string(k + 1), parent, at, tip, hinge, joint.ra});
      const int depth = static_cast<int>(k);
      const double most = Between(random, 18, 26);
      design.AddTurn(parent, 2, -most, most, kBend + arm, depth);
      design.AddTurn(parent, 1, -most, most, kSway + arm, depth);
      if (k == 0) design.AddTurn(parent, 0, -30, 30, kTwist);
      joints.push_back(joint);
      at = tip;
    }
    reach = std::max(reach, Length(at) + thick);
  }

  Part part;
  part.distance = [=](Double3 p) {
    double d = SmoothUnion(Ellipsoid(p, {0, 0, 0}, {body, 0.6 * body, body}),
                           Ellipsoid(p, {0, 0.8 * tall, 0}, {0.85 * body, tall, 0.85 * body}), 0.5 * body);
    for (const Joint& j : joints) d = SmoothUnion(d, Cone(p, j.a, j.b, j.ra, j.rb), 0.15 * body);
    return d;
  };
  part.low = {-reach, -0.5 * reach, -reach}, part.high = {reach, 2 * tall, reach};
  for (int b = 0; b < static_cast<int>(design.bones.size()); ++b) part.bones.push_back(b);
  design.parts.push_back(std::move(part));

  design.clips = {{"swirl", Formula::kCycles, Shares(0.85, 1, 0.5, 0.5)},
                  {"swim", Formula::kCycles, Shares(1, 0.5, 0.3, 0.8)},
                  {"grasp", Formula::kEvents, Shares(0.8, 0.8, 1, 0.3)},
                  {"wander", Formula::kSines, Shares(0.8, 0.85, 0.8, 1)},
                  {"play", Formula::kMoves, Shares(0.8, 0.8, 0.8, 0.8)}};
  return design;
}

}  // namespace kpsa::engine::untouched
