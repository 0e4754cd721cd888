// The head: one surface with brows, nose, lips and ears, and two eyeballs.
#include <array>

#include "base/scalar_math.h"
#include "bench/untouched_design.h"
#include "scenes/implicit.h"

namespace kpsa::engine::untouched {
namespace {

using scenes::Cone;
using scenes::Ellipsoid;
using scenes::SmoothCut;
using scenes::SmoothUnion;

// Groups of motions.
enum : std::size_t { kNeck, kEyes, kJaw, kFaceJoints, kUpper, kMiddle, kLower, kGroupsOfHead };

// Where shapes are on the left half: across, up and forward, in radii of the skull.
struct Region {
  const char* name;
  std::size_t group;
  double x, y, z;
};
constexpr std::array<Region, 15> kRegions = {{
    {"browIn", kUpper, 0.18, 0.22, 0.92},
    {"browMid", kUpper, 0.38, 0.28, 0.85},
    {"browOut", kUpper, 0.58, 0.22, 0.68},
    {"forehead", kUpper, 0.25, 0.5, 0.8},
    {"lidUp", kUpper, 0.36, 0.1, 0.88},
    {"lidLow", kUpper, 0.36, -0.06, 0.88},
    {"cheek", kMiddle, 0.5, -0.22, 0.75},
    {"cheekOut", kMiddle, 0.66, -0.35, 0.5},
    {"nostril", kMiddle, 0.14, -0.28, 0.98},
    {"fold", kMiddle, 0.3, -0.35, 0.85},
    {"corner", kLower, 0.26, -0.55, 0.84},
    {"lipUp", kLower, 0.1, -0.5, 0.92},
    {"lipLow", kLower, 0.1, -0.64, 0.88},
    {"chin", kLower, 0.12, -0.85, 0.75},
    {"jawSide", kLower, 0.52, -0.7, 0.42},
}};

struct Face {
  Double3 skull;  // radii
  double nose, jaw, brow, ear, lips, eye, neck;
  std::array<double, 12> waves;
};

Face DrawFace(Random& random) {
  Face f{};
  const double size = Between(random, 0.9, 1.15);
  f.skull = {0.078 * size * Between(random, 0.93, 1.08), 0.115 * size * Between(random, 0.93, 1.08),
             0.096 * size * Between(random, 0.95, 1.08)};
  f.nose = Between(random, 0.7, 1.4), f.jaw = Between(random, 0.85, 1.15), f.brow = Between(random, 0.6, 1.4);
  f.ear = Between(random, 0.75, 1.3), f.lips = Between(random, 1, 1.5);
  f.eye = 0.0125 * Between(random, 0.95, 1.3), f.neck = Between(random, 0.8, 1.15);
  for (double& wave : f.waves) wave = Between(random, -1, 1);
  return f;
}

class Head {
 public:
  explicit Head(std::uint64_t seed) : random_(seed ^ 0x4ead), f_(DrawFace(random_)) {
    design_.weight_falloff = Count(random_, 3, 5);
    design_.weight_rounds = Count(random_, 10, 25);
    design_.groups.resize(kGroupsOfHead);
    design_.groups[kEyes].coherence = 0.9;
    design_.groups[kNeck].coherence = 0.3;
  }

  Design Make() {
    Bones();
    Shapes();
    Skin();
    for (const double side : {1.0, -1.0}) Eye(side);
    // By group: neck, eyes, jaw, other joints, upper, middle, lower shapes
    design_.clips = {{"expressions", Formula::kEvents, {0.5, 0.3, 0.6, 0.6, 1, 0.8, 0.8}},
                     {"grimaces", Formula::kEvents, {0.4, 0.5, 0.85, 1, 0.8, 1, 1}},
                     {"talk", Formula::kSines, {0.4, 0.2, 1, 0.4, 0.3, 0.5, 0.85}},
                     {"look", Formula::kSines, {1, 1, 0.2, 0.5, 0.5, 0, 0}},
                     {"scene", Formula::kMoves, {0.8, 0.8, 0.8, 0.8, 0.8, 0.8, 0.8}}};
    return std::move(design_);
  }

 private:
  Double3 OnFace(double x, double y, double z) const {
    return {x * f_.skull.x, y * f_.skull.y, z * f_.skull.z};
  }
  static std::string Sided(const char* name, double side) {
    return std::string(name) + (side > 0 ? "_L" : "_R");
  }
  Double3 EyeAt(double side) const { return OnFace(side * 0.4, 0.02, 0.74); }

