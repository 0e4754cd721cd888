// Nodes as data for a test of rigid motions: set-ups that are evaluated where they are, and again with
// everything that is given in world space moved.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/matrix.h"
#include "graph/geometry.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {

// What a motion of the world does to a value.
enum class Moves {
  kNot,        // of a mesh's or a parent's space, or a number
  kFrame,      // a world matrix
  kInverse,    // the inverse of one
  kPlace,      // a point, points, a curve; of a matrix its translation
  kShift,      // a corner of a box along the axes: shifted, not turned
  kDirection,  // turned, not shifted
  kTurn        // a world rotation: quaternion, or angles in the order xyz
};

// The node's attribute at rest and in the frame that is evaluated (empty: as at rest). Structural ones rest.
struct GivenInput {
  std::string input;
  Moves moves = Moves::kNot;
  Value rest, now;
  bool idle = false;   // it is in world space, and the outputs do not depend on where
  bool bound = false;  // it stays in the rest pose, and moves with that alone
  bool fits = false;   // where it is left behind, the node is refused
};
struct GivenOutput {
  std::string output;
  Moves moves = Moves::kNot;
};

// The motions that a set-up goes through: of everything, or of the frame alone, while the rest pose that
// nodes are bound to stays where it is (a character that walks).
enum Trial : unsigned { kAllTurned = 1, kAllFar = 2, kNowTurned = 4, kNowFar = 8 };
inline constexpr unsigned kWithRest = kAllTurned | kAllFar, kFrameAlone = kNowTurned | kNowFar,
                          kEveryTrial = kWithRest | kFrameAlone;

struct NodeSetUp {
  std::string type, what;  // a node type, which of its ways to work
  std::vector<GivenInput> given;
  std::vector<GivenOutput> gives;
  unsigned unless = 0;  // trials after which the outputs are elsewhere, which is as it should be: `why`
  std::string why;
  std::string Name() const { return type + (what.empty() ? "" : ", " + what); }
};

std::vector<NodeSetUp> HandleSetUps();      // deformers that a handle, joints, shapes or curves move
std::vector<NodeSetUp> SurfaceSetUps();     // what reads or follows a surface: deformers, falloffs, pins
std::vector<NodeSetUp> ConstraintSetUps();  // constraints, IK
std::vector<NodeSetUp> FrameSetUps();       // transforms, matrices, vectors, lights
// Types with such outputs that know no world, and why: nothing can be moved.
const std::map<std::string, std::string>& NodesWithoutWorld();

// Two stages of a deformer: after the skin its points are in world space, before it in mesh space. Both have
// a sheet that bends, and a parent that moves.
NodeSetUp AfterSkin(const std::string& type, const std::string& what, std::vector<GivenInput> own,
                    bool idle_parent = true);
NodeSetUp BeforeSkin(const std::string& type, const std::string& what, std::vector<GivenInput> own,
                     bool idle_frames = true);
inline GivenInput Setting(const std::string& name, Value value) {
  return {name, Moves::kNot, std::move(value), {}};
}
inline GivenInput WorldMatrix(const std::string& name, RandomFrames* random) {
  return {name, Moves::kFrame, random->Rigid(0.5), random->Rigid(0.5)};
}
std::shared_ptr<const Mesh> EquivarianceSheet();    // 9 x 7 points, 2 wide
std::shared_ptr<const Mesh> EquivarianceSurface();  // another one, crossing it, coarser and larger
Value BentPoints(const Mesh& mesh, double amount);  // its points, moved a little: by `amount`
Value NumberedPoints(Index count, double step);     // weights 0, step, 2 step, ... up to 1, again from 0

// Where a motion takes a value.
Value MovedValue(const Value& value, const Matrix4& motion, Moves moves);

// The outputs of a set-up at rest and in its frame, each as often as there are outputs; the rest pose and the
// frame are moved by these, all but the input `unmoved`.
std::vector<Value> EvaluateSetUp(const NodeSetUp& set_up, const Matrix4& rest, const Matrix4& now,
                                 const std::string& unmoved = "");
// How far the outputs of a trial are from where the motion takes them.
double TrialError(const NodeSetUp& set_up, Trial trial, const std::vector<Value>& unmoved_outputs,
                  const std::string& unmoved = "");
// What rounding may do to them.
double TrialTolerance(const NodeSetUp& set_up, Trial trial);
std::string TrialName(Trial trial);

}  // namespace kpsa::engine
