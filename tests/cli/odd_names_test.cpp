// Names are free text: dots, slashes, '@', '#', spaces. What is set, changed and measured on nodes of such
// names is found by name all the same, and what a subspace never saw move is a miss that says so.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "files/npz.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/support/gltf_builder.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

// Joints that training moves, and joints that it leaves alone.
const std::vector<std::string> kMoved = {"upperarm01.R", "a.b.c", "p/q", "check_kpsa"};
const std::vector<std::string> kStill = {"upperarm01.L", "a.b", "ns:hand", "x#1", "p/3", "left arm", "größe"};

// A row of soft strips of one mesh, 12 cm apart, each with a joint of its own below the root.
std::string Strips() {
  std::vector<std::string> names = kMoved;
  names.insert(names.end(), kStill.begin(), kStill.end());
  constexpr std::uint32_t kRows = 12, kAcross = 3;
  std::vector<float> positions, weights, binds;
  std::vector<std::uint8_t> joints;
  std::vector<std::uint32_t> indices;
  GltfBuilder b;
  std::vector<int> children, all{1};
  for (std::size_t k = 0; k <= names.size(); ++k) {  // the root comes first
    const float x = k == 0 ? 0 : 0.12f * static_cast<float>(k);
    binds.insert(binds.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, k == 0 ? 0 : -0.1f, 0, 1});
  }
  for (std::uint8_t k = 0; k < names.size(); ++k) {
    children.push_back(k + 2);
    all.push_back(k + 2);
    const auto first = static_cast<std::uint32_t>(positions.size() / 3);
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t i = 0; i < kAcross; ++i) {
        const float y = 0.03f * static_cast<float>(row), share = std::clamp((y - 0.04f) / 0.12f, 0.f, 1.f);
        positions.insert(positions.end(), {0.12f * static_cast<float>(k + 1) + 0.03f * static_cast<float>(i),
                                           y, 0.02f * static_cast<float>(i % 2)});
        weights.insert(weights.end(), {1 - share, share, 0, 0});
        joints.insert(joints.end(), {0, static_cast<std::uint8_t>(k + 1), 0, 0});
        if (row + 1 == kRows || i + 1 == kAcross) continue;
        const std::uint32_t at = first + row * kAcross + i;
        for (const std::uint32_t corner : {0u, 1u, kAcross + 1, 0u, kAcross + 1, kAcross})
          indices.push_back(at + corner);
      }
    }
  }
  b.Push("meshes", {{"name", "body@1"},
                    {"primitives",
                     {{{"attributes",
                        {{"POSITION", b.Accessor(positions, "VEC3")},
                         {"JOINTS_0", b.Accessor(joints, "VEC4")},
                         {"WEIGHTS_0", b.Accessor(weights, "VEC4")}}},
                       {"indices", b.Accessor(indices, "SCALAR")}}}}});
  b.Push("skins", {{"joints", all}, {"inverseBindMatrices", b.Accessor(binds, "MAT4")}});
  b.Push("nodes", {{"name", "body@1"}, {"mesh", 0}, {"skin", 0}});
  b.Push("nodes", {{"name", "root"}, {"children", children}});
  for (std::size_t k = 0; k < names.size(); ++k)
    b.Push("nodes", {{"name", names[k]}, {"translation", {0.12 * static_cast<double>(k + 1), 0.1, 0}}});
  b.Push("scenes", {{"nodes", {0, 1}}});
  b.root["scene"] = 0;
  return b.Glb();
}

constexpr const char* kRig = R"(kpsa: 1
character: strips.glb
nodes:
  "soft/mush@2.L": {type: deltaMush, iterations: 15}
deform:
  - {meshes: ["body@1"], stack: [skin, "soft/mush@2.L"]}
controls:
  upperarm01.R.rotateX: {min: -30, max: 30}
  a.b.c.rotateX: {min: -30, max: 30}
  p/q.rotateX: {min: -30, max: 30}
  check_kpsa.rotateX: {min: -30, max: 30}
  soft/mush@2.L.envelope: {min: 0, max: 1}
accelerate:
  strips: {points: ["body@1@soft/mush@2.L"], subspace: strips.kpsa, tolerance: 5mm, violationRate: 10%, train: {samples: 200}}
)";