  void Bones() {
    const double width = f_.skull.x;
    const Double3 base = OnFace(0, -0.35, -0.25), chest = base - Double3{0, 0.14, 0.03};
    int last = design_.AddBone({"chest", -1, chest - Double3{0, 0.05, 0}, chest, {1, 0, 0}, 0.09});
    const int necks = Count(random_, 1, 3);
    for (int i = 0; i < necks; ++i) {
      const double a = static_cast<double>(i) / necks, b = (i + 1.0) / necks;
      last = design_.AddBone({"neck" + std::to_string(i + 1),
                              last,
                              chest * (1 - a) + base * a,
                              chest * (1 - b) + base * b,
                              {1, 0, 0},
                              0.05 * f_.neck});
      for (int axis = 0; axis < 3; ++axis) design_.AddTurn(last, axis, -24.0 / necks, 24.0 / necks, kNeck, i);
    }
    const int head = design_.AddBone({"head", last, base, OnFace(0, 0.6, 0), {1, 0, 0}, width});
    for (int axis = 0; axis < 3; ++axis) design_.AddTurn(head, axis, -18, 18, kNeck, necks);
    const int jaw = design_.AddBone(
        {"jaw", head, OnFace(0, -0.35, 0.05), OnFace(0, -0.85, 0.8), {1, 0, 0}, 0.55 * width});
    design_.AddTurn(jaw, 2, 0, 20, kJaw);
    design_.AddTurn(jaw, 1, -5, 5, kJaw);
    const int chin =
        design_.AddBone({"chin", jaw, OnFace(0, -0.8, 0.7), OnFace(0, -0.86, 0.86), {1, 0, 0}, 0.2 * width});
    design_.AddTurn(chin, 2, -10, 10, kJaw, 1);
    const int nose =
        design_.AddBone({"nose", head, OnFace(0, -0.1, 0.9), OnFace(0, -0.22, 1.1), {1, 0, 0}, 0.2 * width});
    design_.AddTurn(nose, 2, -8, 8, kFaceJoints);
    const bool cheeks = random_.Unit() < 0.5, tips = random_.Unit() < 0.5, corners = random_.Unit() < 0.5;
    for (const double side : {1.0, -1.0}) {
      const Double3 eye = EyeAt(side);
      const int ball =
          design_.AddBone({Sided("eye", side), head, eye, eye + Double3{0, 0, f_.eye}, {1, 0, 0}, f_.eye});
      design_.AddTurn(ball, 2, -20, 20, kEyes);
      design_.AddTurn(ball, 1, -25, 25, kEyes);
      const Double3 ear = OnFace(side, -0.05, -0.05),
                    rim = ear + Double3{side * 0.006, 0.013, -0.006} * f_.ear;
      const int lobe = design_.AddBone({Sided("ear", side), head, ear, rim, {0, 1, 0}, 0.017 * f_.ear});
      design_.AddTurn(lobe, 2, -15, 15, kFaceJoints);
      design_.AddTurn(lobe, 0, -12, 12, kFaceJoints);
      if (tips) {
        const int tip = design_.AddBone({Sided("earTip", side),
                                         lobe,
                                         rim,
                                         rim + Double3{0, 0.012, -0.003} * f_.ear,
                                         {0, 1, 0},
                                         0.012 * f_.ear});
        design_.AddTurn(tip, 2, -20, 20, kFaceJoints, 1);
      }
      if (cheeks) Pad("cheek", side, head, OnFace(side * 0.5, -0.25, 0.75));
      if (corners) Pad("corner", side, jaw, OnFace(side * 0.28, -0.55, 0.84));
    }
  }

  // A joint under the skin that pulls at what is around it.
  void Pad(const char* name, double side, int parent, Double3 at) {
    const int pad = design_.AddBone({Sided(name, side), parent, at * 0.8, at, {1, 0, 0}, 0.2 * f_.skull.x});
    design_.AddTurn(pad, 2, -12, 12, kFaceJoints);
    design_.AddTurn(pad, 1, -12, 12, kFaceJoints);
  }

  void AddMorph(const std::string& name, Double3 at, Double3 move, double radius, std::size_t group) {
    design_.motions.push_back({MotionKind::kMorph, design_.morphs.size(), 0, 0, 1, group, 0});
    design_.morphs.push_back({name, at, move, radius});
  }

  // Each region has one or two directions, on either side; then some that reach over both.
  void Shapes() {
    const double size = f_.skull.x / 0.078;
    for (const Region& region : kRegions) {
      const int moves = Count(random_, 1, 2);
      for (int k = 0; k < moves; ++k) {
        const double along = Between(random_, 0.003, 0.010), out = Between(random_, -0.003, 0.008);
        const double turn = Between(random_, 0, 2 * kPi), radius = Between(random_, 0.018, 0.045);
        for (const double side : {1.0, -1.0}) {
          const double uneven = Between(random_, 0.85, 1.15);
          const Double3 at = OnFace(side * region.x, region.y, region.z), normal = UnitOrZero(at);
          const Double3 move = Double3{side * Cos(turn), Sin(turn), 0} * along + normal * out;
          AddMorph(Sided((region.name + std::to_string(k + 1)).c_str(), side), at, move * (size * uneven),
                   radius * size, region.group);
        }
      }
    }
    const char* const both[] = {"pucker", "smile",   "frown",  "sneer", "puff",
                                "stern",  "lipsOut", "chinUp", "wide",  "narrow"};
    for (std::size_t k = 0; design_.morphs.size() < 40 || k < 4; ++k) {
      const double y = Between(random_, -0.8, 0.4);
      const double radius = Between(random_, 0.03, 0.06), up = Between(random_, -0.008, 0.008),
                   out = Between(random_, -0.006, 0.01), across = Between(random_, -0.15, 0.15);
      AddMorph(both[k], OnFace(across, y, 0.9), Double3{0, up, out} * size, radius * size,
               y > 0      ? kUpper
               : y > -0.4 ? kMiddle
                          : kLower);
      if (k + 1 == std::size(both)) break;
    }
    while (design_.morphs.size() > 60) design_.morphs.pop_back(), design_.motions.pop_back();
  }

