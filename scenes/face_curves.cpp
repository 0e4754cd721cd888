// The curves of a head's rig, and where its soft handles sit: vertices near places of the reference.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scenes/face_model.h"

namespace kpsa::engine::scenes {
namespace {

constexpr int kCurveVertices = 9;

class Curves {
 public:
  Curves(const HeadDesign& design, const HeadShape& shape) : design_(design), shape_(shape) {
    text_ = fmt::format(
        "# Written by generate_scenes: the vertices that {}.yaml's wires run along and its soft handles sit "
        "at.\n"
        "kpsa: 1\n"
        "nodes:\n",
        design.name);
  }

  void Curve(const std::string& name, const std::vector<int>& points, const char* parent) {
    text_ += fmt::format("  {}: {{type: curve, mesh: face_mesh, vertices: [{}], parent: {}}}\n", name,
                         fmt::join(points, ", "), parent);
  }
  void Handle(const std::string& name, int point, const char* parent) {
    text_ += fmt::format("  {}: {{type: transform, parent: {}, at: {{vertex: {}, mesh: face_mesh}}}}\n", name,
                         parent, point);
  }
  void Middle(const char* name, RegionName region, Double3 place, const char* parent) {
    Handle(name, Nearest(design_.regions[region].Place(place), {}), parent);
  }
  void Sides(const std::string& name, RegionName region, Double3 place, const char* parent) {
    const int left = Nearest(design_.regions[region].Place(place), {});
    Handle(name + "L", left, parent);
    Handle(name + "R", Mirror(left), parent);
  }
  // Nine vertices near places of the reference, on both sides.
  void CurvePair(const std::string& name, RegionName region, const std::vector<Double3>& places,
                 const char* parent) {
    const std::vector<int> left = AllNearest(region, places);
    Curve(name + "L", left, parent);
    Curve(name + "R", Mirrored(left), parent);
  }
  // From side to side; the places go from the middle to the left.
  void Across(const std::string& name, RegionName region, const std::vector<Double3>& places,
              const char* parent) {
    const std::vector<int> left = AllNearest(region, places);
    std::vector<int> all = Mirrored(left);
    std::reverse(all.begin(), all.end());
    all.insert(all.end(), left.begin() + 1, left.end());
    Curve(name, all, parent);
  }
  // From corner to corner.
  void Lips() {
    const std::vector<int>& ring = shape_.mouth_rings[static_cast<std::size_t>(shape_.border_ring) + 1];
    const int n = static_cast<int>(ring.size()), half = n / 2;
    for (const bool upper : {true, false}) {
      std::vector<int> lip;
      for (int k = 0; k < kCurveVertices; ++k) {
        const int last = kCurveVertices - 1, from_end = std::min(k, last - k);
        const int step = (from_end * half + last / 2) / last, along = k == from_end ? step : half - step;
        lip.push_back(ring[static_cast<std::size_t>(upper ? along : (n - along) % n)]);
      }
      Curve(upper ? "upperLip" : "lowerLip", lip, upper ? "head" : "jaw");
    }
  }
  void Lids() {
    const std::vector<int>& ring = shape_.eye_rings[static_cast<std::size_t>(shape_.lid_ring) - 1];
    const int n = static_cast<int>(ring.size());
    for (const bool upper : {true, false}) {
      std::vector<int> left;
      for (int k = 0; k < kCurveVertices; ++k) {
        const int along = (k * (n / 2) + 4) / (kCurveVertices - 1);
        left.push_back(ring[static_cast<std::size_t>(upper ? along : (n - along) % n)]);
      }
      Curve(upper ? "upperLidL" : "lowerLidL", left, "head");
      Curve(upper ? "upperLidR" : "lowerLidR", Mirrored(left), "head");
    }
  }
  std::string Take() { return std::move(text_); }

