// The reference: a grown-up's face.
#include <cmath>

#include "scenes/head_shape.h"
#include "scenes/implicit.h"

namespace kpsa::engine::scenes {
namespace {

constexpr Double3 kFaceEye = {3.2, 18.6, 6.62};

double FaceDistance(Double3 p) {
  p.x = std::sqrt(p.x * p.x + 1e-6);  // mirrored, without a crease
  // Skull, face, jaw
  double d = Ellipsoid(p, {0, 21.6, -1.1}, {7.5, 8.5, 9.4});
  d = SmoothUnion(d, Ellipsoid(p, {0, 21.6, 3.7}, {6.2, 5.7, 5.9}), 2.0);            // forehead
  d = SmoothUnion(d, Ellipsoid(p, {0, 15.4, 2.6}, {5.6, 6.2, 6.0}), 2.2);            // mid face
  d = SmoothUnion(d, Ellipsoid(p, {0, 11.6, 3.4}, {4.9, 4.0, 5.2}), 2.0);            // jaw
  d = SmoothUnion(d, Cone(p, {5.0, 13.6, -0.2}, {1.6, 8.7, 6.2}, 1.25, 1.15), 2.0);  // jaw line
  d = SmoothUnion(d, Ellipsoid(p, {0, 8.75, 7.0}, {1.85, 1.45, 1.75}), 1.5);         // chin
  d = SmoothUnion(d, Ellipsoid(p, {4.25, 16.15, 5.35}, {1.75, 1.4, 1.6}), 2.0);      // cheek bone
  d = SmoothUnion(d, Ellipsoid(p, {3.5, 13.3, 5.6}, {1.9, 2.1, 1.7}), 1.8);          // cheek
  // Neck
  d = SmoothUnion(d, Cone(p, {0, -4, -2.9}, {0, 11, -1.5}, 5.4, 4.55), 2.4);
  d = SmoothUnion(d, Cone(p, {0.9, -1, 1.5}, {5.2, 13.5, -2.6}, 0.7, 0.7), 1.8);  // sternomastoid
  d = SmoothUnion(d, Ellipsoid(p, {0, 4.4, 2.5}, {0.8, 1.2, 0.6}), 1.4);          // larynx
  d = SmoothUnion(d, Cone(p, {3.4, -5, -4.4}, {1.9, 12, -5.2}, 2.2, 1.3), 2.6);   // trapezius
  // Eye sockets, brows
  d = SmoothCut(d, Ellipsoid(p, {3.1, 18.65, 9.0}, {2.1, 1.35, 1.75}), 1.6);
  d = SmoothCut(d, Ellipsoid(p, {1.45, 18.9, 9.2}, {0.9, 1.2, 1.1}), 1.2);
  d = SmoothUnion(d, Cone(p, {1.3, 20.25, 7.85}, {4.9, 20.5, 5.9}, 0.72, 0.62), 1.3);
  d = SmoothUnion(d, Ellipsoid(p, {0, 20.7, 7.9}, {1.6, 0.9, 1.1}), 1.4);
  d = SmoothCut(d, Ellipsoid(p, {7.9, 20.3, 3.4}, {1.4, 2.4, 2.4}), 2.0);  // temple
  // Nose
  d = SmoothUnion(d, Cone(p, {0, 19.2, 7.85}, {0, 15.3, 10.0}, 0.60, 0.84), 1.3);
  d = SmoothUnion(d, Ellipsoid(p, {0, 14.95, 10.3}, {0.98, 0.82, 0.9}), 0.7);
  d = SmoothUnion(d, Ellipsoid(p, {1.15, 14.55, 9.45}, {0.66, 0.68, 0.95}), 0.9);  // wing
  d = SmoothUnion(d, Cone(p, {0, 14.2, 10.3}, {0, 13.9, 9.2}, 0.35, 0.45), 0.6);   // columella
  // Mouth
  d = SmoothUnion(d, Ellipsoid(p, {0, 11.75, 7.0}, {3.3, 2.5, 2.5}), 1.4);
  d = SmoothCut(d, Cone(p, {0, 13.6, 9.75}, {0, 12.5, 9.85}, 0.28, 0.26), 0.45);   // philtrum
  d = SmoothCut(d, Cone(p, {0, 9.95, 9.35}, {1.2, 10.1, 8.95}, 0.32, 0.2), 0.9);   // under the lower lip
  d = SmoothCut(d, Cone(p, {2.1, 14.0, 9.3}, {3.5, 11.7, 8.2}, 0.14, 0.20), 1.0);  // fold beside the mouth
  // Lids over the eyeballs
  d = SmoothUnion(d, Ellipsoid(p, kFaceEye + Double3{0.02, 0.02, 0}, {1.60, 1.44, 1.47}), 0.6);
  return d;
}

// Skin with a flush on cheeks and nose, darker brows.
Double3 FaceColor(Double3 q, double) {
  constexpr Double3 kSkin = {0.62, 0.43, 0.34}, kFlush = {0.62, 0.34, 0.27}, kBrow = {0.11, 0.07, 0.05};
  const double cheek = Bump(Length(q - Double3{4.3, 15.2, 6.6}), 2.8),
               nose = Bump(Length(q - Double3{0, 14.8, 11.0}), 1.8);
  const double arch = 20.62 + 0.32 * Bump(q.x - 3.7, 2.4) - 0.25 * Smooth(4.2, 5.6, q.x);  // the brow's line
  const double brow =
      Bump(q.y - arch, 0.60) * Smooth(0.7, 1.6, q.x) * Smooth(5.7, 4.0, q.x) * Smooth(2, 4, q.z);
  return Mix(Mix(kSkin, kFlush, std::max(0.30 * cheek, 0.35 * nose)), kBrow, 0.9 * brow);
}

HeadDesign MakeFaceDesign() {
  HeadDesign d;
  d.name = "face";
  d.distance = &FaceDistance;
  d.color = &FaceColor;
  d.lip_color = {0.50, 0.21, 0.19};
  d.mouth_color = {0.25, 0.07, 0.06};
  d.iris_color = {0.10, 0.20, 0.28};
  d.guides = {{0.0, 3.9, 5.9, 0.0, -2.4, 0.0, -7.8, 4},       {4.0, 3.5, 5.3, 4.0, -2.0, 5.0, -6.8, 3},
              {7.0, 4.4, 5.3, 7.6, -1.4, 8.6, -7.0, 4},       {7.35, 7.6, 5.7, 9.4, -0.6, 10.6, -7.6, 2},
              {8.6, 8.7, 6.0, 10.6, -0.3, 12.0, -8.2, 3},     {10.0, 8.6, 6.2, 11.9, -0.2, 13.3, -8.9, 6},
              {13.1, 9.3, 6.7, 14.3, -0.4, 15.9, -9.8, 1},    {13.7, 9.6, 6.8, 14.9, -0.5, 16.5, -10.0, 3},
              {14.35, 11.2, 6.9, 15.8, -0.6, 17.4, -10.2, 5}, {17.0, 10.0, 7.1, 17.4, -0.8, 19.2, -10.4, 6},
              {20.2, 8.9, 7.2, 20.2, -1.0, 21.9, -10.3, 2},   {21.3, 9.0, 7.3, 21.3, -1.1, 23.0, -10.0, 3},
              {23.6, 8.8, 7.3, 23.6, -1.2, 24.8, -9.4, 3},    {26.6, 7.2, 6.5, 26.6, -1.3, 27.2, -7.8, 3},
              {28.9, 3.4, 3.9, 29.2, -1.3, 29.1, -5.2, 0}};
  d.eye_center = kFaceEye;
  d.eye_radius = 1.27;
  d.lid_rings = {{{1.16, 1.62, 0.20},
                  {1.05, 1.22, 0.20},
                  {1.0, 1.0, 0.15},
                  {0.985, 0.94, 0.03},
                  {1.01, 1.1, 0.035},
                  {1.02, 1.7, 0.04}}};
  d.mouth_center = {0, 11.55, 9.3};
  d.mouth_half_width = 2.5;
  d.ear.column0 = 17, d.ear.column1 = 20, d.ear.row0 = 25, d.ear.row1 = 35;
  d.ear.outline = {{-0.15, -2.55}, {0.55, -3.0}, {1.25, -2.5}, {1.75, -1.35}, {2.3, -0.1}, {2.65, 1.2},
                   {2.45, 2.4},    {1.6, 3.15},  {0.6, 3.1},   {-0.2, 2.2},   {-0.4, 0.9}, {-0.45, -0.9}};
  d.ear.rings = {{0.60, -0.05, 0.05}, {0.72, 0.12, 0.55}, {0.97, 0.22, 1.0},  {1.0, 0.36, 1.22},
                 {0.90, 0.42, 1.30},  {0.80, 0.26, 1.02}, {0.66, 0.22, 0.92}, {0.52, 0.24, 0.98},
                 {0.38, 0.0, 0.62},   {0.22, -0.18, 0.18}};
  d.ear.shift = {-0.15, 0.1, 0.5};
  d.ear.back = {0.27, 0.05, -0.962}, d.ear.lean = {0.09, 0.975, -0.20}, d.ear.out = {0.96, -0.05, 0.27};
  d.joints = {{"root", -1, {0, 0, 0}},          {"neck", kRoot, {0, 1.5, -2.6}},
              {"head", kNeck, {0, 10.5, -2.0}}, {"jaw", kHead, kReferenceJaw},
              {"eye.L", kHead, kFaceEye},       {"eye.R", kHead, {-kFaceEye.x, kFaceEye.y, kFaceEye.z}}};
  return d;
}

}  // namespace

const HeadDesign& FaceDesign() {
  static const HeadDesign design = MakeFaceDesign();
  return design;
}

}  // namespace kpsa::engine::scenes
