// The expressions of the face as displacements. Those of a side are made for the left (+x) and mirrored.
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/scalar_math.h"
#include "scenes/face_model.h"

namespace kpsa::engine::scenes {

double Ball(Double3 p, Double3 center, Double3 radius) {
  const Double3 d = p - center;
  const double t = d.x * d.x / (radius.x * radius.x) + d.y * d.y / (radius.y * radius.y) +
                   d.z * d.z / (radius.z * radius.z);
  if (t >= 1) return 0;
  return (1 - t) * (1 - t) * (1 - t) * (1 + 1.2 * t);
}

namespace {

constexpr Double3 kCorner = {2.55, 11.48, 8.5};  // of the mouth

// What the formulas know of a point: its place in the reference.
struct Point {
  Double3 p;
  double upper;  // 1 above the mouth's line, 0 below; lips know their side
  double left;   // 1 on the character's left, 0 on the right, soft in the middle
  double ear;
  double inside;  // 0 on the skin .. 1 deep in the mouth
};

class Maker {
 public:
  Maker(const HeadDesign& design, const HeadShape& shape) : design_(design), shape_(shape) {
    for (std::size_t i = 0; i < shape.points.size(); ++i) {
      const Double3 p = design.regions[kMouthRegion].ToReference(shape.points[i]);
      points_.push_back({p, Smooth(kReferenceMouth.y - 0.7, kReferenceMouth.y + 0.7, p.y),
                         Smooth(-0.9, 0.9, p.x), shape.ear[i], 0});
    }
    for (std::size_t ring = 1; ring < shape.mouth_rings.size(); ++ring) {
      const double inner = Smooth(0, shape.border_ring - 1, static_cast<double>(ring));
      for (int point : shape.mouth_rings[ring]) {
        const auto i = static_cast<std::size_t>(point);
        points_[i].upper += (0.5 + 0.5 * shape.lip[i] - points_[i].upper) * inner;
        points_[i].inside = Smooth(shape.contact_ring - 1, static_cast<double>(shape.mouth_rings.size()),
                                   static_cast<double>(ring));
      }
    }
  }

  using Formula = std::function<Double3(const Point&)>;

  void Center(const std::string& name, RegionName region, const Formula& formula) {
    expressions_.push_back({name, Deltas(region, formula)});
  }

  // name.L by the formula, name.R by its mirror image.
  void Pair(const std::string& name, RegionName region, const Formula& formula) {
    PairOf(name, {"", Deltas(region, formula)});
  }

  void PairOf(const std::string& name, Expression left) {
    left.name = name + ".L";
    Expression right = {name + ".R", std::vector<Double3>(left.deltas.size())};
    for (std::size_t i = 0; i < left.deltas.size(); ++i) {
      const Double3 d = left.deltas[static_cast<std::size_t>(shape_.mirror[i])];
      right.deltas[i] = {-d.x, d.y, d.z};
    }
    expressions_.push_back(std::move(left));
    expressions_.push_back(std::move(right));
  }

  // The formula at the places that the points of a region have in the reference.
  std::vector<Double3> Deltas(RegionName name, const Formula& formula) const {
    const Region& region = design_.regions[name];
    std::vector<Double3> deltas;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      Point point = points_[i];
      point.p = region.ToReference(shape_.points[i]);
      deltas.push_back(region.Scale(formula(point)));
    }
    return deltas;
  }
  Expression Lids(double close_upper, double close_lower) const;
  void Eyes();
  void Brows();
  void Cheeks();
  void Lips();
  void Others();
  void Inbetweens();
  void Combinations();
  void Poses();
  std::vector<Expression> Take() { return std::move(expressions_); }