 private:
  int Mirror(int i) const { return shape_.mirror[static_cast<std::size_t>(i)]; }
  std::vector<int> Mirrored(std::vector<int> points) const {
    for (int& i : points) i = Mirror(i);
    return points;
  }
  // The point of the skin nearest to `at` that is not in `taken`; one on the middle of the face where `at`
  // is.
  int Nearest(Double3 at, const std::vector<int>& taken) const {
    int best = 0;
    double least = 1e30;
    for (std::size_t i = 0; i < shape_.points.size(); ++i) {
      const double distance = Length(shape_.points[i] - at);
      if (distance >= least || (at.x == 0 && shape_.points[i].x != 0)) continue;
      if (at.x != 0 && !taken.empty() && shape_.points[i].x == 0) continue;
      if (std::find(taken.begin(), taken.end(), static_cast<int>(i)) != taken.end()) continue;
      least = distance;
      best = static_cast<int>(i);
    }
    return best;
  }
  std::vector<int> AllNearest(RegionName region, const std::vector<Double3>& places) const {
    std::vector<int> points;
    for (const Double3& place : places) {
      points.push_back(Nearest(ProjectToHead(design_, design_.regions[region].Place(place)), points));
    }
    return points;
  }

  const HeadDesign& design_;
  const HeadShape& shape_;
  std::string text_;
};

}  // namespace

std::string CurvesYaml(const HeadDesign& design, const HeadShape& shape) {
  Curves curves(design, shape);
  if (design.production) {
    curves.Lips();
  } else {
    curves.Curve("upperLip", shape.upper_lip_curve, "head");
    curves.Curve("lowerLip", shape.lower_lip_curve, "jaw");
  }
  curves.Curve("browL", shape.brow_curve_left, "head");
  curves.Curve("browR", shape.brow_curve_right, "head");
  curves.Middle("nose", kNoseRegion, {0, 14.8, 11.6}, "head");
  curves.Middle("chin", kChinRegion, {0, 8.9, 8.8}, "jaw");
  curves.Sides("cheek", kCheekRegion, {4.4, 14.6, 6.8}, "head");
  if (!design.production) return curves.Take();
  curves.Lids();
  curves.CurvePair("cheekLine", kCheekRegion,
                   {{1.9, 15.6, 8.4},
                    {2.5, 15.5, 8.1},
                    {3.1, 15.5, 7.7},
                    {3.7, 15.6, 7.3},
                    {4.3, 15.8, 6.8},
                    {4.8, 16.0, 6.2},
                    {5.3, 16.3, 5.4},
                    {5.7, 16.6, 4.6},
                    {6.1, 16.9, 3.8}},
                   "head");
  curves.CurvePair("fold", kMouthRegion,
                   {{1.7, 14.2, 9.2},
                    {2.2, 13.7, 9.0},
                    {2.7, 13.1, 8.7},
                    {3.1, 12.5, 8.4},
                    {3.4, 11.9, 8.2},
                    {3.5, 11.2, 8.0},
                    {3.3, 10.5, 7.8},
                    {3.0, 9.8, 7.7},
                    {2.5, 9.2, 7.7}},
                   "head");
  curves.Across("jawLine", kJawRegion,
                {{0, 8.0, 8.0}, {1.5, 8.3, 7.4}, {2.8, 8.9, 6.2}, {4.0, 9.9, 4.6}, {4.9, 11.2, 2.8}}, "jaw");
  curves.Across("forehead", kBrowRegion,
                {{0, 23.4, 8.9}, {1.6, 23.4, 8.6}, {3.1, 23.3, 8.0}, {4.5, 23.2, 6.9}, {5.6, 23.0, 5.4}},
                "head");
  curves.Sides("jowl", kJawRegion, {4.6, 10.6, 4.2}, "jaw");
  curves.Sides("temple", kBrowRegion, {6.0, 20.6, 3.8}, "head");
  curves.Sides("bag", kEyeRegion, {3.4, 17.0, 7.8}, "head");
  curves.Sides("puff", kCheekRegion, {4.4, 12.6, 6.0}, "head");
  curves.Middle("glabella", kBrowRegion, {0, 20.4, 9.0}, "head");
  curves.Middle("throat", kThroatRegion, {0, 4.4, 3.2}, "neck");
  return curves.Take();
}

}  // namespace kpsa::engine::scenes
