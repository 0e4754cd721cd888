// The expressions of the car as displacements. Those of a side are made for the left (+x) and mirrored.
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/scalar_math.h"
#include "scenes/car_model.h"

namespace kpsa::engine::scenes::car {
namespace {

constexpr Double3 kCorner = {42, 56, 165}, kMiddle = {0, kMouthHeight, 172};

struct Place {
  Double3 p;
  double upper;   // 1 above the mouth's line, 0 below; lips know their side
  double left;    // 1 on the car's left, 0 on the right, soft in the middle
  double inside;  // 0 on the shell .. 1 deep in the mouth
  double eye;     // 1 on lids and sockets
};

class Maker {
 public:
  using Formula = std::function<Double3(const Place&)>;
  explicit Maker(const CarShape& shape) : shape_(shape) {
    for (std::size_t i = 0; i < shape.points.size(); ++i) {
      const Double3 p = shape.points[i];
      double upper = Smooth(kMouthHeight - 8, kMouthHeight + 14, p.y);
      const double inner = Smooth(0.3, 1, std::min(shape.mouth[i], 1.0));
      upper += (0.5 + 0.5 * shape.lip[i] - upper) * inner;
      places_.push_back(
          {p, upper, Smooth(-14, 14, p.x), Smooth(1.1, 2, shape.mouth[i]), shape.socket[i] > 0 ? 1.0 : 0.0});
    }
  }
  void Center(const std::string& name, const Formula& formula) {
    expressions_.push_back({name, Deltas(formula)});
  }
  void Pair(const std::string& name, const Formula& formula) { PairOf(name, Deltas(formula)); }
  void PairOf(const std::string& name, std::vector<Double3> left) {
    std::vector<Double3> right;
    for (int m : shape_.mirror) right.push_back(Mirrored(left[static_cast<std::size_t>(m)]));
    expressions_.push_back({name + ".L", std::move(left)});
    expressions_.push_back({name + ".R", std::move(right)});
  }
  std::vector<Double3> Lids(double upper, double lower, double tilt) const;
  void Eyes();
  void Brows();
  void Mouth();
  void Body();
  void Corrections();
  std::vector<Expression> Take() { return std::move(expressions_); }

