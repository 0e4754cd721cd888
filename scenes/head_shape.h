// The shape of the generated head: a grid of quads around a smooth implicit surface, with rings of their own
// around eyes, mouth, nostrils and ears. Everything here is in centimetres, Y up, facing +Z, symmetric about
// x = 0 exactly; the character's left (.L) is +x. Only IEEE arithmetic and base/scalar_math.h: the same bits
// everywhere.
#pragma once

#include <array>
#include <vector>

#include "base/types.h"
#include "scenes/head_design.h"

namespace kpsa::engine::scenes {

struct HeadShape {
  std::vector<Double3> points;
  std::vector<std::array<int, 4>> quads;  // counter-clockwise from outside
  std::vector<int> mirror;                // the point at (-x, y, z)
  // Rings from outside to inside; an entry is a point. The eye rings are of the left eye; first the inner
  // corner, then along the upper lid to the outer corner, back along the lower lid. The mouth rings start at
  // the corner at -x, go along the upper lip to +x, and back along the lower lip.
  std::vector<std::vector<int>> eye_rings, mouth_rings;
  int lid_ring = 0;         // of eye_rings: the outer edge of the lid
  int border_ring = 0;      // of mouth_rings: where skin becomes lip
  int contact_ring = 0;     // of mouth_rings: where the lips meet
  std::vector<double> lip;  // a point: +1 upper lip, -1 lower lip, 0 the corners and outside the mouth rings
  std::vector<double> ear;  // a point: 0 .. 1, how far it belongs to an ear's shell
  std::vector<bool> ear_inside;                        // a point: within the rim of an ear
  std::vector<int> upper_lip_curve, lower_lip_curve;   // from -x to +x
  std::vector<int> brow_curve_left, brow_curve_right;  // from the middle outwards
};

HeadShape MakeHeadShape(const HeadDesign& design);
// The place of the grid at a row, which may lie between two, and an angle from the middle of the face; not on
// the surface.
Double3 GuidePlace(const HeadDesign& design, double row, double angle);

// The nearest point of the skin along the distance's gradient, and the outward normal.
Double3 ProjectToHead(const HeadDesign& design, Double3 p);
Double3 HeadNormal(const HeadDesign& design, Double3 p);

// A closed eyeball about the origin, looking along +Z: an iris dish with a pupil sunk into a sphere. Quads as
// above.
struct EyeShape {
  std::vector<Double3> points;
  std::vector<std::array<int, 4>> quads;  // a triangle repeats its last point
  std::vector<int> part;                  // a point: 0 white, 1 iris, 2 pupil
};
EyeShape MakeEyeShape(const HeadDesign& design);

// Helpers that the other generators share.
inline constexpr Double3 kReferenceJaw = {0, 14.4, 0.6};     // the reference's jaw joint
inline constexpr Double3 kReferenceMouth = {0, 11.55, 9.3};  // the middle of its mouth
inline Double3 Mix(Double3 a, Double3 b, double t) { return a * (1 - t) + b * t; }
double Smooth(double edge0, double edge1, double x);  // smoothstep; the edges may fall
double Bump(double x, double half_width);  // 1 at 0, 0 from |x| = half_width on, twice differentiable

}  // namespace kpsa::engine::scenes
