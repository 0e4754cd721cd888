// kpsa init, and what follows it with nothing tuned: train, bench.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/process.h"
#include "tests/support/moving_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

bool Has(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

TEST(Init, OneClipTrainsAndBenchesAsItIs) {
  MovingCharacter character;
  character.Swing("dance", 40, 4);
  const TemporaryFolder folder;
  const std::string glb = folder.Write("m.glb", character.builder.Glb()), rig = folder / "m.yaml";
  const ProcessResult init = RunKpsa({"init", glb, "-o", rig});
  ASSERT_EQ(init.exit_code, 0) << init.err;
  EXPECT_FALSE(Has(init.err, "note:")) << init.err;
  const ProcessResult train = RunKpsa({"train", rig, "--calibration", "100", "--rows", "60", "--force"});
  ASSERT_EQ(train.exit_code, 0) << train.err;
  const ProcessResult bench = RunKpsa({"bench", rig, "--check", "--runs", "1"});
  EXPECT_EQ(bench.exit_code, 0) << bench.err;
  EXPECT_TRUE(Has(bench.out, "tested on dance_test1: 24 frames")) << bench.out;
  EXPECT_TRUE(Has(bench.out, "hits       100.0 % of frames")) << bench.out;
  // What was learned of parts of the clip serves the clip itself
  const ProcessResult whole = RunKpsa({"bench", rig, "--clip", "dance", "--runs", "1"});
  EXPECT_TRUE(Has(whole.out, "hits       100.0 % of frames: 97 hits")) << whole.out << whole.err;
}

TEST(Init, SaysWhyThereIsNothingToAccelerate) {
  MovingCharacter character;
  character.builder.root["nodes"][0].erase("skin");
  character.Swing("spin", 90, 3, 0);
  const TemporaryFolder folder;
  const std::string glb = folder.Write("m.glb", character.builder.Glb()), rig = folder / "m.yaml";
  const ProcessResult init = RunKpsa({"init", glb, "-o", rig});
  EXPECT_EQ(init.exit_code, 0) << init.err;
  EXPECT_TRUE(Has(init.err, "m.glb: it only moves as a whole and never deforms")) << init.err;
  EXPECT_TRUE(Has(init.err, "next: kpsa eval ")) << init.err;
  EXPECT_EQ(RunKpsa({"validate", rig}).exit_code, 0);
  EXPECT_FALSE(Has(RunKpsa({"init", glb, "-o", rig, "--force", "-q"}).err, "moves")) << "quiet";
}

TEST(Init, SamplesAreThoseAskedFor) {
  MovingCharacter character;
  character.Swing("dance", 40, 3);
  const TemporaryFolder folder;
  const std::string glb = folder.Write("m.glb", character.builder.Glb());
  EXPECT_TRUE(Has(RunKpsa({"init", glb, "-o", "-"}).out, "samples: 400}"));
  EXPECT_TRUE(Has(RunKpsa({"init", glb, "-o", "-", "--samples", "77"}).out, "samples: 77}"));
}

}  // namespace
}  // namespace kpsa::engine
