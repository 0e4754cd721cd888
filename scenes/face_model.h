// The parts of the generated face: skin weights, expressions, clips. Centimetres until the file is written.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "scenes/glb_writer.h"
#include "scenes/head_shape.h"

namespace kpsa::scenes {

// Joints of the face in the order of the skin.
enum Joint : int { kRoot, kNeck, kHead, kJaw, kEyeL, kEyeR, kJointCount };
struct JointRest {
  const char* name;
  int parent;
  Double3 position;  // world, cm
};
const std::vector<JointRest>& FaceJoints();

// Shares of the joints at every point, kJointCount each.
std::vector<std::array<double, kJointCount>> FaceWeights(const HeadShape& shape);

// An expression: displacements of all points, cm.
struct Expression {
  std::string name;
  std::vector<Double3> deltas;
};
std::vector<Expression> FaceExpressions(const HeadShape& shape);

// The clips `extreme`, `talk_train` and `talk` for expressions of these names; node indices as FaceJoints,
// the mesh node is `mesh_node`.
std::vector<GlbClip> FaceClips(const std::vector<std::string>& expressions, int mesh_node);

// Maps of weights for the rig's deformers: name -> one value a point.
std::map<std::string, std::vector<double>> FaceWeightMaps(const HeadShape& shape);

// A generator of pseudo-random numbers that is the same everywhere (Knuth's MMIX constants, upper bits).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ull + 1) { Next(); }
  double Uniform(double low = 0, double high = 1) { return low + (high - low) * Next(); }
  int Below(int count) { return static_cast<int>(Next() * count); }

 private:
  double Next() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<double>(state_ >> 11) / 9007199254740992.0;
  }
  std::uint64_t state_;
};

// All files of a scene: path below its folder -> bytes.
using SceneFiles = std::map<std::string, std::string>;
SceneFiles GenerateCar();
SceneFiles GenerateFace();
SceneFiles GenerateHello();
SceneFiles GenerateRoom();

}  // namespace kpsa::scenes