class OddNames : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const TemporaryFolder folder;
    Fill(folder);
    const ProcessResult run = RunKpsa({"train", "strips.yaml", "--rows", "40", "--force"}, 60, folder.path());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    trained_ = TemporaryFolder::Read(folder / "strips.kpsa");
  }
  OddNames() {
    Fill(folder);
    folder.Write("strips.kpsa", trained_);
  }
  static void Fill(const TemporaryFolder& to) {
    to.Write("strips.glb", Strips());
    to.Write("strips.yaml", kRig);
  }
  ProcessResult Run(std::vector<std::string> arguments) const {
    return RunKpsa(arguments, 60, folder.path());
  }
  // What --accelerate tells of the rest pose with some plugs set.
  json Accelerated(const std::vector<std::string>& flags) const {
    std::vector<std::string> all = {"eval", "strips.yaml", "--rest",  "--accelerate",
                                    "-o",   "fast.npz",    "--force", "--json"};
    all.insert(all.end(), flags.begin(), flags.end());
    const ProcessResult run = Run(all);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? json::parse(run.out)["accelerated"]
                              : json{{"hits", -1}, {"most_frequent_reason", ""}};
  }
  // The largest error of it against the exact rig, in metres.
  double Error(const std::vector<std::string>& flags) const {
    std::vector<std::string> all = {"eval", "strips.yaml", "--rest", "-o", "exact.npz", "--force", "-q"};
    all.insert(all.end(), flags.begin(), flags.end());
    EXPECT_EQ(Run(all).exit_code, 0);
    const json compared = json::parse(Run({"compare", "fast.npz", "exact.npz", "--json"}).out);
    return compared["max"].get<double>();
  }
  void ExpectMiss(const std::vector<std::string>& flags, const std::string& reason) const {
    SCOPED_TRACE(reason);
    const json told = Accelerated(flags);
    EXPECT_EQ(told["misses"], 1) << told.dump();  // a full one
    EXPECT_NE(told["most_frequent_reason"].get<std::string>().find(reason), std::string::npos) << told.dump();
    EXPECT_EQ(Error(flags), 0);
  }
  void ExpectRefused(const std::vector<std::string>& flags, const std::vector<std::string>& parts) const {
    std::vector<std::string> all = {"eval", "strips.yaml", "--rest", "--accelerate", "-o", "no.npz"};
    all.insert(all.end(), flags.begin(), flags.end());
    const ProcessResult run = Run(all);
    EXPECT_EQ(run.exit_code, 3) << run.err;
    for (const std::string& part : parts)
      EXPECT_NE(run.err.find(part), std::string::npos) << "no \"" << part << "\" in:\n" << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "no.npz"));
  }

  TemporaryFolder folder;
  static inline std::string trained_;
};

TEST_F(OddNames, WhatWasNeverMovedIsAMissThatNamesIt) {
  EXPECT_EQ(Accelerated({})["hits"], 1);
  for (const std::string& name : kStill)
    ExpectMiss({"--set", name + ".rotateX=20"},
               name + ".rotateX = 20 deg is set, and the subspace never saw it move");
  ExpectMiss({"--set", "a.b.rotateX=20", "--set", "x#1.translateY=0.25"},
             "a.b.rotateX = 20 deg and 1 more are set, and the subspace never saw them move");
  // Of a joint that training moved, but not in that way
  ExpectMiss({"--set", "a.b.c.rotateY=20"}, "a.b.c.rotateY = 20 deg is set");
  ExpectMiss({"--set", "a.b.c.rotate=[5, 20, 0]"}, "a.b.c.rotateY = 20 deg is set");
  ExpectMiss({"--set", "a.b.c.scaleX=1.25"}, "a.b.c.scaleX = 1.25 is set");
  // By a pose file
  folder.Write("pose.yaml", "kpsa: 1\npose:\n  left arm.rotateZ: -15\n");
  ExpectMiss({"--pose", "pose.yaml"}, "left arm.rotateZ = -15 deg is set");
}

TEST_F(OddNames, ControlsAreGuardedByTheirRanges) {
  for (const std::string& name : kMoved) {
    SCOPED_TRACE(name);
    const std::vector<std::string> inside = {"--set", name + ".rotateX=12"};
    EXPECT_EQ(Accelerated(inside)["hits"], 1);
    EXPECT_LT(Error(inside), 5e-3);
    ExpectMiss({"--set", name + ".rotateX=80"}, name + ".matrix is outside its trained range");
  }
  EXPECT_EQ(Accelerated({"--set", "a.b.c.rotate=[12, 0, 0]"})["hits"], 1);
  EXPECT_EQ(Accelerated({"--set", "a.b.rotateX=0"})["hits"], 1);  // as it is anyway
  EXPECT_EQ(Accelerated({"--set", "soft/mush@2.L.envelope=0.5"})["hits"], 1);
}

// What was a control in training may be posed where the rig declares none any more, and is guarded still.
TEST_F(OddNames, AControlThatIsGoneKeepsItsRange) {
  folder.Write("strips.yaml", Replaced(kRig, "  a.b.c.rotateX: {min: -30, max: 30}\n", ""));
  EXPECT_EQ(Accelerated({"--set", "a.b.c.rotateX=12"})["hits"], 1);
  ExpectMiss({"--set", "a.b.c.rotateX=80"}, "a.b.c.matrix is outside its trained range");
}

// A control that is new was never seen.
TEST_F(OddNames, ANewControlIsUntrained) {
  folder.Write("strips.yaml",
               Replaced(kRig, "controls:\n", "controls:\n  a.b.c.rotateZ: {min: -9, max: 9}\n"));
  EXPECT_EQ(Accelerated({})["hits"], 1);
  ExpectMiss({"--set", "a.b.c.rotateZ=1"}, "a.b.c.rotateZ = 1 deg is set");
}

