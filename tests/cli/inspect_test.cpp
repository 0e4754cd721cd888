// What kpsa inspect says of characters and rigs, and of their vertices.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "files/npz.h"
#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;
const std::string kFaceYaml = KPSA_SCENES_DIR "/face/face.yaml";
const std::string kFaceModel = KPSA_SCENES_DIR "/face/face.glb";

std::string InspectText(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "inspect");
  const ProcessResult run = RunKpsa(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.out;
}

Json FactsOf(std::vector<std::string> arguments) {
  arguments.push_back("--json");
  return Json::parse(InspectText(arguments), nullptr, false);
}

Json RowOf(const Json& rows, const std::string& key, const std::string& value) {
  for (const Json& row : rows) {
    if (row[key] == value) return row;
  }
  return {};
}

TEST(Inspect, TheTreeOfACharacterWithItsJoints) {
  for (const std::string& file : {kHelloGlb, kHello}) {
    const Json facts = FactsOf({file});
    const Json lower = RowOf(facts["tree"], "node", "lower"), upper = RowOf(facts["tree"], "node", "upper");
    ASSERT_FALSE(upper.empty()) << facts.dump(1);
    EXPECT_EQ(upper["depth"].get<int>(), lower["depth"].get<int>() + 1);
    EXPECT_NE(upper["joint_of"], "");
    EXPECT_NE(RowOf(facts["tree"], "node", "column")["mesh"], "");
    // Children stand further to the right than their parents
    const std::string text = InspectText({file});
    const auto column_of = [&](const std::string& name) {
      const std::size_t at = text.find(name + " ", text.find("tree ("));
      return at - text.rfind('\n', at);
    };
    EXPECT_EQ(column_of("upper"), column_of("lower") + 2) << text;
  }
}

TEST(Inspect, ClipsInFramesMorphTargetsAndMaterials) {
  const Json clip = FactsOf({kHelloGlb})["clips"][0];
  EXPECT_EQ(clip["frames"], std::lround(clip["seconds"].get<double>() * 24) + 1);
  const Json twice = FactsOf({kHelloGlb, "--fps", "48"})["clips"][0];
  EXPECT_EQ(twice["frames"], std::lround(clip["seconds"].get<double>() * 48) + 1);
  const Json face = FactsOf({kFaceModel});
  ASSERT_FALSE(face["morph_targets"].empty());
  EXPECT_GT(face["morph_targets"][0]["vertices"], 0);
  EXPECT_EQ(face["morph_targets"][0]["index"], 0);
  ASSERT_FALSE(face["materials_used"].empty());
  EXPECT_EQ(face["materials_used"].size(), face["materials"]);
  EXPECT_GT(face["materials_used"][0]["vertices"], 0);
}

TEST(Inspect, TheVertexNearestToAPlace) {
  const TemporaryFolder folder;
  const ProcessResult run = RunKpsa({"eval", kHelloGlb, "--rest", "--times", "0", "-o", folder / "rest.npz"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Result<Npz> npz = ReadNpz(folder / "rest.npz");
  ASSERT_TRUE(npz.ok());
  const std::vector<float> xyz = npz->arrays[1].Floats();
  const std::size_t v = 37;
  const std::string place = fmt::format("{},{},{}", xyz[3 * v] + 0.0001f, xyz[3 * v + 1], xyz[3 * v + 2]);
  for (const std::string& file : {kHelloGlb, kHello}) {
    const Json near = FactsOf({file, "--nearest", place});
    ASSERT_EQ(near["mesh"], "column");
    const auto found = near["vertex"].get<std::size_t>();
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(xyz[3 * found + k], xyz[3 * v + k], 1e-6);
    EXPECT_NEAR(near["distance_metres"].get<double>(), 1e-4, 1e-6);
    EXPECT_NEAR(near["y"].get<double>(), xyz[3 * v + 1], 1e-6);
  }
}

TEST(Inspect, TheVerticesOfJointsAndMaterialsAreThoseOfRigFiles) {
  const Json joint = FactsOf({kHelloGlb, "--vertices-of", "upper"});
  EXPECT_EQ(joint["kind"], "vertices of a joint");
  const std::string ranges = joint["meshes"][0]["vertices"];
  EXPECT_NE(ranges.find(':'), std::string::npos) << ranges;
  // The rest of the program reads them, and there are as many as it says
  EXPECT_EQ(RunKpsa({"graph", kHelloGlb, "--want", "column", "--vertices", ranges}).exit_code, 0);
  int listed = 0;
  std::istringstream parts(ranges);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t colon = part.find(':');
    const int first = std::stoi(part),
              last = colon == std::string::npos ? first : std::stoi(part.substr(colon + 1));
    EXPECT_LE(first, last);
    listed += last - first + 1;
  }
  EXPECT_EQ(joint["meshes"][0]["count"], listed);
  const Json face = FactsOf({kFaceModel});
  const Json material = FactsOf({kFaceYaml, "--vertices-of", face["materials_used"][0]["material"]});
  EXPECT_EQ(material["kind"], "vertices of a material");
  int count = 0;
  for (const Json& mesh : material["meshes"]) count += mesh["count"].get<int>();
  EXPECT_EQ(count, face["materials_used"][0]["vertices"]);
}

TEST(Inspect, FilesOfShapes) {
  const TemporaryFolder folder;
  Result<NpzWriter> writer = NpzWriter::Create(folder / "fix.npz", false);
  ASSERT_TRUE(writer.ok() && writer->Add("elbow", {2, 3}, std::vector<float>{0, 0, 0, 1, 2, 3}).ok() &&
              writer->Finish().ok());
  const Json elbow = FactsOf({folder / "fix.npz"})["arrays"][0];
  EXPECT_EQ(elbow["array"], "elbow");
  EXPECT_EQ(elbow["shape"], "(2, 3)");
  EXPECT_EQ(elbow["box_of_all_frames"], "1 x 2 x 3 m");
  folder.Write("two.obj", "o a\nv 0 0 0\nv 1 2 3\no b\nv 0 0 0\n");
  const Json facts = FactsOf({folder / "two.obj"});
  EXPECT_EQ(facts["kind"], "obj");
  ASSERT_EQ(facts["shapes"].size(), 2u) << facts.dump(1);
  EXPECT_EQ(facts["shapes"][0]["shape"], "a");
  EXPECT_EQ(facts["shapes"][0]["vertices"], 2);
  EXPECT_EQ(facts["shapes"][0]["box"], "1 x 2 x 3");
  folder.Write("bad.obj", "v 0 0\n");
  EXPECT_EQ(RunKpsa({"inspect", folder / "bad.obj"}).exit_code, 3);
}

TEST(Inspect, RefusesWhatHasNoVertices) {
  const auto refused = [](std::vector<std::string> arguments, const std::string& message) {
    arguments.insert(arguments.begin(), "inspect");
    const ProcessResult run = RunKpsa(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(message), std::string::npos) << run.err;
    EXPECT_EQ(run.out, "");
  };
  refused({kHelloGlb, "--nearest", "1,2"}, "expected X,Y,Z");
  refused({kHelloGlb, "--nearest", "1,2,nan"}, "finite number");
  refused({kHelloGlb, "--vertices-of", "uper"}, "did you mean \"upper\"");
  refused({kHelloGlb, "--vertices-of", "upper", "--nearest", "0,0,0"}, "one of them");
  refused({"a.npz", "--vertices-of", "upper"}, "of a rig or a character");
}

}  // namespace
}  // namespace kpsa::engine
