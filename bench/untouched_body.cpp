// The biped: sleeves and trousers in one surface, hands of their own that begin within the cuffs.
#include <algorithm>

#include "base/scalar_math.h"
#include "bench/untouched_design.h"
#include "scenes/implicit.h"

namespace kpsa::engine::untouched {
namespace {

using scenes::Cone;
using scenes::Ellipsoid;
using scenes::SmoothUnion;

// Groups of motions.
enum : std::size_t { kTrunk, kArmL, kArmR, kHandL, kHandR, kLegL, kLegR, kTravelling, kGroupsOfBody };

struct Proportions {
  double height, legs, hips, shoulders, arm, girth, head, finger, slope;
};

Proportions DrawProportions(Random& random) {
  Proportions p{};
  p.height = Between(random, 1.45, 1.95);
  p.legs = p.height * Between(random, 0.44, 0.52);
  p.hips = p.height * Between(random, 0.055, 0.07);
  p.shoulders = p.height * Between(random, 0.095, 0.125);
  p.arm = p.height * Between(random, 0.30, 0.36);  // to the wrist
  p.girth = Between(random, 0.85, 1.3);
  p.head = p.height * Between(random, 0.06, 0.075);
  p.finger = p.height * Between(random, 0.038, 0.05);
  p.slope = Between(random, 0, 0.25);
  return p;
}

struct Capsule {
  Double3 a, b;
  double ra, rb;
};

double Blend(const std::vector<Capsule>& capsules, Double3 p, double k) {
  double distance = 1e3;
  for (const Capsule& c : capsules) distance = SmoothUnion(distance, Cone(p, c.a, c.b, c.ra, c.rb), k);
  return distance;
}

class Body {
 public:
  explicit Body(std::uint64_t seed) : random_(seed ^ 0xb0d7), p_(DrawProportions(random_)) {
    design_.weight_falloff = Count(random_, 3, 6);
    design_.weight_rounds = Count(random_, 3, 8);
    design_.groups.resize(kGroupsOfBody);
    design_.groups[kHandL].coherence = design_.groups[kHandR].coherence = 0.6;
    for (const std::size_t g : {kHandL, kHandR, kArmL, kArmR}) design_.groups[g].lag = 0.3;
  }

  Design Make() {
    Trunk();
    const bool twists = random_.Unit() < 0.6;
    for (const double side : {1.0, -1.0}) {
      Leg(side);
      Hand(side, Arm(side, twists));
    }
    Clothes();
    // By group: trunk, arms, hands, legs, travelling
    const auto shares = [](double trunk, double arms, double hands, double legs, double travelling) {
      return std::vector{trunk, arms, arms, hands, hands, legs, legs, travelling};
    };
    design_.clips = {{"walk", Formula::kCycles, shares(0.4, 0.5, 0.2, 1, 0.5)},
                     {"reach", Formula::kEvents, shares(0.7, 1, 0.6, 0.5, 0.4)},
                     {"dance", Formula::kSines, shares(1, 0.85, 0.5, 0.85, 0.8)},
                     {"strut", Formula::kCycles, shares(0.7, 0.8, 0.3, 0.85, 1)},
                     {"gestures", Formula::kSines, shares(0.3, 0.6, 1, 0, 0)},
                     {"play", Formula::kMoves, shares(0.8, 0.8, 0.8, 0.8, 0.8)}};
    return std::move(design_);
  }

 private:
  double Radius(double of_height) const { return of_height * p_.height * p_.girth; }
  static std::string Sided(const char* name, double side) {
    return std::string(name) + (side > 0 ? "_L" : "_R");
  }

