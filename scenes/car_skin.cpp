// Skin weights and weight maps of the car.
#include <algorithm>
#include <cmath>

#include "base/scalar_math.h"
#include "scenes/car_model.h"

namespace kpsa::engine::scenes::car {
namespace {

double HoodField(Double3 p) {
  return Smooth(60, 44, std::fabs(p.x)) * Smooth(40, 52, p.z) * Smooth(162, 148, p.z) * Smooth(76, 84, p.y);
}
// 0 about the eyes, which are stiff, 1 away from them.
double AwayFromEyes(Double3 p) { return Smooth(32, 72, Length(Double3{std::fabs(p.x), p.y, p.z} - kEye)); }
double RoofField(Double3 p) { return Smooth(96, 140, p.y); }

}  // namespace

double JawField(Double3 p) {
  return Smooth(kMouthHeight + 6, kMouthHeight - 12, p.y) * Smooth(100, 145, p.z) *
         Smooth(84, 50, std::fabs(p.x));
}

const std::vector<JointRest>& CarJoints() {
  static const std::vector<JointRest> joints = {{"ground", -1, {0, 0, 0}},
                                                {"chassis", kGround, {0, kWheelAxle, 0}},
                                                {"body", kChassis, {0, 45, 0}},
                                                {"hood", kBody, {0, 92, 46}},
                                                {"roof", kBody, {0, 95, -30}},
                                                {"jaw", kBody, {0, 52, 105}},
                                                {"lidUp.L", kRoof, kEye},
                                                {"lidUp.R", kRoof, Mirrored(kEye)},
                                                {"lidLow.L", kRoof, kEye},
                                                {"lidLow.R", kRoof, Mirrored(kEye)},
                                                {"eye.L", kRoof, kEye},
                                                {"eye.R", kRoof, Mirrored(kEye)},
                                                {"wheel.FL", kGround, {74, kWheelAxle, kWheelAt}},
                                                {"wheel.FR", kGround, {-74, kWheelAxle, kWheelAt}},
                                                {"wheel.BL", kGround, {74, kWheelAxle, -kWheelAt}},
                                                {"wheel.BR", kGround, {-74, kWheelAxle, -kWheelAt}}};
  return joints;
}

std::vector<JointShares> CarWeights(const CarShape& shape) {
  std::vector<JointShares> out;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const Double3 p = shape.points[i];
    double jaw = JawField(p);
    if (shape.mouth[i] > 0) {
      // From the field outside to the lips, which follow one side alone
      const double lower = 0.5 - 0.5 * shape.lip[i], inner = std::min(shape.mouth[i], 1.0);
      jaw += (lower * (shape.mouth[i] > 1.6 ? 0.8 : 1) - jaw) * Smooth(0.3, 1, inner);
    }
    const double lid = shape.socket[i] * std::fabs(shape.lid[i]), roof = RoofField(p);
    JointShares w = {};
    const bool left = p.x > 0;
    w[shape.lid[i] > 0 ? (left ? kLidUpL : kLidUpR) : (left ? kLidLowL : kLidLowR)] = lid;
    w[kRoof] = (1 - lid) * (shape.socket[i] > 0 ? 1 : roof);
    double rest = 1 - lid - w[kRoof];
    w[kJaw] = rest * jaw;
    w[kHood] = rest * (1 - jaw) * HoodField(p) * (1 - roof);
    rest -= w[kJaw] + w[kHood];
    // What is near the wheels belongs to the suspension
    w[kChassis] = rest * 0.15 * Smooth(42, kWheelAxle, p.y) * (shape.mouth[i] > 0 ? 0 : 1);
    w[kBody] = rest - w[kChassis];
    out.push_back(w);
  }
  return out;
}

std::map<std::string, std::vector<double>> CarWeightMaps(const CarShape& shape) {
  std::map<std::string, std::vector<double>> maps;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const Double3 p = shape.points[i];
    const double lips = Smooth(0.5, 0.95, std::min(shape.mouth[i], 1.0)) * Smooth(2, 1.3, shape.mouth[i]);
    const double lids = Smooth(0.3, 1, shape.socket[i]), eye = shape.socket[i] > 0 ? 1 : 0;
    maps["lipUpper"].push_back(lips * Smooth(-0.15, 0.15, shape.lip[i]));
    maps["lipLower"].push_back(lips * Smooth(0.15, -0.15, shape.lip[i]));
    for (const double side : {1.0, -1.0}) {
      const std::string s = side > 0 ? ".L" : ".R";
      const double here = Smooth(-6, 6, side * p.x), own = side * p.x > 0 ? 1 : 0;
      maps["lidUpper" + s].push_back(lids * own * Smooth(0, 0.2, shape.lid[i]));
      maps["lidLower" + s].push_back(lids * own * Smooth(0, -0.2, shape.lid[i]));
      maps["brow" + s].push_back(here * (1 - eye) * Smooth(112, 132, p.y) * Smooth(-45, -15, p.z));
      maps["side" + s].push_back(here * (1 - eye) * Smooth(112, 95, p.y) * (shape.mouth[i] > 0 ? 0 : 1));
    }
    maps["nose"].push_back((shape.mouth[i] > 0.8 ? 0 : 1) * Smooth(80, 105, p.z) * Smooth(54, 64, p.y));
    maps["muscles"].push_back(Smooth(2, 1.4, shape.mouth[i]) * Smooth(60, 135, p.z) * (1 - eye));
    maps["squash"].push_back(AwayFromEyes(p));
    maps["panels"].push_back(AwayFromEyes(p) * Smooth(1.6, 0.6, shape.mouth[i]) * Smooth(24, 44, p.y));
    maps["flex"].push_back(AwayFromEyes(p) * Smooth(1.6, 0.6, shape.mouth[i]));
    maps["deck"].push_back(Smooth(60, 80, p.y) * Smooth(30, 60, p.z) * AwayFromEyes(p));
    maps["mush"].push_back(shape.mouth[i] > 1 || eye > 0 ? 0 : 1);
  }
  return maps;
}

}  // namespace kpsa::engine::scenes::car