 private:
  std::vector<Double3> Deltas(const Formula& formula) const {
    std::vector<Double3> out;
    for (const Place& place : places_) out.push_back(formula(place));
    return out;
  }
  const CarShape& shape_;
  std::vector<Place> places_;
  std::vector<Expression> expressions_;
};

// The left lids turned about the eyeball by degrees: the upper one down, the lower one up; `tilt` turns the
// upper lid's inner end farther.
std::vector<Double3> Maker::Lids(double upper, double lower, double tilt) const {
  std::vector<Double3> out(places_.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Double3 d = shape_.points[i] - kEye;
    if (shape_.socket[i] == 0 || d.x < -kEye.x) continue;
    const double lid = shape_.lid[i], side = std::clamp(d.x / 17, -1.0, 1.0);
    const double degrees = shape_.socket[i] * (lid > 0 ? lid * (upper - tilt * side) : lid * lower);
    double sine, cosine;
    SinCos(degrees * kPi / 180, &sine, &cosine);
    out[i] = {0, d.y * cosine - d.z * sine - d.y, d.y * sine + d.z * cosine - d.z};
  }
  return out;
}

void Maker::Eyes() {
  PairOf("blink", Lids(65, 4, 0));
  PairOf("eyeWide", Lids(-14, -8, 0));
  PairOf("squint", Lids(10, 22, 0));
  PairOf("lidAngry", Lids(14, 2, 16));
}

void Maker::Brows() {
  const auto band = [](const Place& q, Double3 at, Double3 radius) {
    return Share(q.p, at, radius) * (1 - q.eye) * q.left;
  };
  Pair("browUp", [=](const Place& q) { return Double3{0, 9, -4} * band(q, {26, 150, 0}, {34, 24, 24}); });
  Pair("browDown", [=](const Place& q) { return Double3{-2, -8, 5} * band(q, {26, 150, 0}, {34, 24, 24}); });
  Pair("browInnerUp", [=](const Place& q) {
    return Double3{0, 9, -3} * band(q, {10, 150, 2}, {20, 24, 22});
  });
}

void Maker::Mouth() {
  Pair("smile", [](const Place& q) {
    return (Double3{7, 11, -9} * Share(q.p, kCorner, {34, 24, 40}) +
            Double3{3, 4, 3} * Share(q.p, {58, 66, 150}, {30, 20, 34})) *
           q.left;
  });
  Pair("frown", [](const Place& q) {
    return Double3{2, -13, -3} * (Share(q.p, kCorner, {34, 26, 40}) * q.left);
  });
  Pair("stretch", [](const Place& q) {
    return Double3{11, -1, -9} * (Share(q.p, kCorner, {36, 22, 40}) * q.left);
  });
  Pair("lipLowerDown", [](const Place& q) {
    return Double3{1, -8, 1} *
           (Share(q.p, {18, 38, 172}, {30, 20, 30}) * (1 - q.upper) * q.left * (1 - 0.6 * q.inside));
  });
  Center("mouthOpen", [](const Place& q) {
    const double w = Share(q.p, kMiddle, {62, 36, 60});
    return Double3{-0.05 * q.p.x, 5 * q.upper - 15 * (1 - q.upper), 0} * w;
  });
  Center("pucker", [](const Place& q) {
    const double w = Share(q.p, kMiddle, {62, 34, 46});
    return Double3{-0.48 * q.p.x, (2 * q.upper - 1) * 3, 13 - 0.004 * q.p.x * q.p.x} *
           (w * (1 - 0.5 * q.inside));
  });
  Center("funnel", [](const Place& q) {
    const double w = Share(q.p, kMiddle, {62, 36, 46});
    return Double3{-0.30 * q.p.x, 8 * q.upper - 9 * (1 - q.upper), 9} * (w * (1 - 0.5 * q.inside));
  });
  Center("lipPress", [](const Place& q) {
    const double w = Share(q.p, kMiddle, {56, 22, 34}) * (1 - q.inside);
    return Double3{0.04 * q.p.x, (1 - 2 * q.upper) * 4.2, -4} * w;
  });
  Center("lipUpperUp", [](const Place& q) {
    return Double3{0, 8, 3} * (Share(q.p, {0, 56, 174}, {50, 20, 30}) * q.upper * (1 - q.inside));
  });
  Center("mouthLeft", [](const Place& q) {
    return Double3{13, 1, -0.05 * q.p.x} * Share(q.p, kMiddle, {74, 34, 46});
  });
  Center("mouthRight", [](const Place& q) {
    return Double3{-13, 1, 0.05 * q.p.x} * Share(q.p, kMiddle, {74, 34, 46});
  });
}

void Maker::Body() {
  Pair("fenderPuff", [](const Place& q) {
    return Double3{8, 2, 5} * (Share(q.p, {74, 64, 128}, {40, 30, 58}) * q.left * (1 - q.inside));
  });
  Center("hoodBulge", [](const Place& q) {
    return Double3{0, 8, 2} * (Share(q.p, {0, 92, 105}, {60, 26, 60}) * (1 - q.eye));
  });
}

// Shapes half way, which other targets go through, and shapes that two together need.
void Maker::Corrections() {
  const auto find = [&](const std::string& name) {
    return std::find_if(expressions_.begin(), expressions_.end(),
                        [&](const Expression& e) { return e.name == name; })
        ->deltas;
  };
  PairOf("blinkHalf", Lids(32.5, 2, 0));  // around the eyeball, not straight through it
  std::vector<Double3> half = find("smile.L");
  for (std::size_t i = 0; i < half.size(); ++i) {
    const Place& q = places_[i];
    half[i] = half[i] * 0.5 + Double3{2.5, -1.2, -1.5} * (Share(q.p, kCorner, {30, 22, 36}) * q.left);
  }
  PairOf("smileHalf", std::move(half));
  std::vector<Double3> pucker = find("pucker");
  for (std::size_t i = 0; i < pucker.size(); ++i)
    pucker[i] = pucker[i] * 0.5 + Double3{0, 0, 2.5} * Share(places_[i].p, kMiddle, {40, 24, 34});
  expressions_.push_back({"puckerHalf", std::move(pucker)});
  Pair("smileOpen", [](const Place& q) {
    return Double3{-3, 3 * q.upper - 2.5 * (1 - q.upper), 2} * (Share(q.p, kCorner, {32, 26, 36}) * q.left);
  });
  Center("puckerOpen", [](const Place& q) {
    return Double3{0.06 * q.p.x, 2 * q.upper - 4 * (1 - q.upper), -2} * Share(q.p, kMiddle, {46, 28, 34});
  });
  Pair("browPinch", [](const Place& q) {
    return Double3{-3, 1, 3} * (Share(q.p, {8, 148, 4}, {16, 18, 18}) * (1 - q.eye) * q.left);
  });
  // Where the jaw hangs down, the bumper's sides are drawn in
  Center("jawDrop", [](const Place& q) {
    const Double3 side = {std::fabs(q.p.x), q.p.y, q.p.z};
    return Double3{-0.06 * q.p.x, 1.2, -1.5} * (Share(side, {56, 46, 150}, {24, 24, 36}) * (1 - q.inside));
  });
  Pair("smileSquint", [](const Place& q) {
    return Double3{0.5, 2.2, 1.2} * (Share(q.p, {27, 98, 34}, {28, 14, 18}) * q.left);
  });
}

}  // namespace

std::vector<Expression> CarExpressions(const CarShape& shape) {
  Maker maker(shape);
  maker.Eyes();
  maker.Brows();
  maker.Mouth();
  maker.Body();
  maker.Corrections();
  return maker.Take();
}

// What the muscles under the bumper do, as wide motions.
std::vector<Expression> MuscleExpressions(const CarCage& cage) {
  const auto make = [&](const std::string& name, const std::function<Double3(Double3)>& formula) {
    Expression e = {name, {}};
    for (const Double3& p : cage.points) e.deltas.push_back(formula(p));
    return e;
  };
  std::vector<Expression> out;
  for (const double side : {1.0, -1.0}) {
    const std::string s = side > 0 ? ".L" : ".R";
    out.push_back(make("cheek" + s, [=](Double3 p) {
      return Double3{side * 4, 6, 4} * Share({side * p.x, p.y, p.z}, {54, 60, 150}, {38, 26, 50});
    }));
    out.push_back(make("corner" + s, [=](Double3 p) {
      return Double3{side * 6, 1, -5} * Share({side * p.x, p.y, p.z}, {44, 54, 160}, {34, 24, 44});
    }));
  }
  out.push_back(make("purse", [](Double3 p) {
    return Double3{-0.22 * p.x, 0, 6} * Share(p, kMiddle, {70, 36, 50});
  }));
  out.push_back(make("nose", [](Double3 p) {
    return Double3{0, 5, 4} * Share(p, {0, 66, 166}, {56, 22, 40});
  }));
  return out;
}

}  // namespace kpsa::engine::scenes::car