  void Trunk() {
    const double y = p_.legs, top = p_.height - 2.6 * p_.head;  // of the spine
    chest_ = {0, top - 0.03 * p_.height, 0};
    const int joints = Count(random_, 2, 4);
    int last = design_.AddBone({"hips", -1, {0, y, 0}, {0, y + 0.04, 0}, {1, 0, 0}, Radius(0.09)});
    hips_ = last;
    for (int axis = 0; axis < 3; ++axis)
      design_.motions.push_back(
          {MotionKind::kTravel, 0, axis, -0.04 * p_.height, 0.04 * p_.height, kTravelling, 0});
    for (int axis = 0; axis < 3; ++axis) design_.AddTurn(hips_, axis, -14, 14, kTravelling);
    const double step = (top - y - 0.04) / joints;
    for (int i = 0; i < joints; ++i) {
      const double from = y + 0.04 + step * i;
      last = design_.AddBone({"spine" + std::to_string(i + 1),
                              last,
                              {0, from, 0},
                              {0, from + step, 0},
                              {1, 0, 0},
                              Radius(0.085)});
      design_.AddTurn(last, 2, -30.0 / joints, 60.0 / joints, kTrunk, i);
      design_.AddTurn(last, 0, -40.0 / joints, 40.0 / joints, kTrunk, i);
      design_.AddTurn(last, 1, -30.0 / joints, 30.0 / joints, kTrunk, i);
    }
    chest_bone_ = last;
    const int necks = Count(random_, 1, 2);
    const double neck = 0.7 * p_.head / necks;
    for (int i = 0; i < necks; ++i) {
      last = design_.AddBone({"neck" + std::to_string(i + 1),
                              last,
                              {0, top + neck * i, 0},
                              {0, top + neck * (i + 1), 0},
                              {1, 0, 0},
                              Radius(0.033)});
      for (int axis = 0; axis < 3; ++axis)
        design_.AddTurn(last, axis, -24.0 / necks, 24.0 / necks, kTrunk, 3 + i);
    }
    const double base = top + 0.7 * p_.head;
    last = design_.AddBone({"head", last, {0, base, 0}, {0, base + 1.6 * p_.head, 0}, {1, 0, 0}, p_.head});
    for (int axis = 0; axis < 3; ++axis) design_.AddTurn(last, axis, -25, 30, kTrunk, 5);
  }

  void Leg(double side) {
    const std::size_t group = side > 0 ? kLegL : kLegR;
    const double x = side * p_.hips, knee = 0.53 * p_.legs, ankle = 0.045 * p_.height,
                 thick = std::min(Radius(0.047), 0.7 * p_.hips);
    const Double3 a{x, 0.98 * p_.legs, 0}, b{1.05 * x, knee, 0.01}, c{1.1 * x, ankle, -0.01},
        d{1.15 * x, 0.3 * ankle, 0.07 * p_.height}, e{1.2 * x, 0.3 * ankle, 0.11 * p_.height};
    const int thigh = design_.AddBone({Sided("thigh", side), hips_, a, b, {1, 0, 0}, thick});
    const int shin = design_.AddBone({Sided("shin", side), thigh, b, c, {1, 0, 0}, 0.75 * thick});
    const int foot = design_.AddBone({Sided("foot", side), shin, c, d, {1, 0, 0}, 0.6 * thick});
    const int toes = design_.AddBone({Sided("toes", side), foot, d, e, {1, 0, 0}, 0.4 * thick});
    design_.AddTurn(thigh, 2, -75, 30, group);
    design_.AddTurn(thigh, 0, -25, 25, group);
    design_.AddTurn(thigh, 1, -25, 25, group);
    design_.AddTurn(shin, 2, 0, 105, group, 1);
    design_.AddTurn(foot, 2, -30, 35, group, 2);
    design_.AddTurn(foot, 1, -15, 15, group, 2);
    design_.AddTurn(toes, 2, -35, 15, group, 3);
    for (const Capsule& c2 :
         {Capsule{a, b, 1.2 * thick, thick}, Capsule{b, c, 0.95 * thick, 0.55 * thick},
          Capsule{c, d, 0.6 * thick, 0.5 * thick}, Capsule{d, e, 0.5 * thick, 0.4 * thick}})
      limbs_.push_back(c2);
    clothes_.insert(clothes_.end(), {thigh, shin, foot, toes});
  }

