// The generated car that speaks: a shell with a mouth in the front bumper and eyes in the windscreen. All in
// centimetres, Y up, facing +Z, symmetric about x = 0 exactly; the car's left (.L) is +x. Only IEEE
// arithmetic and base/scalar_math.h: the same bits everywhere.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "scenes/face_model.h"

namespace kpsa::engine::scenes::car {

inline constexpr Double3 kEye = {25, 117, 9};  // centre of the left eyeball
inline constexpr double kEyeBall = 24;         // its radius
inline constexpr double kMouthHeight = 47, kMouthWidth = 38;
inline constexpr double kWheelAxle = 29, kWheelAt = 95, kArch = 35;  // height, +-z, radius of the arch

// The shell.
struct CarShape {
  std::vector<Double3> points;
  std::vector<std::array<int, 4>> quads;  // counter-clockwise from outside; a triangle repeats its last point
  std::vector<int> mirror;                // the point at (-x, y, z)
  // Rings from outside to inside, counter-clockwise from outside, from the corner at the greatest x. The
  // first is of the grid around; eye rings are of the left eye.
  std::vector<std::vector<int>> mouth_rings, eye_rings;
  int lip_ring = 0, lid_ring = 0;  // of mouth_rings: the crest of the lips; of eye_rings: the lids' edge
  std::vector<double> lip;         // a point: sine of its place around the mouth; 0 away from it
  std::vector<double> mouth;       // a point: 0 outside the mouth rings .. 1 on the lips, 2 inside
  std::vector<double> lid;         // a point: +1 upper lid .. -1 lower lid; 0 elsewhere
  std::vector<double> socket;      // a point: share of the lid's motion that it follows
  // Nine points each, from -x to +x or from front to back; .L and .R are mirror images.
  std::map<std::string, std::vector<int>> curves;
};
CarShape MakeCarShape();

// A coarse mesh under the shell that drives it.
struct CarCage {
  std::vector<Double3> points;
  std::vector<std::array<int, 4>> quads;
};
CarCage MuscleCage();  // rings around the mouth
CarCage PanelCage();   // under hood, roof and trunk
CarCage FrameCage();   // a tube from front to back
CarCage ClayCage();    // a wider one, that animators mould

enum CarJoint : int {
  kGround,
  kChassis,
  kBody,
  kHood,
  kRoof,
  kJaw,
  kLidUpL,
  kLidUpR,
  kLidLowL,
  kLidLowR,
  kEyeL,
  kEyeR,
  kWheelFL,
  kWheelFR,
  kWheelBL,
  kWheelBR,
  kCarJointCount
};
const std::vector<JointRest>& CarJoints();
using JointShares = std::array<double, kCarJointCount>;
std::vector<JointShares> CarWeights(const CarShape& shape);
// Of the lower bumper, which the jaw carries: below the mouth's line, fading towards the sides and the
// wheels.
double JawField(Double3 p);
std::map<std::string, std::vector<double>> CarWeightMaps(const CarShape& shape);

// Those that controls move come first; then `half` shapes that others go through and those of combinations.
std::vector<Expression> CarExpressions(const CarShape& shape);
std::vector<Expression> MuscleExpressions(const CarCage& cage);

// The clips `extreme`, `talk_train`, `talk`, `emotions` and `race`; node indices as CarJoints.
std::vector<GlbClip> CarClips(const std::vector<std::string>& expressions, int body_node,
                              const std::vector<std::string>& muscles, int muscle_node);

double Share(Double3 p, Double3 center, Double3 radius);  // 1 at the centre of an ellipsoid .. 0 outside
Double3 Mirrored(Double3 p);

}  // namespace kpsa::engine::scenes::car
