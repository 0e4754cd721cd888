// A VRM character on the command line: its expressions are controls and facts.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/process.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

TEST(Vrm, ExpressionsAreControlsAndFacts) {
  GltfBuilder b = GltfBuilder::Character();
  b.root.erase("animations");
  const nlohmann::json bind = {{"node", 0}, {"index", 0}, {"weight", 1}};
  b.root["extensions"]["VRMC_vrm"]["expressions"]["preset"] = {{"blink", {{"morphTargetBinds", {bind}}}},
                                                               {"neutral", nlohmann::json::object()}};
  b.root["nodes"][2]["extensions"]["VRMC_node_constraint"]["constraint"]["rotation"] = {{"source", 1}};
  const TemporaryFolder folder;
  folder.Write("c.vrm", b.Glb());
  const auto run = [&](const std::vector<std::string>& arguments) {
    const ProcessResult result = RunKpsa(arguments, 60, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  const auto facts = nlohmann::json::parse(run({"inspect", "c.vrm", "--json"}), nullptr, false);
  ASSERT_TRUE(facts.is_object() && facts.contains("expressions") && facts.contains("constraints")) << facts;
  EXPECT_EQ(facts["expressions"][0],
            (nlohmann::json{{"expression", "blink"}, {"kind", "blink"}, {"morph_targets", 1}}));
  EXPECT_EQ(facts["expressions"].size(), 2u);
  EXPECT_EQ(
      facts["constraints"][0],
      (nlohmann::json{{"node", "tip"}, {"constraint", "rotation"}, {"source", "root"}, {"weight", 1.0}}));

  run({"init", "c.vrm", "-q"});
  const std::string rig = TemporaryFolder::Read(folder / "c.yaml");
  EXPECT_NE(rig.find("  expressions.weight[blink]: {min: 0, max: 1}\n"), std::string::npos) << rig;
  EXPECT_EQ(rig.find("neutral"), std::string::npos);     // moves nothing
  EXPECT_EQ(rig.find("weight[up]"), std::string::npos);  // the expression's
  run({"validate", "c.yaml"});
  EXPECT_NE(run({"get", "c.yaml", "expressions.weight[blink]", "--times", "0"}).find("0"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