  // The bone that the hand hangs on.
  int Arm(double side, bool twists) {
    const std::size_t group = side > 0 ? kArmL : kArmR;
    const Double3 out{side * Cos(p_.slope), -Sin(p_.slope), 0}, hinge{0, -side, 0};
    const double thick = Radius(0.027);
    const Double3 inner{0.2 * side * p_.shoulders, chest_.y, 0}, a{side * p_.shoulders, chest_.y, 0},
        b = a + out * (0.53 * p_.arm), c = a + out * p_.arm;
    const int clavicle =
        design_.AddBone({Sided("clavicle", side), chest_bone_, inner, a, hinge, 1.6 * thick});
    design_.AddTurn(clavicle, 1, -12, 18, group);
    design_.AddTurn(clavicle, 2, -12, 12, group);
    const int upper = design_.AddBone({Sided("upperarm", side), clavicle, a, b, hinge, 1.2 * thick});
    for (int axis = 0; axis < 3; ++axis)
      design_.AddTurn(upper, axis, axis == 0 ? -35 : -60, axis == 0 ? 35 : 60, group, 1);
    const int lower = design_.AddBone({Sided("forearm", side), upper, b, c, hinge, thick});
    design_.AddTurn(lower, 2, 0, 120, group, 2);
    int end = lower;
    if (twists) {
      end = design_.AddBone({Sided("forearmTwist", side), lower, b * 0.4 + c * 0.6, c, hinge, thick});
      clothes_.push_back(end);
    }
    design_.AddTurn(end, 0, -50, 50, group, 3);
    limbs_.push_back({inner, a, 1.5 * thick, 1.5 * thick});
    limbs_.push_back({a, b, 1.45 * thick, 1.05 * thick});
    limbs_.push_back({b, c, 1.1 * thick, 0.9 * thick});
    clothes_.insert(clothes_.end(), {clavicle, upper, lower});
    return end;
  }

  void Hand(double side, int arm) {
    const std::size_t group = side > 0 ? kHandL : kHandR;
    const Bone& above = design_.bones[static_cast<std::size_t>(arm)];
    const Double3 wrist = above.tip, out = UnitOrZero(above.tip - above.at), forward{0, 0, 1},
                  hinge{0, 0, -side};
    const double palm = 1.15 * p_.finger, thick = 0.0052 * p_.height * Between(random_, 0.9, 1.15);
    std::vector<Capsule> capsules = {{wrist - out * 0.025, wrist + out * 0.01, 2.2 * thick, 2.2 * thick}};
    std::vector<int> bones = {arm};
    const int hand =
        design_.AddBone({Sided("hand", side), arm, wrist, wrist + out * palm, hinge, 3.5 * thick});
    bones.push_back(hand);
    design_.AddTurn(hand, 2, -45, 55, group);
    design_.AddTurn(hand, 1, -18, 18, group);
    const char* const names[] = {"thumb", "index", "middle", "ring", "pinky"};
    const double lengths[] = {0.9, 0.95, 1.05, 0.95, 0.75};
    for (int finger = 0; finger < 5; ++finger) {
      const bool thumb = finger == 0;
      const double across = thumb ? 3.6 : 4.2 - 2.8 * (finger - 1);  // in finger radii
      const Double3 base = thumb ? wrist + out * (0.35 * palm) + forward * (2.6 * thick)
                                 : wrist + out * palm + forward * (across * thick);
      const Double3 along = UnitOrZero(thumb ? out * 0.7 + forward * 0.75 + Double3{0, -0.2, 0}
                                             : out + forward * (0.05 * (2.4 - finger)));
      capsules.push_back({wrist, base, 2 * thick, thumb ? 1.7 * thick : 1.4 * thick});
      Double3 at = base;
      int parent = hand;
      for (int k = 0; k < 3; ++k) {
        const Double3 tip = at + along * (lengths[finger] * p_.finger * 2 *
                                          (k == 0   ? 0.42
                                           : k == 1 ? 0.32
                                                    : 0.26));
        parent = design_.AddBone({Sided((names[finger] + std::to_string(k + 1)).c_str(), side), parent, at,
                                  tip, thumb ? Cross(along, Double3{0, -1, 0}) * -side : hinge, 1.2 * thick});
        bones.push_back(parent);
        design_.AddTurn(parent, 2, k == 0 ? -15 : 0, thumb ? 40 : k == 1 ? 90 : 65, group, 1 + k);
        if (k == 0) design_.AddTurn(parent, 1, -10, 10, group, 1);
        capsules.push_back({at, tip, (1.2 - 0.08 * k) * thick, (1.12 - 0.08 * k) * thick});
        at = tip;
      }
    }
    Part part;
    part.distance = [capsules, k = 0.9 * thick](Double3 p) { return Blend(capsules, p, k); };
    part.low = part.high = wrist;
    for (const Capsule& c : capsules) {
      for (const Double3& p : {c.a, c.b}) {
        for (int k = 0; k < 3; ++k) {
          part.low[k] = std::min(part.low[k], p[k] - 3 * thick);
          part.high[k] = std::max(part.high[k], p[k] + 3 * thick);
        }
      }
    }
    part.share = 0.14;
    part.bones = std::move(bones);
    design_.parts.push_back(std::move(part));
  }

