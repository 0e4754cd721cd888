// A boy: a large round skull, large eyes, a small nose and chin.
#include <cmath>

#include "scenes/head_shape.h"
#include "scenes/implicit.h"

namespace kpsa::engine::scenes {
namespace {

constexpr Double3 kBoyEye = {3.35, 16.9, 6.0};
constexpr Double3 kBoyJaw = {0, 13.2, 0.6};

double BoyDistance(Double3 p) {
  p.x = std::sqrt(p.x * p.x + 1e-6);  // mirrored, without a crease
  // Skull, face, jaw
  double d = Ellipsoid(p, {0, 19.8, -0.6}, {8.5, 8.8, 9.0});
  d = SmoothUnion(d, Ellipsoid(p, {0, 20.2, 3.2}, {7.0, 6.2, 5.9}), 2.2);          // forehead
  d = SmoothUnion(d, Ellipsoid(p, {0, 14.2, 2.5}, {6.4, 5.8, 6.0}), 2.2);          // mid face
  d = SmoothUnion(d, Ellipsoid(p, {0, 11.2, 3.1}, {5.1, 3.6, 4.9}), 2.0);          // jaw
  d = SmoothUnion(d, Cone(p, {5.0, 12.9, -0.1}, {1.5, 8.8, 5.6}, 1.3, 1.1), 2.0);  // jaw line
  d = SmoothUnion(d, Ellipsoid(p, {0, 8.6, 6.3}, {1.5, 1.15, 1.4}), 1.5);          // chin
  d = SmoothUnion(d, Ellipsoid(p, {4.1, 12.6, 4.9}, {2.4, 2.3, 2.3}), 2.0);        // cheek
  // Neck
  d = SmoothUnion(d, Cone(p, {0, -4, -2.4}, {0, 10, -1.2}, 4.1, 3.6), 2.2);
  d = SmoothUnion(d, Cone(p, {2.6, -5, -3.6}, {1.4, 11, -4.2}, 1.7, 1.0), 2.4);
  // Eye sockets, brows
  d = SmoothCut(d, Ellipsoid(p, {3.3, 17.0, 8.9}, {2.7, 1.9, 1.9}), 1.6);
  d = SmoothUnion(d, Cone(p, {1.5, 20.1, 7.5}, {5.2, 19.8, 5.5}, 0.5, 0.45), 1.6);
  // Nose
  d = SmoothUnion(d, Cone(p, {0, 16.9, 7.5}, {0, 14.2, 8.8}, 0.5, 0.7), 1.5);
  d = SmoothUnion(d, Ellipsoid(p, {0, 13.75, 9.15}, {0.98, 0.82, 0.85}), 0.8);
  d = SmoothUnion(d, Ellipsoid(p, {0.95, 13.4, 8.45}, {0.58, 0.55, 0.75}), 0.8);  // wing
  // Mouth
  d = SmoothUnion(d, Ellipsoid(p, {0, 10.8, 6.3}, {2.8, 2.2, 2.3}), 1.4);
  d = SmoothCut(d, Cone(p, {0, 12.6, 8.75}, {0, 11.6, 8.85}, 0.22, 0.2), 0.4);     // philtrum
  d = SmoothCut(d, Cone(p, {0, 9.55, 8.35}, {0.9, 9.65, 8.05}, 0.28, 0.18), 0.9);  // under the lower lip
  // Lids over the eyeballs
  return SmoothUnion(d, Ellipsoid(p, kBoyEye + Double3{0.02, 0.02, 0}, {2.12, 1.96, 1.98}), 0.6);
}

// Rosy cheeks, freckles, dark hair.
Double3 BoyColor(Double3 q, double ear) {
  constexpr Double3 kSkin = {0.68, 0.46, 0.35}, kFlush = {0.68, 0.33, 0.26}, kHair = {0.10, 0.05, 0.025};
  const double cheek = Bump(Length(q - Double3{4.3, 12.9, 6.6}), 3.0),
               nose = Bump(Length(q - Double3{0, 13.7, 10.0}), 1.8);
  const double arch = 19.95 + 0.25 * Bump(q.x - 3.2, 2.8) - 0.3 * Smooth(4.3, 5.8, q.x);
  const double brow =
      Bump(q.y - arch, 0.7) * Smooth(0.9, 1.7, q.x) * Smooth(5.9, 4.4, q.x) * Smooth(2, 4, q.z);
  const double hair = Smooth(16.0, 20.0, q.y - 0.95 * q.z) * (1 - Smooth(0, 0.6, ear));
  const Double3 skin = Mix(kSkin, kFlush, std::max(0.42 * cheek, 0.4 * nose));
  return Mix(skin, kHair, std::max(0.9 * brow, hair));
}

HeadDesign MakeBoyDesign() {
  HeadDesign d = FaceDesign();
  d.name = "boy";
  d.distance = &BoyDistance;
  d.color = &BoyColor;
  d.lip_color = {0.55, 0.25, 0.22};
  d.iris_color = {0.16, 0.10, 0.04};
  d.guides = {{0.0, 3.0, 4.4, 0.0, -2.0, 0.0, -6.4, 3},     {3.6, 2.6, 4.0, 3.6, -1.6, 4.6, -5.6, 2},
              {6.4, 3.4, 4.4, 7.2, -1.2, 8.2, -6.2, 3},     {7.1, 6.6, 5.3, 8.8, -0.4, 10.0, -7.4, 2},
              {8.2, 7.8, 6.0, 9.8, -0.2, 11.2, -8.2, 2},    {9.2, 8.0, 6.5, 10.8, -0.2, 12.3, -8.8, 6},
              {12.1, 8.5, 7.2, 13.1, -0.3, 14.8, -9.4, 1},  {12.6, 8.8, 7.4, 13.6, -0.3, 15.3, -9.6, 3},
              {13.4, 10.0, 7.6, 14.3, -0.4, 16.0, -9.7, 3}, {14.9, 9.2, 7.9, 15.4, -0.5, 17.2, -9.8, 6},
              {19.0, 8.7, 8.4, 19.0, -0.6, 20.4, -9.8, 2},  {20.3, 9.0, 8.5, 20.3, -0.6, 21.6, -9.6, 2},
              {22.6, 8.8, 8.2, 22.6, -0.7, 23.6, -8.9, 2},  {25.4, 7.2, 6.9, 25.6, -0.7, 26.0, -7.2, 2},
              {27.6, 3.8, 4.2, 27.9, -0.8, 27.7, -4.6, 0}};
  d.half_columns = 22;
  d.even_columns = 11;
  d.column_step = 0.07;
  d.crown_wide = 5;
  d.mouth_row = 12, d.nose_row = 19, d.eye_row = 25;
  d.eye_column0 = 3, d.eye_column1 = 10, d.mouth_column = 6;
  d.brow_column0 = 2, d.brow_column1 = 10;
  d.relaxations = 14;
  d.eye_center = kBoyEye;
  d.eye_radius = 1.75;
  d.iris_size = 1.15;
  d.lid_inner = -1.72, d.lid_span = 3.46;
  d.lid_upper = 0.98, d.lid_lower = 0.74, d.tilt_inner = -0.12, d.tilt_outer = 0.05;
  d.lid_rings = {{{1.13, 1.42, 0.25},
                  {1.05, 1.16, 0.25},
                  {1.0, 1.0, 0.19},
                  {0.985, 0.95, 0.04},
                  {1.01, 1.08, 0.045},
                  {1.02, 1.4, 0.05}}};
  d.mouth_center = {0, 10.7, 8.5};
  d.mouth_half_width = 2.05;
  d.mouth_curve = 0.16;
  d.line_end = -0.10;
  d.upper_height = 0.56, d.upper_notch = 0.10, d.lower_height = 0.68;
  d.lip_fullness = 0.85;
  d.mouth_depth = 0.9;
  d.nostril_depth = 0.7;
  d.ear.column0 = 14, d.ear.column1 = 17, d.ear.row0 = 20, d.ear.row1 = 28;
  d.ear.rings.erase(d.ear.rings.begin() + 5);
  d.ear.rings.erase(d.ear.rings.begin() + 7);
  d.ear.back = FaceDesign().ear.back * 0.92, d.ear.lean = FaceDesign().ear.lean * 0.84;
  d.joints = {{"root", -1, {0, 0, 0}},         {"neck", kRoot, {0, 1.2, -2.2}},
              {"head", kNeck, {0, 9.6, -1.6}}, {"jaw", kHead, kBoyJaw},
              {"eye.L", kHead, kBoyEye},       {"eye.R", kHead, {-kBoyEye.x, kBoyEye.y, kBoyEye.z}}};
  d.regions[kEyeRegion] = Region::At(FaceDesign().eye_center, kBoyEye, {1.34, 1.38, 1.30});
  d.regions[kBrowRegion] = Region::At({3, 20.8, 7.9}, {3.1, 19.9, 7.6}, {1.05, 1.05, 1.05});
  d.regions[kCheekRegion] = Region::At({4.2, 14.8, 6.5}, {4.3, 13.2, 6.1}, {1.0, 0.95, 1.0});
  d.regions[kNoseRegion] = Region::At({0, 14.8, 10.8}, {0, 13.7, 9.8}, {0.85, 0.8, 0.85});
  d.regions[kMouthRegion] = Region::At(kReferenceMouth, d.mouth_center, {0.86, 0.82, 0.9});
  d.regions[kChinRegion] = Region::At({0, 9.0, 8.5}, {0, 8.7, 7.5}, {0.85, 0.8, 0.9});
  d.regions[kThroatRegion] = Region::At({0, 4.2, 3.2}, {0, 3.9, 2.4}, {0.8, 0.85, 0.85});
  d.regions[kJawRegion] = Region::At(kReferenceJaw, kBoyJaw, {0.95, 0.85, 0.95});
  d.regions[kSkullRegion] = Region::At({0, 22, 0}, {0, 21, 0}, {1.05, 1, 1});
  d.production = true;
  d.sheet_row0 = 4.5, d.sheet_row1 = 34;
  return d;
}

}  // namespace

const HeadDesign& BoyDesign() {
  static const HeadDesign design = MakeBoyDesign();
  return design;
}

}  // namespace kpsa::engine::scenes
