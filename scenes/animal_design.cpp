// A fox: a muzzle with a nose pad and whisker pads, and pointed ears that stand up.
#include <cmath>

#include "scenes/head_shape.h"
#include "scenes/implicit.h"

namespace kpsa::engine::scenes {
namespace {

constexpr Double3 kAnimalEye = {3.5, 16.5, 5.0};
constexpr Double3 kAnimalJaw = {0, 11.8, 0.8};

double AnimalDistance(Double3 p) {
  p.x = std::sqrt(p.x * p.x + 1e-6);  // mirrored, without a crease
  // Skull, cheeks
  double d = Ellipsoid(p, {0, 16.8, -1.0}, {7.8, 7.4, 7.9});
  d = SmoothUnion(d, Ellipsoid(p, {0, 17.4, 2.4}, {5.8, 5.0, 5.2}), 2.2);
  d = SmoothUnion(d, Ellipsoid(p, {5.3, 12.4, 1.2}, {3.2, 3.3, 3.4}), 2.6);
  d = SmoothUnion(d, Ellipsoid(p, {0, 11.2, 2.6}, {5.2, 4.4, 5.0}), 2.0);
  // Muzzle, lower jaw
  d = SmoothUnion(d, Cone(p, {0, 12.6, 4.4}, {0, 11.5, 10.0}, 3.7, 2.35), 2.2);
  d = SmoothUnion(d, Cone(p, {0, 10.0, 4.0}, {0, 8.8, 9.2}, 2.6, 1.5), 1.6);
  d = SmoothUnion(d, Ellipsoid(p, {0, 8.4, 9.8}, {1.3, 0.9, 1.2}), 1.0);         // chin
  d = SmoothUnion(d, Ellipsoid(p, {1.45, 10.9, 10.6}, {1.6, 1.35, 1.7}), 1.0);   // whisker pad
  d = SmoothUnion(d, Cone(p, {0, 17.0, 6.2}, {0, 13.7, 10.8}, 1.0, 0.95), 1.8);  // bridge
  d = SmoothUnion(d, Ellipsoid(p, {0, 13.05, 12.0}, {1.4, 1.0, 0.95}), 0.6);     // nose pad
  d = SmoothCut(d, Cone(p, {0, 12.0, 12.75}, {0, 10.6, 12.45}, 0.16, 0.14), 0.4);
  // Neck
  d = SmoothUnion(d, Cone(p, {0, -4, -3.2}, {0, 10, -1.6}, 5.2, 4.6), 2.4);
  d = SmoothUnion(d, Ellipsoid(p, {0, 4.6, 0.6}, {4.6, 3.8, 3.6}), 2.4);
  // Eye sockets, brows
  d = SmoothCut(d, Ellipsoid(p, {3.5, 16.6, 7.8}, {2.4, 1.7, 1.9}), 1.4);
  d = SmoothUnion(d, Cone(p, {1.6, 18.9, 6.4}, {4.7, 19.2, 4.6}, 0.65, 0.5), 1.2);
  // Lids over the eyeballs
  return SmoothUnion(d, Ellipsoid(p, kAnimalEye + Double3{0.02, 0.02, 0}, {1.86, 1.70, 1.72}), 0.6);
}

// Red fur, white below, a dark nose and dark tips of the ears.
Double3 AnimalColor(Double3 q, double) {
  constexpr Double3 kFur = {0.56, 0.22, 0.06}, kWhite = {0.74, 0.68, 0.60}, kDark = {0.05, 0.035, 0.03};
  const double line = q.y - 0.30 * q.x + 0.05 * q.z;
  const double white = Smooth(12.3, 11.3, line) * Smooth(-1.5, 2.5, q.z);
  const double mark = Bump(Length(Double3{(q.x - 2.2) / 1.3, (q.y - 19.2) / 0.9, (q.z - 6.0) / 3.0}), 1.0);
  const double pad =
      Smooth(1.12, 0.95, Length(Double3{q.x / 1.55, (q.y - 13.05) / 1.15, (q.z - 12.4) / 1.25}));
  const double tip = Smooth(25.5, 28.0, q.y);
  const double rim = Smooth(2.45, 2.15, Length(Double3{q.x - 3.5, 1.15 * (q.y - 16.5), 0.6 * (q.z - 6.2)}));
  const Double3 fur = Mix(Mix(kFur, kWhite, std::max(white, 0.8 * mark)), {0.25, 0.10, 0.04}, 0.6 * rim);
  return Mix(fur, kDark, std::max(pad, 0.9 * tip));
}

HeadDesign MakeAnimalDesign() {
  HeadDesign d = FaceDesign();
  d.name = "animal";
  d.distance = &AnimalDistance;
  d.color = &AnimalColor;
  d.lip_color = {0.10, 0.05, 0.045};
  d.lip_tint = 0.7;
  d.mouth_color = {0.30, 0.09, 0.08};
  d.inner_ear_color = {0.62, 0.42, 0.36};
  d.iris_color = {0.50, 0.26, 0.03};
  d.guides = {{0.0, 3.0, 5.6, 0.0, -2.6, 0.0, -8.2, 4},     {3.6, 3.4, 5.4, 3.6, -2.2, 4.4, -7.4, 3},
              {6.0, 5.0, 6.0, 6.8, -1.6, 7.8, -7.4, 3},     {6.9, 8.2, 7.0, 8.2, -0.8, 9.4, -7.8, 3},
              {7.4, 10.4, 7.6, 9.4, -0.4, 10.6, -8.2, 3},   {8.3, 11.2, 7.8, 10.3, -0.3, 11.6, -8.5, 6},
              {11.3, 12.2, 8.0, 12.2, -0.4, 13.4, -8.8, 1}, {12.0, 12.8, 8.0, 12.7, -0.4, 13.9, -8.9, 3},
              {13.7, 12.9, 8.0, 13.8, -0.5, 15.0, -9.0, 8}, {14.7, 10.4, 8.0, 14.9, -0.6, 16.2, -9.2, 6},
              {18.7, 8.0, 7.9, 18.4, -0.8, 19.0, -8.9, 2},  {19.6, 7.8, 7.6, 19.2, -0.9, 19.8, -8.6, 6},
              {22.4, 5.7, 5.8, 22.1, -1.0, 22.3, -6.6, 3},  {23.3, 3.9, 4.0, 23.2, -1.0, 23.3, -4.8, 0}};
  d.mouth_row = 16, d.nose_row = 23, d.eye_row = 34;
  d.brow_column0 = 3, d.brow_column1 = 11;
  d.relaxations = 14;
  d.eye_center = kAnimalEye;
  d.eye_radius = 1.5;
  d.iris_size = 1.3;
  d.lid_inner = -1.5, d.lid_span = 3.0;
  d.lid_upper = 0.80, d.lid_lower = 0.58, d.tilt_inner = -0.34, d.tilt_outer = 0.26;
  d.lid_rings = {{{1.14, 1.45, 0.22},
                  {1.05, 1.18, 0.22},
                  {1.0, 1.0, 0.17},
                  {0.985, 0.95, 0.035},
                  {1.01, 1.08, 0.04},
                  {1.02, 1.45, 0.045}}};
  d.mouth_center = {0, 9.75, 11.6};
  d.mouth_half_width = 2.5;
  d.mouth_curve = 0.42;
  d.line_middle = 0.16, d.line_side = -0.12, d.line_end = -0.55;
  d.upper_height = 0.30, d.upper_notch = 0.0, d.lower_height = 0.34;
  d.lip_fullness = 0.5;
  d.pocket_narrow = 0.35;
  d.nostril_depth = 0.6;
  d.ear = {};
  d.ear.column0 = 15, d.ear.column1 = 20, d.ear.row0 = 42, d.ear.row1 = 48;
  d.ear.pointed = true;
  d.ear.rings = {{1.06, 0.0, 0.0},  {1.05, 0.36, 0.0}, {1.04, 0.70, 0.0}, {1.0, 1.0, 0.0},
                 {0.86, 0.95, 0.0}, {0.80, 0.62, 0.0}, {0.72, 0.30, 0.0}, {0.45, 0.06, 0.0}};
  d.ear.shift = {0, -0.2, 0};
  d.ear.back = {0.42, -0.18, 0.889}, d.ear.lean = {3.0, 8.4, -0.4};
  d.joints = {{"root", -1, {0, 0, 0}},
              {"neck", kRoot, {0, 1.5, -2.6}},
              {"head", kNeck, {0, 9.5, -2.0}},
              {"jaw", kHead, kAnimalJaw},
              {"eye.L", kHead, kAnimalEye},
              {"eye.R", kHead, {-kAnimalEye.x, kAnimalEye.y, kAnimalEye.z}},
              {"ear.L", kHead, {5.2, 20.8, 0.4}},
              {"ear.R", kHead, {-5.2, 20.8, 0.4}}};
  d.regions[kEyeRegion] = Region::At(FaceDesign().eye_center, kAnimalEye, {1.16, 1.18, 1.15});
  d.regions[kBrowRegion] = Region::At({3, 20.8, 7.9}, {3.1, 18.9, 6.2}, {1.0, 1.0, 1.1});
  d.regions[kCheekRegion] = Region::At({4.2, 14.2, 6.4}, {4.3, 12.4, 5.4}, {1.05, 1.05, 1.15});
  d.regions[kNoseRegion] = Region::At({0, 14.6, 10.6}, {0, 12.9, 12.4}, {1.15, 1.0, 1.1});
  d.regions[kMouthRegion] = Region::At(kReferenceMouth, {0, 9.75, 11.6}, {1.0, 0.9, 1.25});
  d.regions[kChinRegion] = Region::At({0, 9.0, 8.5}, {0, 8.0, 10.6}, {0.9, 0.8, 1.1});
  d.regions[kThroatRegion] = Region::At({0, 4.2, 3.2}, {0, 4.2, 3.8}, {1.0, 0.95, 1.0});
  d.regions[kJawRegion] = Region::At(kReferenceJaw, kAnimalJaw, {1.05, 0.72, 1.25});
  d.regions[kSkullRegion] = Region::At({0, 22, 0}, {0, 19.5, 0}, {1, 0.9, 0.95});
  d.production = true;
  d.sheet_row0 = 9, d.sheet_row1 = 43;
  return d;
}

}  // namespace

const HeadDesign& AnimalDesign() {
  static const HeadDesign design = MakeAnimalDesign();
  return design;
}

}  // namespace kpsa::engine::scenes
