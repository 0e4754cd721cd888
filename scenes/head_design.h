// What one generated head is made from: its implicit surface, the grid of quads around it with the blocks
// that get rings of their own, eyes, mouth, ears, and where the reference's expressions go. FaceDesign is
// that reference: expressions, weights and clips are written down for it. Centimetres, Y up, facing +Z.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/types.h"

namespace kpsa::engine::scenes {

// Joints of a head in the order of its skin. Heads without ears that move end before them.
enum Joint : int { kRoot, kNeck, kHead, kJaw, kEyeL, kEyeR, kEarL, kEarR, kJointCount };
struct JointRest {
  const char* name;
  int parent;
  Double3 position;  // world
};

// A row of the grid where its outline passes the front, the side (x is the half width) and the back; `rows`
// to the next one.
struct GuideRow {
  double front_y, front_z, side_x, side_y, side_z, back_y, back_z;
  int rows;
};

struct LidRing {
  double wide, open, above;  // of the lids' opening; above the eyeball
};

// A ring of an ear: of the flat sort its outline's scale and height in front and behind; of the pointed sort
// the share of the base's width and of the rim's height, in two numbers.
struct EarRing {
  double scale, front_height, back_height;
};

struct EarDesign {
  int column0, column1, row0, row1;  // the block that it grows from
  bool pointed = false;              // a cup that stands up, else a shell beside the head
  std::vector<std::array<double, 2>>
      outline;  // of a shell: backwards, upwards; counter-clockwise from outside
  std::vector<EarRing> rings;
  Double3 shift;            // of its origin from the block's centre
  Double3 back, lean, out;  // axes; a pointed ear's: its opening, its length along its axis, unused
};

// Part of a head: p of the reference is at scale * p + shift here. The reference has 1 and 0.
struct Region {
  Double3 scale = {1, 1, 1}, shift;
  Double3 ToReference(Double3 p) const {
    return {(p.x - shift.x) / scale.x, (p.y - shift.y) / scale.y, (p.z - shift.z) / scale.z};
  }
  Double3 Place(Double3 p) const {
    return {p.x * scale.x + shift.x, p.y * scale.y + shift.y, p.z * scale.z + shift.z};
  }
  Double3 Scale(Double3 d) const { return {d.x * scale.x, d.y * scale.y, d.z * scale.z}; }
  // With the reference's place `from` at `to`.
  static Region At(Double3 from, Double3 to, Double3 scale) {
    return {scale, {to.x - from.x * scale.x, to.y - from.y * scale.y, to.z - from.z * scale.z}};
  }
};
enum RegionName : int {
  kEyeRegion,
  kBrowRegion,
  kCheekRegion,
  kNoseRegion,
  kMouthRegion,
  kChinRegion,
  kThroatRegion,
  kJawRegion,
  kSkullRegion,
  kRegionCount
};

struct HeadDesign {
  std::string name;  // of its files
  double (*distance)(Double3) =
      nullptr;  // approximate and signed; smooth but for its far field; mirrored in x
  Double3 (*color)(Double3, double ear) = nullptr;  // of the skin, linear; x is not negative
  Double3 lip_color, mouth_color, inner_ear_color, iris_color;
  double lip_tint = 0.55;  // of the border of the lips

  // The grid: rows from the neck's edge to the crown, columns around. Column 0 is the middle of the face.
  std::vector<GuideRow> guides;
  int half_columns = 27;
  int even_columns = 13;  // of these, from the middle: even in x, by `column_step` of the half width
  double column_step = 0.058;
  int relaxations = 24;  // of the grid, and ten more
  int crown_wide = 6;    // columns from the middle that meet the crown's front side
  int mouth_row = 16, nose_row = 23, eye_row = 31;  // first rows of the blocks that get rings
  int eye_column0 = 3, eye_column1 = 12, mouth_column = 8;
  int brow_column0 = 2, brow_column1 = 13;  // of the curve; seven rows above the eyes' block

  Double3 eye_center;  // of the left eyeball; the right one is mirrored
  double eye_radius = 1;
  double iris_size = 1;
  double lid_inner = -1.30, lid_span = 2.62;  // x from the eye's centre
  double lid_upper = 0.53, lid_lower = 0.44, tilt_inner = -0.14, tilt_outer = 0.06;
  double lid_fold = 0.07;
  std::array<LidRing, 6> lid_rings = {};

  Double3 mouth_center;
  double mouth_half_width = 1, mouth_curve = 0.12;                // z falls by that times x squared
  double line_middle = -0.05, line_side = 0.05, line_end = 0.07;  // of the line between the lips
  double upper_height = 0.72, upper_notch = 0.14, lower_height = 0.92;
  double lip_fullness = 1, mouth_depth = 1, pocket_narrow = 0.10;
  double nostril_depth = 1;

  EarDesign ear;
  std::vector<JointRest> joints;
  std::array<Region, kRegionCount> regions;

  // A rig as a production's: correctives and in-betweens, more curves, handles and weight maps, muscles.
  bool production = false;
  double sheet_row0 = 0, sheet_row1 = 0;  // of the grid: from the chin to the brows
};

const HeadDesign& FaceDesign();
const HeadDesign& BoyDesign();
const HeadDesign& AnimalDesign();

}  // namespace kpsa::engine::scenes