 private:
  const HeadDesign& design_;
  const HeadShape& shape_;
  std::vector<Point> points_;
  std::vector<Expression> expressions_;
};

// The left lids towards each other (1, 0: the upper one comes down to the lower one; negative: open wider).
// Points go around the eyeball, never through it.
Expression Maker::Lids(double close_upper, double close_lower) const {
  Expression e = {"", std::vector<Double3>(points_.size())};
  const int n = static_cast<int>(shape_.eye_rings[0].size());
  const std::vector<int>& edge = shape_.eye_rings[static_cast<std::size_t>(shape_.lid_ring)];
  for (std::size_t ring = 1; ring < shape_.eye_rings.size(); ++ring) {
    const double share = Smooth(0.5, shape_.lid_ring - 0.8, static_cast<double>(ring));
    for (int k = 0; k < n; ++k) {
      const auto i = static_cast<std::size_t>(shape_.eye_rings[ring][static_cast<std::size_t>(k)]);
      const Double3 from = shape_.points[static_cast<std::size_t>(edge[static_cast<std::size_t>(k)])];
      const Double3 to = shape_.points[static_cast<std::size_t>(edge[static_cast<std::size_t>((n - k) % n)])];
      const bool upper = k <= n / 2;
      Double3 d = (to - from) * ((upper ? close_upper : close_lower) * share);
      const Double3 p = shape_.points[i];
      const Double3 target = p + d - design_.eye_center;
      const double least = design_.eye_radius + (static_cast<int>(ring) > shape_.lid_ring ? 0.06 : 0.20);
      const double radius = Length(target);
      if (radius < least && Length(d) > 0) d = design_.eye_center + target * (least / radius) - p;
      e.deltas[i] = d;
    }
  }
  return e;
}

void Maker::Eyes() {
  PairOf("blink", Lids(0.95, 0.06));
  PairOf("eyeWide", Lids(-0.22, -0.10));
  Expression squint = Lids(0.18, 0.34);
  const std::vector<Double3> cheek = Deltas(kEyeRegion, [](const Point& q) {
    return Double3{-0.05, 0.28, 0.10} * (Ball(q.p, {3.9, 16.9, 7.2}, {2.4, 1.5, 2.4}) * (1 - q.ear));
  });
  for (std::size_t i = 0; i < cheek.size(); ++i) squint.deltas[i] = squint.deltas[i] + cheek[i];
  PairOf("squint", std::move(squint));
}

void Maker::Brows() {
  Pair("browInnerUp", kBrowRegion, [](const Point& q) {
    return Double3{-0.05, 0.75, 0.06} * (Ball(q.p, {1.3, 21.2, 8.4}, {2.4, 2.5, 2.6}) * q.left);
  });
  Pair("browOuterUp", kBrowRegion, [](const Point& q) {
    return Double3{0.0, 0.85, -0.10} * (Ball(q.p, {4.6, 21.3, 6.9}, {2.6, 2.6, 3.0}) * q.left);
  });
  Pair("browDown", kBrowRegion, [](const Point& q) {
    return Double3{-0.42, -0.62, 0.20} * (Ball(q.p, {2.5, 20.8, 8.2}, {3.0, 2.0, 3.0}) * q.left);
  });
}

void Maker::Cheeks() {
  Pair("cheekPuff", kCheekRegion, [](const Point& q) {
    const double w = Ball(q.p, {4.0, 12.6, 6.2}, {3.2, 3.0, 3.6}) * q.left * (1 - 0.8 * q.inside);
    return Double3{0.75, 0.0, 0.50} * w;
  });
  Pair("cheekSuck", kCheekRegion, [](const Point& q) {
    return Double3{-0.55, 0.0, -0.30} *
           (Ball(q.p, {4.4, 12.8, 5.6}, {2.3, 2.4, 3.0}) * q.left * (1 - q.inside));
  });
  Pair("cheekRaise", kCheekRegion, [](const Point& q) {
    return Double3{0.08, 0.55, 0.30} * (Ball(q.p, {4.2, 15.6, 6.6}, {2.5, 2.3, 3.0}) * q.left * (1 - q.ear));
  });
  Pair("sneer", kNoseRegion, [](const Point& q) {
    const double wing = Ball(q.p, {1.35, 14.9, 9.4}, {1.6, 1.9, 2.2});
    const double lip = Ball(q.p, {1.6, 12.6, 9.2}, {1.7, 1.6, 2.2}) * q.upper * (1 - q.inside);
    return (Double3{0.14, 0.45, -0.12} * wing + Double3{0.08, 0.42, 0.05} * lip) * q.left;
  });
  Pair("nostrilFlare", kNoseRegion, [](const Point& q) {
    return Double3{0.34, 0.06, -0.05} * (Ball(q.p, {1.5, 14.5, 9.7}, {1.25, 1.4, 1.7}) * q.left);
  });
}

void Maker::Lips() {
  Pair("smile", kMouthRegion, [](const Point& q) {
    const double corner = Ball(q.p, kCorner, {3.0, 2.5, 3.4}),
                 cheek = Ball(q.p, {4.1, 14.9, 6.6}, {2.4, 2.3, 3.0});
    return (Double3{0.80, 0.70, -0.68} * corner + Double3{0.20, 0.32, 0.28} * cheek) * (q.left * (1 - q.ear));
  });
  Pair("frown", kMouthRegion, [](const Point& q) {
    return Double3{0.22, -0.85, -0.22} * (Ball(q.p, kCorner + Double3{0, -0.3, 0}, {2.7, 2.4, 3.2}) * q.left);
  });
  Pair("stretch", kMouthRegion, [](const Point& q) {
    return Double3{0.95, -0.18, -0.80} *
           (Ball(q.p, kCorner + Double3{0.1, -0.2, 0}, {3.1, 2.6, 3.4}) * q.left);
  });
  Pair("dimple", kMouthRegion, [](const Point& q) {
    return Double3{0.30, 0.12, -0.55} *
           (Ball(q.p, kCorner + Double3{0.35, 0.1, -0.1}, {1.7, 1.5, 2.2}) * q.left);
  });
  Pair("lipUpperUp", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {1.1, 12.2, 9.4}, {2.1, 1.9, 2.6}) * q.upper;
    return Double3{0.05, 0.62, 0.10} * (w * q.left * (1 - 0.7 * q.inside));
  });
  Pair("lipLowerDown", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {1.1, 10.9, 9.2}, {2.2, 2.1, 2.6}) * (1 - q.upper);
    return Double3{0.06, -0.68, 0.04} * (w * q.left * (1 - 0.7 * q.inside));
  });
  Center("mouthOpen", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.3, 8.6}, {4.2, 4.6, 4.6});
    const double up = q.upper * 0.28, down = (1 - q.upper) * -1.25;
    return Double3{-0.06 * q.p.x, up + down, -0.10} * w;
  });
  Center("pucker", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.5, 8.8}, {4.0, 2.9, 3.8});
    return Double3{-0.42 * q.p.x, (11.5 - q.p.y) * 0.06, 0.75 - 0.02 * q.p.x * q.p.x} * w;
  });
  Center("funnel", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.5, 8.8}, {4.0, 3.2, 3.8});
    return Double3{-0.26 * q.p.x, q.upper * 0.55 - (1 - q.upper) * 0.65, 0.62} * w;
  });
  Center("lipPress", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.5, 9.1}, {3.4, 1.7, 2.4}) * (1 - q.inside);
    return Double3{0.03 * q.p.x, (kReferenceMouth.y - q.p.y) * 0.34, -0.26} * w;
  });
  Center("lipUpperRoll", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 12.0, 9.5}, {3.0, 1.3, 2.0}) * q.upper;
    return Double3{0, -0.26, -0.46} * w;
  });
  Center("lipLowerRoll", kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.0, 9.3}, {3.0, 1.4, 2.0}) * (1 - q.upper);
    return Double3{0, 0.26, -0.50} * w;
  });
  Center("mouthLeft", kMouthRegion, [](const Point& q) {
    return Double3{0.95, 0.05, -0.06 * q.p.x} * Ball(q.p, {0, 11.4, 8.7}, {4.6, 3.0, 3.6});
  });
  Center("mouthRight", kMouthRegion, [](const Point& q) {
    return Double3{-0.95, 0.05, 0.06 * q.p.x} * Ball(q.p, {0, 11.4, 8.7}, {4.6, 3.0, 3.6});
  });
}

