// Every node with points, matrices or vectors gives its outputs moved where the world is moved by a rigid
// motion, or is listed with the reason why not. An input that is left behind shows.
#include "tests/nodes/equivariance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace kpsa::engine {
namespace {

constexpr double kSeen = 3e-3;  // errors above it are none of rounding
constexpr Trial kTrials[] = {kAllTurned, kAllFar, kNowTurned, kNowFar};

const std::vector<NodeSetUp>& AllSetUps() {
  static const std::vector<NodeSetUp> all = [] {
    std::vector<NodeSetUp> sum;
    for (auto* part : {HandleSetUps, SurfaceSetUps, ConstraintSetUps, FrameSetUps}) {
      for (NodeSetUp& set_up : part()) sum.push_back(std::move(set_up));
    }
    return sum;
  }();
  return all;
}

TEST(RigidMotion, MovesWhatNodesGive) {
  for (const NodeSetUp& set_up : AllSetUps()) {
    const std::vector<Value> outputs = EvaluateSetUp(set_up, Matrix4(), Matrix4());
    for (const Trial trial : kTrials) {
      const double error = TrialError(set_up, trial, outputs);
      if ((set_up.unless & trial) == 0) {
        EXPECT_LT(error, TrialTolerance(set_up, trial)) << set_up.Name() << ": " << TrialName(trial);
      } else {  // the reason holds, too
        EXPECT_GT(error, kSeen) << set_up.Name() << ": " << TrialName(trial) << " holds, against "
                                << set_up.why;
      }
    }
    EXPECT_EQ(set_up.unless != 0, !set_up.why.empty()) << set_up.Name();
  }
}

// The canary: what the table says of an input is seen in the outputs.
TEST(RigidMotion, ShowsInputsThatAreLeftBehind) {
  for (const NodeSetUp& set_up : AllSetUps()) {
    if (set_up.unless == kEveryTrial) continue;
    const std::vector<Value> outputs = EvaluateSetUp(set_up, Matrix4(), Matrix4());
    for (const GivenInput& input : set_up.given) {
      if (input.moves == Moves::kNot) continue;
      bool seen = false;
      for (const Trial trial : kTrials) {
        if ((set_up.unless & trial) != 0 || seen) continue;
        const double error = TrialError(set_up, trial, outputs, input.input);
        seen = error > kSeen;
        if (input.idle) {
          EXPECT_LT(error, TrialTolerance(set_up, trial))
              << set_up.Name() << ": " << TrialName(trial) << ": " << input.input << " is not idle";
        }
      }
      EXPECT_EQ(seen, !input.idle) << set_up.Name() << ": " << input.input;
    }
  }
}

bool IsInSpace(Type type) {
  return type == Type::kDouble3 || type == Type::kQuaternion || type == Type::kMatrix || IsPointType(type) ||
         type == Type::kMesh || type == Type::kCurve;
}
std::string WithoutElement(const std::string& name) { return name.substr(0, name.find('[')); }

// What the tables lack of these types of nodes; nothing where all is well.
std::set<std::string> Missing(const NodeRegistry& registry, const std::vector<NodeSetUp>& set_ups,
                              const std::map<std::string, std::string>& without_world) {
  std::map<std::string, std::set<std::string>> told;  // attributes by type
  for (const NodeSetUp& s : set_ups) {
    for (const GivenInput& input : s.given) told[s.type].insert(WithoutElement(input.input));
    for (const GivenOutput& output : s.gives) told[s.type].insert(WithoutElement(output.output));
  }
  std::set<std::string> missing;
  for (const std::string& name : registry.Names()) {
    const std::vector<AttributeDef>& attributes = registry.Find(name)->attributes;
    const bool gives = std::any_of(attributes.begin(), attributes.end(),
                                   [](const AttributeDef& a) { return a.output && IsInSpace(a.type); });
    const bool spaceless = without_world.count(name) != 0;
    if (spaceless && (told.count(name) != 0 || !gives)) missing.insert(name + " is no node without a world");
    if (!gives || spaceless) continue;
    if (told.count(name) == 0) {
      missing.insert(name);
      continue;
    }
    for (const AttributeDef& a : attributes) {
      const bool counts = a.type != Type::kWeights || a.output;
      if (IsInSpace(a.type) && counts && told[name].count(a.name) == 0) missing.insert(name + "." + a.name);
    }
  }
  for (const auto& [name, why] : without_world) {
    if (registry.Find(name) == nullptr || why.empty()) missing.insert(name + " is no node");
  }
  return missing;
}

// The guard: a new node, or a new attribute in some space, needs a set-up.
TEST(RigidMotion, IsToldOfEveryNode) {
  EXPECT_EQ(Missing(StandardNodes(), AllSetUps(), NodesWithoutWorld()), std::set<std::string>());
}

TEST(RigidMotion, MissesANodeThatNobodyLists) {
  NodeRegistry registry;
  AddStandardNodes(registry);
  registry.add("drift", "moves")
      .in("matrix", Matrix4())
      .out("place", Type::kDouble3)
      .compute([](const Matrix4& m) { return PlaceIn(m); });
  EXPECT_EQ(Missing(registry, AllSetUps(), NodesWithoutWorld()), std::set<std::string>{"drift"});
  std::vector<NodeSetUp> more = AllSetUps();
  more.push_back({"drift", "", {}, {{"place", Moves::kPlace}}, 0, ""});
  EXPECT_EQ(Missing(registry, more, NodesWithoutWorld()), std::set<std::string>{"drift.matrix"});
}

}  // namespace
}  // namespace kpsa::engine