  void Clothes() {
    for (int b = 0; b < static_cast<int>(design_.bones.size()); ++b) {
      if (b <= 1 || design_.bones[static_cast<std::size_t>(b)].at.x == 0) clothes_.push_back(b);
    }
    std::sort(clothes_.begin(), clothes_.end());
    clothes_.erase(std::unique(clothes_.begin(), clothes_.end()), clothes_.end());
    const Proportions p = p_;
    const double wide = Radius(0.085), deep = Radius(0.06), skull = p_.height - p_.head * 1.05;
    const Double3 chest{0, chest_.y - 0.06 * p.height, 0}, pelvis{0, p.legs + 0.01, 0},
        waist = (chest + pelvis) * 0.5;
    Part part;
    part.distance = [=, limbs = limbs_](Double3 at) {
      double d = Ellipsoid(at, pelvis, {wide, 0.07 * p.height, 1.05 * deep});
      d = SmoothUnion(d, Ellipsoid(at, waist, {0.85 * wide, 0.11 * p.height, 0.9 * deep}), 0.05);
      d = SmoothUnion(d, Ellipsoid(at, chest, {1.1 * wide, 0.1 * p.height, 1.1 * deep}), 0.05);
      d = SmoothUnion(d, Blend(limbs, at, 0.02), 0.03);
      const double neck = 0.031 * p.height * p.girth;
      d = SmoothUnion(
          d, Cone(at, {0, chest.y + 0.05 * p.height, 0}, {0, skull - 0.4 * p.head, 0}, 1.2 * neck, neck),
          0.03);
      d = SmoothUnion(d, Ellipsoid(at, {0, skull, 0}, {0.78 * p.head, p.head * 1.05, 0.95 * p.head}), 0.02);
      d = SmoothUnion(
          d,
          Ellipsoid(at, {0, skull - 0.55 * p.head, 0.3 * p.head}, {0.5 * p.head, 0.5 * p.head, 0.6 * p.head}),
          0.02);
      return SmoothUnion(d,
                         Ellipsoid(at, {0, skull - 0.25 * p.head, 0.95 * p.head},
                                   {0.14 * p.head, 0.25 * p.head, 0.2 * p.head}),
                         0.015);
    };
    const double reach = p.shoulders + p.arm + 0.06;
    part.low = {-reach, -0.03, -0.2 * p.height * p.girth};
    part.high = {reach, p.height + 0.05, 0.2 * p.height * p.girth};
    part.share = 1 - 2 * 0.14;
    part.bones = clothes_;
    design_.parts.insert(design_.parts.begin(), std::move(part));
  }

  Random random_;
  Proportions p_;
  Design design_;
  Double3 chest_;
  int hips_ = 0, chest_bone_ = 0;
  std::vector<Capsule> limbs_;
  std::vector<int> clothes_;  // bones
};

}  // namespace

Design DesignBody(std::uint64_t seed) { return Body(seed).Make(); }

}  // namespace kpsa::engine::untouched
