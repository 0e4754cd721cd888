// The parts of the generated face: skin weights, expressions, clips. Centimetres until the file is written.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "scenes/glb_writer.h"
#include "scenes/head_shape.h"

namespace kpsa::engine::scenes {

// Shares of the joints at every point, kJointCount each; heads with fewer joints have 0 there.
std::vector<std::array<double, kJointCount>> FaceWeights(const HeadDesign& design, const HeadShape& shape);

// An expression: displacements of all points, cm.
struct Expression {
  std::string name;
  std::vector<Double3> deltas;
};
// As a morph target, without displacements below `smallest`, cm.
SparseTarget TargetOf(const Expression& expression, double smallest);
// The expressions that are controls; for a production's head then their in-betweens and correctives.
std::vector<Expression> FaceExpressions(const HeadDesign& design, const HeadShape& shape);
bool IsCorrective(const std::string& expression);

// The clips `extreme`, `talk_train`, `talk`, `emotions`, and `scene` or `sniff` of a production's head, for
// expressions of these names, of which correctives stay 0; node indices as the design's joints, the mesh node
// is `mesh_node`.
std::vector<GlbClip> FaceClips(const HeadDesign& design, const std::vector<std::string>& expressions,
                               int mesh_node);

// Maps of weights for the rig's deformers: name -> one value a point.
std::map<std::string, std::vector<double>> FaceWeightMaps(const HeadDesign& design, const HeadShape& shape);

// A layer under a production's skin: a coarse sheet with holes for eyes and mouth, and what each muscle, pad
// or part does to it.
enum class Sheet { kMuscles, kFascia, kFat, kClay };
constexpr Sheet kSheets[] = {Sheet::kMuscles, Sheet::kFascia, Sheet::kFat, Sheet::kClay};
const char* NameOf(Sheet sheet);  // its mesh
struct SheetShape {
  std::vector<Double3> points;
  std::vector<std::array<int, 4>> quads;
  std::vector<Expression> pulls;
};
SheetShape MakeSheet(const HeadDesign& design, Sheet sheet);

// The rig's curves and handles, as its YAML.
std::string CurvesYaml(const HeadDesign& design, const HeadShape& shape);

// 1 at the centre of an ellipsoid, 0 from its surface on.
double Ball(Double3 p, Double3 center, Double3 radius);

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
// A head: NAME.glb, NAME_curves.yaml, w/NAME.json.
SceneFiles GenerateHead(const HeadDesign& design, const HeadShape& shape);
SceneFiles GenerateHello();
SceneFiles GenerateRoom();

}  // namespace kpsa::engine::scenes