TEST_F(OddNames, StructuralSettingsAreRefusedAsWhatTheyAre) {
  const std::vector<std::string> set = {"--set", "soft/mush@2.L.iterations=150"};
  ExpectRefused(set, {"strips.kpsa",
                      "soft/mush@2.L.iterations is set to 150 here, the subspace was trained on what the rig "
                      "says; evaluate without subspaces, or train a rig that says so"});
  EXPECT_NE(Accelerated({set[0], set[1], "--stale", "miss"})["most_frequent_reason"].get<std::string>().find(
                "soft/mush@2.L.iterations is set to 150 here"),
            std::string::npos);
  EXPECT_EQ(Error(set), 0);
  EXPECT_EQ(Accelerated({"--set", "soft/mush@2.L.iterations=15"})["hits"], 1);  // what the rig says
}

// Training with --set learns the rig with that.
TEST_F(OddNames, WhatTrainingHadIsTheRig) {
  const std::vector<std::string> set = {"--set", "soft/mush@2.L.iterations=5", "--set", "a.b.rotateX=20"};
  std::vector<std::string> train = {"train", "strips.yaml", "--rows", "40", "--force", "-q"};
  train.insert(train.end(), set.begin(), set.end());
  const ProcessResult run = Run(train);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Accelerated(set)["hits"], 1);
  EXPECT_LT(Error(set), 5e-3);
  ExpectRefused({}, {"stale", "a.b.rotate", "soft/mush@2.L.iterations"});
}

TEST_F(OddNames, ChangesOfTheRigAreRefusedByName) {
  folder.Write("strips.yaml", Replaced(kRig, "iterations: 15", "iterations: 150"));
  ExpectRefused({}, {"stale", "soft/mush@2.L.iterations changed"});
  folder.Write("strips.yaml", Replaced(kRig, "iterations: 15", "iterations: 15, smoothingStep: 0.25"));
  ExpectRefused({}, {"stale", "soft/mush@2.L.smoothingStep (new)"});
  folder.Write("strips.yaml", kRig);
  const std::size_t count = kMoved.size() + kStill.size();
  for (std::size_t k = 0; k < count; ++k) {
    GlbParts glb(Strips());
    glb.json["nodes"][k + 2]["translation"][1] = 0.11;
    folder.Write("strips.glb", glb.Bytes());
    const std::string& name = k < kMoved.size() ? kMoved[k] : kStill[k - kMoved.size()];
    ExpectRefused({}, {"stale", name + ".restMatrix changed"});
  }
}

TEST_F(OddNames, AreFoundInEveryCommand) {
  EXPECT_EQ(Run({"eval", "strips.yaml", "--rest", "--kpsa", "strips.kpsa", "-o", "a.npz", "-q"}).exit_code,
            0);
  // Without an entry of its own, the rig is found by the names in the subspace
  const std::string rig = kRig;
  folder.Write("strips.yaml", rig.substr(0, rig.find("accelerate:")));
  EXPECT_EQ(Run({"eval", "strips.yaml", "--rest", "--kpsa", "strips.kpsa", "-o", "b.npz", "-q"}).exit_code,
            0);
  EXPECT_EQ(TemporaryFolder::Read(folder / "a.npz"), TemporaryFolder::Read(folder / "b.npz"));
  const ProcessResult got = Run(
      {"get", "strips.yaml", "body@1@soft/mush@2.L", "p/3.worldMatrix", "--rest", "--set", "p/3.rotateX=5"});
  EXPECT_EQ(got.exit_code, 0) << got.err;
  const ProcessResult inspected = Run({"inspect", "strips.kpsa"});
  EXPECT_NE(inspected.out.find("body@1@skin"), std::string::npos) << inspected.out;
  // Names and values may both hold a '='
  folder.Write("strips.yaml",
               Replaced(kRig, "nodes:\n", "nodes:\n  \"e=1.L\": {type: expression, expression: \"5\"}\n"));
  const ProcessResult equal =
      Run({"get", "strips.yaml", "e=1.L.output", "--rest", "--json", "--set", "e=1.L.expression=2 >= 1"});
  EXPECT_EQ(equal.exit_code, 0) << equal.err;
  EXPECT_EQ(equal.out.find("5"), std::string::npos) << equal.out;
  // What is misspelt is told as what it was meant to be
  const auto says = [&](const std::vector<std::string>& arguments, const std::string& part) {
    const ProcessResult run = Run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
  };
  says({"explain", "strips.yaml", "uperarm01.L"},
       "unknown node \"uperarm01.L\" (did you mean \"upperarm01.L\"");
  says({"explain", "strips.yaml", "upperarm01.L.rotatX"},
       "node \"upperarm01.L\" (transform) has no attribute");
  says({"get", "strips.yaml", "soft/mush@2.L.iteration"}, "has no attribute \"iteration\"");
  says({"get", "strips.yaml", "body@1@skn"}, "has no stage \"skn\"");
}

}  // namespace
}  // namespace kpsa::engine
