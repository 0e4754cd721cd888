// A subspace belongs to the rig that it was trained on. What changes the points refuses it by name (exit 3);
// what does not (values of controls, clips, the wording of the file) leaves it valid. Through the program, as
// a user meets it.
#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "files/npz.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

using nlohmann::json;

// The hello rig with a weight map and an order of keys to play with.
class SubspaceFolder : public HelloFolder {
 public:
  SubspaceFolder() {
    Edit("  mush: {type: deltaMush, iterations: 10}\n",
         "  mush: {type: deltaMush, iterations: 10, weights: \"w.json#soft\"}\n");
    WriteWeights(0.5);
  }
  void WriteWeights(double value) const {
    const json file = {
        {"kpsa", "weights"},
        {"version", 1},
        {"mesh", "column"},
        {"points", 794},
        {"maps",
         {{"soft", {{"default", 1}, {"indices", {5, 300}}, {"values", {0.25, value}}}},
          {"unused", {{"default", value}, {"indices", json::array()}, {"values", json::array()}}}}}};
    Write("w.json", file.dump());
  }
  void EditGlb(const std::function<void(GlbParts*)>& edit) const {
    GlbParts glb(Read(*this / "hello.glb"));
    edit(&glb);
    Write("hello.glb", glb.Bytes());
  }
  ProcessResult Run(std::vector<std::string> arguments) const { return RunKpsa(arguments, 60, path()); }
};

