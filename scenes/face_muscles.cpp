// The muscles of a production's face, and the fascia above them: sheets under the skin that proximityWraps
// follow.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/face_model.h"

namespace kpsa::scenes {
namespace {

constexpr int kMuscleRows = 12, kMuscleHalf = 6, kMuscleColumns = 2 * kMuscleHalf + 1;
constexpr double kMuscleReach = 1.85;                      // radians to each side
constexpr double kFasciaDepth = 0.75, kMuscleDepth = 1.3;  // under the skin
constexpr double kUnderSkin = 0.3;                         // at least, between the points, too

// What a muscle does, at places of the reference; those of a side are the left one's.
struct Pull {
  const char* name;
  bool deep, sides;
  RegionName region;
  Double3 center, radius, delta;
};
constexpr Pull kPulls[] = {
    {"frontalis", false, true, kBrowRegion, {2.8, 22.2, 7.8}, {3.4, 3.0, 4.0}, {0.05, 0.55, 0.10}},
    {"corrugator", false, true, kBrowRegion, {1.6, 20.6, 8.4}, {2.6, 2.2, 3.0}, {-0.30, -0.35, 0.25}},
    {"orbicularis", false, true, kEyeRegion, {4.2, 17.4, 6.6}, {3.0, 2.4, 3.4}, {-0.20, 0.20, 0.30}},
    {"levator", false, true, kNoseRegion, {2.2, 14.8, 8.6}, {2.2, 2.6, 3.0}, {0.10, 0.45, 0.20}},
    {"zygomatic", true, true, kCheekRegion, {4.2, 14.2, 6.4}, {3.2, 3.4, 3.8}, {0.25, 0.40, 0.40}},
    {"risorius", false, true, kMouthRegion, {3.8, 11.6, 6.8}, {3.0, 2.6, 3.8}, {0.45, 0.0, -0.20}},
    {"depressor", true, true, kMouthRegion, {2.4, 9.8, 7.6}, {2.4, 2.4, 3.2}, {0.15, -0.45, 0.15}},
    {"buccinator", true, true, kCheekRegion, {4.2, 12.4, 5.6}, {3.2, 3.2, 4.0}, {0.45, 0.0, 0.30}},
    {"masseter", true, true, kJawRegion, {5.2, 11.8, 2.0}, {3.2, 4.0, 4.0}, {0.35, -0.10, 0.05}},
    {"platysma", true, true, kThroatRegion, {3.0, 7.0, 3.6}, {3.2, 3.6, 4.2}, {0.20, -0.35, 0.20}},
    {"mouthRing", false, false, kMouthRegion, {0, 11.5, 8.8}, {4.2, 3.4, 4.2}, {0, 0, 0.50}},
    {"mentalis", true, false, kChinRegion, {0, 9.2, 8.2}, {2.8, 2.4, 3.4}, {0, 0.40, 0.20}}};

bool InHole(const HeadDesign& d, Double3 p) {
  const double x = std::fabs(p.x);
  const double eye_x = (x - d.eye_center.x) / (0.85 * d.lid_span),
               eye_y = (p.y - d.eye_center.y) / (1.6 * d.eye_radius);
  const double mouth_x = x / (1.35 * d.mouth_half_width), mouth_y = (p.y - d.mouth_center.y) / 1.4;
  return p.z > 0 && (eye_x * eye_x + eye_y * eye_y < 1 || mouth_x * mouth_x + mouth_y * mouth_y < 1);
}

}  // namespace

MuscleShape MakeMuscles(const HeadDesign& design, bool deep) {
  std::vector<Double3> grid(kMuscleRows * kMuscleColumns);
  const auto at = [](int row, int column) {  // column 0 is the middle
    return static_cast<std::size_t>(row * kMuscleColumns + column + kMuscleHalf);
  };
  for (int r = 0; r < kMuscleRows; ++r) {
    const double row = design.muscle_row0 + (design.muscle_row1 - design.muscle_row0) * r / (kMuscleRows - 1);
    for (int c = 0; c <= kMuscleHalf; ++c) {
      const Double3 skin = ProjectToHead(design, GuidePlace(design, row, kMuscleReach * c / kMuscleHalf));
      Double3 p = skin - HeadNormal(design, skin) * (deep ? kMuscleDepth : kFasciaDepth);
      if (c == 0) p.x = 0;
      grid[at(r, c)] = p;
      grid[at(r, -c)] = {-p.x, p.y, p.z};
    }
  }
  MuscleShape shape;
  std::vector<int> index(grid.size(), -1);
  const auto use = [&](std::size_t i) {
    if (index[i] < 0) {
      index[i] = static_cast<int>(shape.points.size());
      shape.points.push_back(grid[i]);
    }
    return index[i];
  };
  for (int r = 0; r + 1 < kMuscleRows; ++r) {
    for (int c = -kMuscleHalf; c < kMuscleHalf; ++c) {
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
    if (pull.deep != deep) continue;
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

}  // namespace kpsa::scenes