void Maker::Others() {
  Center("chinUp", kChinRegion, [](const Point& q) {
    const double chin = Ball(q.p, {0, 9.2, 8.4}, {2.6, 2.3, 3.0});
    const double lip = Ball(q.p, {0, 10.9, 9.3}, {2.6, 1.5, 2.4}) * (1 - q.upper);
    return Double3{0, 0.50, 0.16} * chin + Double3{0, 0.22, 0.18} * lip;
  });
  Center("jawForward", kJawRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 9.6, 7.0}, {5.4, 5.0, 6.0}) * (1 - q.upper);
    return Double3{0, -0.05, 0.72} * w;
  });
  Center("swallow", kThroatRegion, [](const Point& q) {
    return Double3{0, 0.85, 0.22} * Ball(q.p, {0, 4.2, 3.4}, {2.3, 3.2, 2.8});
  });
  Pair("neckTense", kThroatRegion, [](const Point& q) {
    const double band = Ball(q.p, {3.4, 5.0, 1.8}, {2.0, 5.4, 3.4});
    return Double3{0.32, -0.10, 0.36} * (band * q.left * Smooth(0, 2.5, q.p.y));
  });
}

constexpr const char* kInbetween = "_half";
constexpr const char* kCombination = "_and_";
constexpr const char* kPose = "_pose";