  void Skin() {
    const Face f = f_;
    const Double3 r = f.skull;
    const auto at = [r](double x, double y, double z) { return Double3{x * r.x, y * r.y, z * r.z}; };
    const auto radii = at;
    std::array<Double3, 2> eyes = {EyeAt(1), EyeAt(-1)};
    const Double3 throat = at(0, -0.6, -0.25), shoulders = design_.bones[0].at;
    Part part;
    part.distance = [=](Double3 p) {
      const Double3 half{std::fabs(p.x), p.y, p.z};  // of what is the same on both sides
      double d = Ellipsoid(p, at(0, 0.1, 0), radii(1, 0.95, 1));
      d = SmoothUnion(d, Ellipsoid(p, at(0, -0.5, 0.3), radii(0.72 * f.jaw, 0.48, 0.6)), 0.03);
      d = SmoothUnion(d, Ellipsoid(half, at(0.35, 0.23, 0.78), radii(0.35, 0.09, 0.16 * f.brow)), 0.02);
      d = SmoothUnion(d, Ellipsoid(half, at(0.52, -0.22, 0.6), radii(0.28, 0.16, 0.22)), 0.02);
      d = SmoothUnion(d, Cone(p, at(0, 0.12, 0.92), at(0, -0.22, 0.95 + 0.16 * f.nose), 0.006, 0.011), 0.014);
      d = SmoothUnion(d, Ellipsoid(half, at(0.12, -0.27, 0.97), radii(0.1, 0.06, 0.1 * f.nose)), 0.008);
      d = SmoothUnion(d, Ellipsoid(p, at(0, -0.51, 0.88), radii(0.3, 0.045 * f.lips, 0.08)), 0.008);
      d = SmoothUnion(d, Ellipsoid(p, at(0, -0.62, 0.85), radii(0.26, 0.05 * f.lips, 0.09)), 0.008);
      d = SmoothUnion(d, Ellipsoid(p, at(0, -0.84, 0.72), radii(0.24, 0.12, 0.16)), 0.02);
      d = SmoothUnion(d, Ellipsoid(half, at(1.04, -0.05, -0.08), {0.009, 0.03 * f.ear, 0.019 * f.ear}),
                      0.008);
      d = SmoothUnion(d, Cone(p, throat, shoulders, 0.052 * f.neck, 0.07 * f.neck), 0.03);
      for (const Double3& eye : eyes) d = SmoothCut(d, Length(p - eye) - 1.05 * f.eye, 0.006);
      for (std::size_t k = 0; k < 12; k += 4) {
        const double angle = 40 * (f.waves[k] * p.x + f.waves[k + 1] * p.y + f.waves[k + 2] * p.z);
        d += 0.002 * Sin(angle + 3 * f.waves[k + 3]);
      }
      return d;
    };
    part.low = {-1.25 * r.x - 0.03, shoulders.y - 0.1, -1.1 * r.z - 0.02};
    part.high = {1.25 * r.x + 0.03, 1.1 * r.y + 0.01, 1.3 * r.z + 0.02};
    part.low.z = std::min(part.low.z, shoulders.z - 0.1);
    part.share = 0.92;
    for (int b = 0; b < static_cast<int>(design_.bones.size()); ++b) {
      if (!design_.bones[static_cast<std::size_t>(b)].name.starts_with("eye")) part.bones.push_back(b);
    }
    design_.parts.push_back(std::move(part));
  }

  void Eye(double side) {
    Part part;
    const Double3 center = EyeAt(side);
    const double radius = f_.eye;
    part.distance = [=](Double3 p) { return Length(p - center) - radius; };
    part.low = center - Double3{radius, radius, radius}, part.high = center + Double3{radius, radius, radius};
    part.share = 0.04;
    for (int b = 0; b < static_cast<int>(design_.bones.size()); ++b) {
      if (design_.bones[static_cast<std::size_t>(b)].name == Sided("eye", side)) part.bones = {b};
    }
    design_.parts.push_back(std::move(part));
  }

  Random random_;
  Face f_;
  Design design_;
};

}  // namespace

Design DesignHead(std::uint64_t seed) { return Head(seed).Make(); }

}  // namespace kpsa::engine::untouched
