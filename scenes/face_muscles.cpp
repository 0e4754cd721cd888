// What lies under the skin of a production's face: muscles, the fascia above them, pads of fat, and a coarse
// cage of the whole head that animators mould as if it were clay. Sheets that wraps follow.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/face_model.h"

namespace kpsa::engine::scenes {
namespace {

constexpr double kUnderSkin = 0.3;  // at least, between the points, too

// The grid of a sheet: rows of the head's grid from `first` to `last`, columns to both sides of the middle.
struct SheetGrid {
  double depth, reach;  // under the skin; radians to each side
  int rows, half;
  double first, last;
};
SheetGrid GridOf(const HeadDesign& d, Sheet sheet) {
  int head_rows = 0;
  for (const GuideRow& guide : d.guides) head_rows += guide.rows;
  switch (sheet) {
    case Sheet::kMuscles:
      return {1.3, 1.85, 10, 5, d.sheet_row0, d.sheet_row1};
    case Sheet::kFascia:
      return {0.75, 1.85, 10, 5, d.sheet_row0, d.sheet_row1};
    case Sheet::kFat:
      return {0.45, 1.85, 9, 4, d.sheet_row0, d.sheet_row1};
    case Sheet::kClay:
      return {1.0, 3.0, 8, 6, 0.6 * d.sheet_row0, head_rows - 1.5};
  }
  return {};
}

// What a muscle does, at places of the reference; those of a side are the left one's.
struct Pull {
  const char* name;
  Sheet sheet;
  bool sides;
  RegionName region;
  Double3 center, radius, delta;
};
constexpr Pull kPulls[] = {
    {"frontalis", Sheet::kFascia, true, kBrowRegion, {2.8, 22.2, 7.8}, {3.4, 3.0, 4.0}, {0.05, 0.55, 0.10}},
    {"corrugator",
     Sheet::kFascia,
     true,
     kBrowRegion,
     {1.6, 20.6, 8.4},
     {2.6, 2.2, 3.0},
     {-0.30, -0.35, 0.25}},
    {"orbicularis", Sheet::kFascia, true, kEyeRegion, {4.2, 17.4, 6.6}, {3.0, 2.4, 3.4}, {-0.20, 0.20, 0.30}},
    {"levator", Sheet::kFascia, true, kNoseRegion, {2.2, 14.8, 8.6}, {2.2, 2.6, 3.0}, {0.10, 0.45, 0.20}},
    {"zygomatic", Sheet::kMuscles, true, kCheekRegion, {4.2, 14.2, 6.4}, {3.2, 3.4, 3.8}, {0.25, 0.40, 0.40}},
    {"risorius", Sheet::kFascia, true, kMouthRegion, {3.8, 11.6, 6.8}, {3.0, 2.6, 3.8}, {0.45, 0.0, -0.20}},
    {"depressor", Sheet::kMuscles, true, kMouthRegion, {2.4, 9.8, 7.6}, {2.4, 2.4, 3.2}, {0.15, -0.45, 0.15}},
    {"buccinator", Sheet::kMuscles, true, kCheekRegion, {4.2, 12.4, 5.6}, {3.2, 3.2, 4.0}, {0.45, 0.0, 0.30}},
    {"masseter", Sheet::kMuscles, true, kJawRegion, {5.2, 11.8, 2.0}, {3.2, 4.0, 4.0}, {0.35, -0.10, 0.05}},
    {"platysma", Sheet::kMuscles, true, kThroatRegion, {3.0, 7.0, 3.6}, {3.2, 3.6, 4.2}, {0.20, -0.35, 0.20}},
    {"mouthRing", Sheet::kFascia, false, kMouthRegion, {0, 11.5, 8.8}, {4.2, 3.4, 4.2}, {0, 0, 0.50}},
    {"mentalis", Sheet::kMuscles, false, kChinRegion, {0, 9.2, 8.2}, {2.8, 2.4, 3.4}, {0, 0.40, 0.20}},
    {"malar", Sheet::kFat, true, kCheekRegion, {4.0, 15.2, 7.0}, {3.4, 3.0, 4.0}, {0.10, 0.30, 0.22}},
    {"buccalPad", Sheet::kFat, true, kCheekRegion, {4.6, 12.6, 5.4}, {3.2, 3.4, 4.2}, {0.30, -0.10, 0.15}},
    {"jowlPad", Sheet::kFat, true, kJawRegion, {4.2, 10.0, 4.2}, {3.2, 3.2, 4.0}, {0.10, -0.25, 0.10}},
    {"browPad", Sheet::kFat, true, kBrowRegion, {3.4, 21.4, 7.6}, {3.4, 2.6, 3.8}, {0.05, 0.25, 0.15}},
    {"lidPad", Sheet::kFat, true, kEyeRegion, {4.0, 16.4, 7.0}, {2.8, 2.2, 3.4}, {0, 0.12, 0.20}},
    {"nasolabial", Sheet::kFat, true, kMouthRegion, {3.0, 13.0, 8.2}, {2.4, 2.6, 3.2}, {0.15, 0.15, 0.25}},
    {"lipPad", Sheet::kFat, false, kMouthRegion, {0, 11.5, 8.8}, {4.2, 3.4, 4.2}, {0, 0, 0.30}},
    {"chinPad", Sheet::kFat, false, kChinRegion, {0, 9.0, 8.4}, {2.8, 2.4, 3.4}, {0, 0.20, 0.15}},
    {"broadCheek", Sheet::kClay, true, kCheekRegion, {5.0, 13.4, 4.0}, {5.0, 6.0, 7.0}, {0.25, 0.10, 0}},
    {"broadJaw", Sheet::kClay, true, kJawRegion, {4.6, 10.0, 2.0}, {4.6, 5.0, 7.0}, {0.20, -0.10, 0}},
    {"temple", Sheet::kClay, true, kSkullRegion, {6.5, 22, 2.0}, {5.0, 6.0, 8.0}, {-0.20, 0.05, 0}},
    {"highBrow", Sheet::kClay, true, kBrowRegion, {3.4, 22.4, 6.0}, {4.6, 5.0, 7.0}, {0, 0.30, 0.05}},
    {"longMuzzle", Sheet::kClay, false, kMouthRegion, {0, 12, 8.0}, {6.0, 6.0, 7.0}, {0, -0.05, 0.30}},
    {"longFace", Sheet::kClay, false, kChinRegion, {0, 9.0, 7.0}, {6.0, 6.0, 8.0}, {0, -0.30, 0}},
    {"highCrown", Sheet::kClay, false, kSkullRegion, {0, 28, 0}, {9.0, 9.0, 9.0}, {0, 0.35, 0}}};

bool InHole(const HeadDesign& d, Double3 p) {
  const double x = std::fabs(p.x);
  const double eye_x = (x - d.eye_center.x) / (0.85 * d.lid_span),
               eye_y = (p.y - d.eye_center.y) / (1.6 * d.eye_radius);
  const double mouth_x = x / (1.35 * d.mouth_half_width), mouth_y = (p.y - d.mouth_center.y) / 1.4;
  return p.z > 0 && (eye_x * eye_x + eye_y * eye_y < 1 || mouth_x * mouth_x + mouth_y * mouth_y < 1);
}

}  // namespace

const char* NameOf(Sheet sheet) {
  constexpr const char* kNames[] = {"muscles", "fascia", "fat", "clay"};
  return kNames[static_cast<std::size_t>(sheet)];
}

SheetShape MakeSheet(const HeadDesign& design, Sheet sheet) {
  const SheetGrid plan = GridOf(design, sheet);
  const int columns = 2 * plan.half + 1;
  std::vector<Double3> grid(static_cast<std::size_t>(plan.rows * columns));
  const auto at = [&](int row, int column) {  // column 0 is the middle
    return static_cast<std::size_t>(row * columns + column + plan.half);
  };
  for (int r = 0; r < plan.rows; ++r) {
    const double row = plan.first + (plan.last - plan.first) * r / (plan.rows - 1);
    for (int c = 0; c <= plan.half; ++c) {
      const Double3 skin = ProjectToHead(design, GuidePlace(design, row, plan.reach * c / plan.half));
      Double3 p = skin - HeadNormal(design, skin) * plan.depth;
      if (c == 0) p.x = 0;
      grid[at(r, c)] = p;
      grid[at(r, -c)] = {-p.x, p.y, p.z};
    }
  }
  SheetShape shape;
  std::vector<int> index(grid.size(), -1);
  const auto use = [&](std::size_t i) {
    if (index[i] < 0) {
      index[i] = static_cast<int>(shape.points.size());
      shape.points.push_back(grid[i]);
    }
    return index[i];
  };
  for (int r = 0; r + 1 < plan.rows; ++r) {
    for (int c = -plan.half; c < plan.half; ++c) {
      const std::size_t corners[] = {at(r, c), at(r, c + 1), at(r + 1, c + 1), at(r + 1, c)};
      Double3 middle;
      for (std::size_t i : corners) middle = middle + grid[i] * 0.25;
      // Nor where the sheet would come out of a hollow of the skin
      bool out = InHole(design, middle) || design.distance(middle) > -kUnderSkin;
      for (int k = 0; k < 4; ++k) {
        const Double3 edge = (grid[corners[k]] + grid[corners[(k + 1) % 4]]) * 0.5;
        out = out || design.distance(edge) > -kUnderSkin || design.distance(grid[corners[k]]) > -kUnderSkin;
      }
      if (out) continue;
      shape.quads.push_back({use(corners[0]), use(corners[1]), use(corners[2]), use(corners[3])});
    }
  }
  for (const Pull& pull : kPulls) {
    if (pull.sheet != sheet) continue;
    const Region& region = design.regions[pull.region];
    for (int side : {1, -1}) {
      if (!pull.sides && side < 0) continue;
      Expression e = {pull.name, {}};
      if (pull.sides) e.name += side > 0 ? ".L" : ".R";
      for (const Double3& p : shape.points) {
        const Double3 own = region.ToReference({side * p.x, p.y, p.z});
        const double w = Ball(own, pull.center, pull.radius) * (pull.sides ? Smooth(-0.9, 0.9, own.x) : 1);
        const Double3 d = region.Scale(pull.delta) * w;
        e.deltas.push_back({side * d.x, d.y, d.z});
      }
      shape.pulls.push_back(std::move(e));
    }
  }
  return shape;
}

}  // namespace kpsa::engine::scenes