// Shapes on the way, at a weight of one half: lids go around the eyeball, corners of the mouth outwards
// first.
void Maker::Inbetweens() {
  const auto half = [](const char* name) { return std::string(name) + kInbetween; };
  PairOf(half("blink"), Lids(0.475, 0.03));
  Pair(half("smile"), kMouthRegion, [](const Point& q) {
    const double corner = Ball(q.p, kCorner, {3.0, 2.5, 3.4});
    return Double3{0.52, 0.20, -0.30} * (corner * q.left * (1 - q.ear));
  });
  Pair(half("cheekPuff"), kCheekRegion, [](const Point& q) {
    const double w = Ball(q.p, {3.7, 12.2, 6.4}, {2.9, 2.6, 3.4}) * q.left * (1 - 0.8 * q.inside);
    return Double3{0.30, 0.0, 0.36} * w;
  });
  Center(half("mouthOpen"), kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.3, 8.6}, {4.2, 4.6, 4.6});
    return Double3{-0.06 * q.p.x, q.upper * 0.20 + (1 - q.upper) * -0.52, 0.02} * w;
  });
  Center(half("pucker"), kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.5, 8.8}, {4.0, 2.9, 3.8});
    return Double3{-0.26 * q.p.x, (11.5 - q.p.y) * 0.02, 0.28} * w;
  });
}