class Stale : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const SubspaceFolder folder;
    const ProcessResult run =
        folder.Run({"train", "hello.yaml", "--force", "--samples", "150", "--rows", "30", "-q"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    trained_ = TemporaryFolder::Read(folder / "hello.kpsa");
  }
  using Change = std::function<void(const SubspaceFolder&)>;

  static void ExpectRefused(const std::string& what, const std::vector<std::string>& parts,
                            const Change& change) {
    SCOPED_TRACE(what);
    const SubspaceFolder folder;
    folder.Write("hello.kpsa", trained_);
    change(folder);
    ASSERT_EQ(folder.Run({"eval", "hello.yaml", "--frames", "0:4", "-o", "exact.npz", "-q"}).exit_code, 0)
        << "the change itself is wrong";
    const ProcessResult run =
        folder.Run({"eval", "hello.yaml", "--accelerate", "--frames", "0:4", "-o", "out.npz"});
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_NE(run.err.find("hello.kpsa"), std::string::npos) << run.err;
    for (const std::string& part : parts)
      EXPECT_NE(run.err.find(part), std::string::npos) << "no \"" << part << "\" in:\n" << run.err;
    EXPECT_LE(run.error_lines(), 5u) << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "out.npz"));
  }
  // As misses, a stale subspace still gives the exact rig.
  static void ExpectMisses(const Change& change) {
    const SubspaceFolder folder;
    folder.Write("hello.kpsa", trained_);
    change(folder);
    ASSERT_EQ(folder.Run({"eval", "hello.yaml", "-o", "exact.npz", "-q"}).exit_code, 0);
    const ProcessResult run =
        folder.Run({"eval", "hello.yaml", "--accelerate", "--stale", "miss", "-o", "out.npz", "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(json::parse(run.out)["accelerated"]["hits"], 0);
    EXPECT_TRUE(TemporaryFolder::Read(folder / "out.npz") == TemporaryFolder::Read(folder / "exact.npz"));
  }
  static void ExpectValid(const std::string& what, const Change& change,
                          const std::vector<std::string>& arguments = {}) {
    SCOPED_TRACE(what);
    const SubspaceFolder folder;
    folder.Write("hello.kpsa", trained_);
    change(folder);
    std::vector<std::string> all = {"eval", "hello.yaml", "--accelerate", "--tolerance",
                                    "1",    "-o",         "out.npz",      "--json"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const ProcessResult run = folder.Run(all);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const json report = json::parse(run.out);
    EXPECT_GT(report["accelerated"]["hits"], 0) << report.dump();
  }
  static Change Edit(const std::string& from, const std::string& to) {
    return [=](const SubspaceFolder& folder) { folder.Edit(from, to); };
  }
  static Change Glb(const std::function<void(GlbParts*)>& edit) {
    return [=](const SubspaceFolder& folder) { folder.EditGlb(edit); };
  }

  static inline std::string trained_;
};

// Two vertices change places, with everything that belongs to them: the same character, another order of its
// points.
void SwapVertices(GlbParts* glb, std::uint32_t a, std::uint32_t b) {
  const json attributes = glb->json["meshes"][0]["primitives"][0]["attributes"];
  for (const char* name : {"POSITION", "NORMAL"})
    std::swap_ranges(glb->At<float>(attributes[name], a, 3), glb->At<float>(attributes[name], a, 3) + 3,
                     glb->At<float>(attributes[name], b, 3));
  std::swap_ranges(glb->At<float>(attributes["WEIGHTS_0"], a, 4),
                   glb->At<float>(attributes["WEIGHTS_0"], a, 4) + 4,
                   glb->At<float>(attributes["WEIGHTS_0"], b, 4));
  std::swap_ranges(glb->At<std::uint8_t>(attributes["JOINTS_0"], a, 4),
                   glb->At<std::uint8_t>(attributes["JOINTS_0"], a, 4) + 4,
                   glb->At<std::uint8_t>(attributes["JOINTS_0"], b, 4));
  const int indices = glb->json["meshes"][0]["primitives"][0]["indices"];
  const std::size_t count = glb->json["accessors"][static_cast<std::size_t>(indices)]["count"];
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t& index = *glb->At<std::uint32_t>(indices, i, 1);
    if (index == a || index == b) index = a + b - index;
  }
}

TEST_F(Stale, ChangesOfTheRigAreRefusedByName) {
  ExpectRefused("a weight map", {"stale", "mush.weights"},
                [](const SubspaceFolder& folder) { folder.WriteWeights(0.75); });
  ExpectRefused("iterations", {"stale", "mush.iterations"}, Edit("iterations: 10", "iterations: 11"));
  ExpectRefused("an envelope", {"stale", "mush.envelope"},
                Edit("iterations: 10", "iterations: 10, envelope: 0.9"));
  ExpectRefused("a driver's constant", {"stale", "squeeze.outputMax"},
                Edit("outputMax: 0.15", "outputMax: 0.16"));
  ExpectRefused("divisions of a cage", {"stale", "cage.divisions"},
                Edit("divisions: [2, 5, 2]", "divisions: [3, 5, 2]"));
  ExpectRefused("an override", {"stale", "mush.smoothingStep"},
                Edit("controls:", "overrides: {mush.smoothingStep: 0.4}\ncontrols:"));
  ExpectRefused("members", {"stale", "cage"}, Edit("members: all", "members: {joint: upper}"));
  ExpectRefused("a removed entry of the stack", {"stale", "cage", "(gone)"},
                Edit("[skin, cage, mush]", "[skin, mush]"));
  ExpectRefused("reordered entries of the stack", {"stale", "cage"},
                Edit("[skin, cage, mush]", "[cage, skin, mush]"));
  ExpectRefused("a new entry of the stack", {"stale", "(new)"}, [](const SubspaceFolder& folder) {
    folder.Edit("[skin, cage, mush]", "[skin, cage, wire, mush]");
    folder.Edit("nodes:\n", "nodes:\n  wire: {type: tripwire}\n");
  });
  ExpectRefused("another connection", {"stale", "cage"},
                Edit("  - squeeze.outValue -> cage.points[0,2,1].x\n", ""));
  ExpectRefused("another stage", {"column@mush", "column@cage"}, Edit("[column@mush]", "[column@cage]"));
  ExpectRefused("another space", {"space", "lower"},
                Edit("subspace: hello.kpsa", "space: lower, subspace: hello.kpsa"));
}

TEST_F(Stale, ChangesOfTheCharacterAreRefused) {
  ExpectRefused("reordered points", {"stale"}, Glb([](GlbParts* glb) { SwapVertices(glb, 100, 500); }));
  ExpectRefused("a moved point", {"stale"}, Glb([](GlbParts* glb) { *glb->At<float>(0, 321, 3) += 1e-4f; }));
  ExpectRefused("a joint's place", {"stale", "upper"}, Glb([](GlbParts* glb) {
                  glb->json["nodes"][1]["translation"] = {0, 0.21, 0};
                }));
  ExpectRefused("the bind pose", {"stale", "skin"},
                Glb([](GlbParts* glb) { *glb->At<float>(7, 1, 16) *= 1.01f; }));
  ExpectRefused("skin weights", {"stale", "skin"}, Glb([](GlbParts* glb) {
                  float* weights = glb->At<float>(3, 400, 4);
                  weights[0] = 0.5f, weights[1] = 0.5f, weights[2] = weights[3] = 0;
                  std::uint8_t* joints = glb->At<std::uint8_t>(2, 400, 4);
                  joints[0] = 0, joints[1] = 1;
                }));
  ExpectRefused("triangles", {"stale"}, Glb([](GlbParts* glb) {  // one quad split along its other diagonal
                  std::uint32_t* t = glb->At<std::uint32_t>(4, 3 * 1000, 1);
                  std::swap(t[2], t[4]);
                }));
}

// Deformers bind to the rest pose: what a rig sets there is part of it, also on a control.
TEST_F(Stale, AnotherRestPoseIsAnotherRig) {
  ExpectRefused("a control's value in the rig", {"upper.rotate"},
                Edit("connections:\n", "overrides: {upper.rotateZ: -40}\nconnections:\n"));
}

// What is set from outside is not the rig: misses or refusals that say so.
TEST_F(Stale, WhatIsSetIsToldFromWhatTheRigSays) {
  const auto run = [](const std::string& set, int exit_code, const std::string& part) {
    SCOPED_TRACE(set);
    const SubspaceFolder folder;
    folder.Write("hello.kpsa", trained_);
    const ProcessResult result = folder.Run(
        {"eval", "hello.yaml", "--accelerate", "--tolerance", "1", "--set", set, "-o", "out.npz", "--json"});
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(result.err.find("stale"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    if (exit_code == 0) {
      EXPECT_EQ(json::parse(result.out)["accelerated"]["hits"], 0);
    }
  };
  run("mush.iterations=150", 3, "mush.iterations is set to 150 here");
  run("cage.divisions=[3, 5, 2]", 3, "cage.divisions is set to [3, 5, 2] here");
  run("mush.envelope=0.5", 0, "mush.envelope = 0.5 is set, and the subspace never saw it move");
  run("upper.rotateY=5", 0, "upper.matrix is outside its trained range");  // tilted in training, not so far
  run("upper.translateY=2", 0, "upper.translateY = 0.02 m is set");
  run("lower.translateX=2", 0, "lower.translateX = 0.02 m is set");
  run("cage.points[1,2,1]=[0, 0.5, 0]", 0, "cage.points[");
}

TEST_F(Stale, AsMissesTheRigIsExact) {
  ExpectMisses(Edit("iterations: 10", "iterations: 11"));
  ExpectMisses([](const SubspaceFolder& folder) { folder.WriteWeights(0.75); });
  ExpectMisses(Glb([](GlbParts* glb) { SwapVertices(glb, 100, 500); }));
}

TEST_F(Stale, WhatDoesNotChangeThePointsKeepsTheSubspace) {
  const Change nothing = [](const SubspaceFolder&) {};
  ExpectValid("nothing", nothing);
  ExpectValid("the value of a control", nothing, {"--rest", "--set", "upper.rotateX=12"});
  ExpectValid("the value of a control while a clip plays", nothing,
              {"--set", "upper.rotateX=2", "--frames", "0:12"});
  ExpectValid("the rest pose", nothing, {"--rest"});
  ExpectValid("frames of a clip", nothing, {"--frames", "7:20:3"});
  ExpectValid("another rate", nothing, {"--fps", "12"});
  ExpectValid("comments and spaces", [](const SubspaceFolder& folder) {
    folder.Edit("nodes:\n", "\n# a comment\nnodes:   # another\n\n");
    folder.Edit("type: deltaMush, iterations: 10", "type: deltaMush,   iterations:   10");
  });
  ExpectValid("order of keys", [](const SubspaceFolder& folder) {
    folder.Edit("{type: deltaMush, iterations: 10, weights: \"w.json#soft\"}",
                "{weights: \"w.json#soft\", iterations: 10, type: deltaMush}");
    folder.Edit("divisions: [2, 5, 2], members: all", "members: all, divisions: [2, 5, 2]");
  });
  ExpectValid("order of sections, nodes and connections", [](const SubspaceFolder& folder) {
    const std::string text = TemporaryFolder::Read(folder.rig());
    const std::size_t nodes = text.find("nodes:\n"), connections = text.find("connections:\n"),
                      deform = text.find("deform:\n");
    const std::string a = "  - squeeze.outValue -> cage.points[0,2,0].x\n",
                      b = "  - squeeze.outValue -> cage.points[0,2,1].x\n";
    ASSERT_EQ(text.substr(connections, deform - connections), "connections:\n" + a + b);
    folder.Write("hello.yaml", text.substr(0, nodes) + text.substr(deform) + "connections:\n" + b + a +
                                   text.substr(nodes, connections - nodes));
    folder.Edit("  cage: {type: lattice", "  spare: {type: transform}\n  cage: {type: lattice");
  });
  ExpectValid("ranges of controls",
              Edit("upper.rotateX: {min: -30, max: 30}", "upper.rotateX: {min: -40, max: 25}"));
  ExpectValid("one control fewer", Edit("  upper.rotateX: {min: -30, max: 30}\n", ""));
  ExpectValid("tolerance and training", Edit("train: {samples: 400}", "train: {samples: 10}"));
  ExpectValid("the entry's name", Edit("  column: {points:", "  another: {points:"));
  ExpectValid("another map of the weight file", [](const SubspaceFolder& folder) {
    json file = json::parse(TemporaryFolder::Read(folder / "w.json"));
    file["maps"]["unused"]["default"] = 0.125;
    folder.Write("w.json", file.dump(1));
  });
  ExpectValid("the same values in other units", [](const SubspaceFolder& folder) {
    folder.Edit("units: {length: cm}", "units: {length: mm, angle: deg}");
    folder.Edit("outputMax: 0.15", "outputMax: 15%");
  });
  ExpectValid("another clip", [](const SubspaceFolder& folder) { folder.AddSway(); }, {"--clip", "wave"});
  ExpectValid("materials and a mesh elsewhere", Glb([](GlbParts* glb) {
                glb->json["materials"][0]["name"] = "chalk";
                glb->json["asset"]["generator"] = "another";
              }));
  ExpectValid("a stage after the accelerated one", [](const SubspaceFolder& folder) {
    folder.Edit("[skin, cage, mush]", "[skin, cage, mush, late]");
    folder.Edit("nodes:\n", "nodes:\n  late: {type: tripwire}\n");
  });
}

TEST_F(Stale, TrainingWithMoreThreadsGivesTheSameSubspace) {
  std::vector<std::string> results;
  for (const char* threads : {"1", "3"}) {
    const SubspaceFolder folder;
    ASSERT_EQ(folder
                  .Run({"train", "hello.yaml", "--force", "--samples", "150", "--rows", "30", "--threads",
                        threads, "-q"})
                  .exit_code,
              0);
    for (const char* evaluating : {"1", "4"}) {
      ASSERT_EQ(folder
                    .Run({"eval", "hello.yaml", "--accelerate", "--tolerance", "any", "--threads", evaluating,
                          "-o", "out.npz", "--force", "-q"})
                    .exit_code,
                0);
      results.push_back(TemporaryFolder::Read(folder / "out.npz"));
    }
    ASSERT_EQ(folder.Run({"eval", "hello.yaml", "-o", "out.npz", "--force", "-q"}).exit_code, 0);
    EXPECT_FALSE(TemporaryFolder::Read(folder / "out.npz") ==
                 results[0]);  // accelerated is not exact: the comparison sees that
  }
  for (const std::string& result : results) EXPECT_TRUE(result == results[0]);
}

// Shapes of a file count by what they hold, and only those that a blend shape takes.
TEST(StaleShapes, AChangedShapeIsRefusedByName) {
  const HelloFolder folder;
  const auto write = [&](float lift, float unused) {
    std::vector<float> shape(3 * std::size_t{794}, 0.f), other(shape.size(), unused);
    shape[1] = lift;
    Result<NpzWriter> writer = NpzWriter::Create(folder / "fix.npz", true);
    ASSERT_TRUE(writer.ok() && writer->Add("elbow", {794, 3}, shape).ok() &&
                writer->Add("other", {794, 3}, other).ok() && writer->Finish().ok());
  };
  write(0.01f, 0);
  folder.Edit("nodes:\n",
              "nodes:\n  fix: {type: blendShape, targets: [{file: fix.npz, shapes: elbow, as: "
              "displacements}], 'weight[elbow]': 1}\n");
  folder.Edit("[skin, cage, mush]", "[skin, fix, cage, mush]");
  const auto run = [&](std::vector<std::string> arguments) { return RunKpsa(arguments, 60, folder.path()); };
  ASSERT_EQ(run({"train", "hello.yaml", "--force", "--samples", "100", "--rows", "20", "-q"}).exit_code, 0);
  const auto eval = [&] { return run({"eval", "hello.yaml", "--accelerate", "--frames", "0:1", "-o", "-"}); };
  EXPECT_EQ(eval().exit_code, 0) << eval().err;
  write(0.01f, 0.5f);
  EXPECT_EQ(eval().exit_code, 0) << eval().err;
  write(0.02f, 0);
  const ProcessResult stale = eval();
  EXPECT_EQ(stale.exit_code, 3);
  EXPECT_NE(stale.err.find("fix.targets"), std::string::npos) << stale.err;
}

}  // namespace
}  // namespace kpsa::engine
