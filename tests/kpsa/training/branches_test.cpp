#include "kpsa/training/branches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "tests/support/test_graph.h"

namespace kpsa::engine {
namespace {

// A transform with a parent, turned about three axes; and what takes a number from it, as a driven key does.
struct Joints : NodeRegistry {
  Joints() {
    add("joint", "")
        .in("parentMatrix", Matrix4())
        .in("rotate", Double3())
        .in("stretch", 0.0)
        .out("worldMatrix", Type::kMatrix)
        .out("angle", Type::kDouble)
        .compute([](ComputeContext& c) {
          c.out_value<Matrix4>(0) = c.get<Matrix4>(0);
          c.out_value<double>(1) = c.get<Double3>(1).x;
        });
  }
};

class ControlBranches : public testing::Test {
 protected:
  void Hang(const std::string& joint, const std::string& from) {
    graph_.add("joint", joint);
    if (!from.empty()) graph_.connect(from + ".worldMatrix", joint + ".parentMatrix");
  }
  void Control(const std::string& plug) { controls_.emplace_back().plug = graph_.plug(plug); }
  std::vector<Branch> Branches() { return BranchesOf(graph_.graph, controls_); }

  const Joints joints_;
  TestGraph graph_{joints_};
  std::vector<ControlRange> controls_;
};

TEST_F(ControlBranches, HangFromTheNearestThatHasControls) {
  Hang("chest", "");
  Hang("clavicle", "chest");  // no controls
  Hang("elbow", "clavicle");
  Hang("sleeve", "");  // driven, not carried
  graph_.connect("elbow.angle", "sleeve.stretch");
  for (const char* plug : {"elbow.rotateX", "elbow.rotateZ", "chest.rotateX", "sleeve.rotateX"})
    Control(plug);
  const std::vector<Branch> branches = Branches();
  ASSERT_EQ(branches.size(), 3u);
  EXPECT_EQ(branches[0].begin, 0u);
  EXPECT_EQ(branches[0].end, 2u) << "controls of a node are one branch";
  EXPECT_EQ(branches[0].above, std::optional<std::size_t>(1));
  EXPECT_FALSE(branches[1].above);
  EXPECT_FALSE(branches[2].above) << "a number that goes into it carries nothing";
}

// A head with twelve bones, each of which carries another, and a neck of three below it.
std::vector<Branch> Face() {
  std::vector<Branch> branches(3 + 24);
  branches[1].above = 0, branches[2].above = 1;
  for (std::size_t b = 0; b < 12; ++b) branches[3 + 12 + b].above = 2, branches[3 + b].above = 3 + 12 + b;
  return branches;
}

TEST(StillBranches, AreAllButFiveOfManyWithWhatHangsFromThem) {
  const std::vector<Branch> face = Face();
  Random random(7);
  std::set<std::size_t> moved;
  for (int k = 0; k < 50; ++k) {
    const std::vector<bool> still = StillBranches(face, &random);
    EXPECT_EQ(std::count(still.begin() + 3, still.begin() + 15, false), 5);
    for (std::size_t b = 0; b < 3; ++b) EXPECT_FALSE(still[b]) << "the neck folds always";
    for (std::size_t b = 0; b < 12; ++b) {
      EXPECT_EQ(still[3 + b], still[15 + b]);
      if (!still[3 + b]) moved.insert(b);
    }
  }
  EXPECT_EQ(moved.size(), 12u) << "each in its turn";
}

TEST(StillBranches, AreNoneOfLimbsAndFingers) {
  std::vector<Branch> hand(16);  // five fingers of three joints, and the wrist
  for (std::size_t b = 0; b < 15; ++b) hand[b].above = b % 3 == 0 ? 15 : b - 1;
  Random random(7);
  for (int k = 0; k < 20; ++k) {
    const std::vector<bool> still = StillBranches(hand, &random);
    EXPECT_EQ(std::ranges::count(still, true), 0);
  }
}

}  // namespace
}  // namespace kpsa::engine