// What two expressions need besides their sum.
void Maker::Combinations() {
  const auto both = [](const char* a, const char* b) { return std::string(a) + kCombination + b; };
  Pair(both("smile", "mouthOpen"), kMouthRegion, [](const Point& q) {
    const double corner = Ball(q.p, kCorner, {2.4, 2.2, 3.0});
    return Double3{-0.24, -0.20, 0.16} * (corner * q.left * (1 - q.ear));
  });
  Pair(both("smile", "blink"), kCheekRegion, [](const Point& q) {
    const double cheek = Ball(q.p, {4.1, 16.2, 6.8}, {2.2, 1.6, 2.8});
    return Double3{0.05, 0.22, 0.16} * (cheek * q.left * (1 - q.ear));
  });
  Pair(both("browInnerUp", "browDown"), kBrowRegion, [](const Point& q) {
    const double inner = Ball(q.p, {1.2, 21.0, 8.4}, {1.9, 1.8, 2.4});
    return Double3{-0.12, 0.26, 0.14} * (inner * q.left);
  });
  Pair(both("sneer", "smile"), kMouthRegion, [](const Point& q) {
    const double fold = Ball(q.p, {2.5, 13.2, 8.8}, {1.7, 1.8, 2.4});
    return Double3{0.10, -0.12, 0.22} * (fold * q.left * (1 - q.inside));
  });
  Pair(both("cheekPuff", "pucker"), kMouthRegion, [](const Point& q) {
    const double corner = Ball(q.p, {2.4, 11.6, 8.4}, {1.8, 1.9, 2.8});
    return Double3{0.16, 0.0, 0.24} * (corner * q.left * (1 - 0.8 * q.inside));
  });
  Center(both("pucker", "mouthOpen"), kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.4, 8.9}, {3.2, 2.8, 3.4});
    return Double3{0.10 * q.p.x, q.upper * 0.16 - (1 - q.upper) * 0.20, 0.20} * w;
  });
  Center(both("funnel", "mouthOpen"), kMouthRegion, [](const Point& q) {
    const double w = Ball(q.p, {0, 11.4, 8.9}, {3.2, 3.0, 3.4});
    return Double3{-0.06 * q.p.x, q.upper * -0.12 + (1 - q.upper) * 0.22, 0.10} * w;
  });
  Center(both("chinUp", "lipPress"), kChinRegion, [](const Point& q) {
    return Double3{0, -0.10, 0.20} * Ball(q.p, {0, 9.6, 8.7}, {2.2, 1.4, 2.6});
  });
}

// What turns of the joints need besides the skin: hollow cheeks of a dropped jaw, the muscle that stands out
// at the neck on the side that a head turns away from.
void Maker::Poses() {
  const auto pose = [](const char* name) { return std::string(name) + kPose; };
  Center(pose("jawOpen"), kJawRegion, [](const Point& q) {
    const double cheeks = Ball({std::fabs(q.p.x), q.p.y, q.p.z}, {4.2, 11.2, 5.4}, {2.8, 4.2, 3.8});
    return Double3{-0.09 * q.p.x, 0.08, -0.16} * (cheeks * (1 - q.ear) * (1 - q.inside));
  });
  Pair(pose("headTurn"), kThroatRegion, [](const Point& q) {
    const double band = Ball(q.p, {3.0, 5.6, 2.2}, {1.7, 5.0, 3.2});
    return Double3{0.26, 0.04, 0.34} * (band * q.left * Smooth(0, 2.5, q.p.y));
  });
}

}  // namespace

SparseTarget TargetOf(const Expression& expression, double smallest) {
  SparseTarget target = {expression.name, {}, {}};
  for (std::size_t i = 0; i < expression.deltas.size(); ++i) {
    if (Length(expression.deltas[i]) < smallest) continue;
    target.points.push_back(static_cast<Index>(i));
    target.deltas.push_back(ToMetres(expression.deltas[i]));
  }
  return target;
}

bool IsCorrective(const std::string& expression) {
  return expression.find(kInbetween) != std::string::npos ||
         expression.find(kCombination) != std::string::npos || expression.find(kPose) != std::string::npos;
}

std::vector<Expression> FaceExpressions(const HeadDesign& design, const HeadShape& shape) {
  Maker maker(design, shape);
  maker.Eyes();
  maker.Brows();
  maker.Cheeks();
  maker.Lips();
  maker.Others();
  if (design.production) {
    maker.Inbetweens();
    maker.Combinations();
    maker.Poses();
  }
  return maker.Take();
}

}  // namespace kpsa::engine::scenes
