// Light that is learnt from clean pictures and measured by few paths (scenes/gi): nearer to what is right
// than the noisy picture that costs as much a pixel as the measuring does.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

std::string Ran(const std::vector<std::string>& arguments) {
  const ProcessResult run = RunKpsa(arguments, 300);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.out;
}

TEST(LearntLight, IsNearerToWhatIsRightThanAsManyPaths) {
  const TemporaryFolder folder;
  std::string rig = TemporaryFolder::Read(KPSA_SCENES_DIR "/gi/gi.yaml");
  rig = Replaced(rig, "room.glb", KPSA_SCENES_DIR "/gi/room.glb");
  rig = Replaced(rig, "width: 400, height: 400, samples: 128, keySamples: 16",
                 "width: 20, height: 20, samples: 64, keySamples: 4");
  rig = Replaced(rig, "samples: 40, keyPoints: 200, heldOut: 50", "samples: 40, keyPoints: 80, heldOut: 20");
  rig = Replaced(rig, "noisy: {bounced.samples: 16}", "noisy: {bounced.samples: 4}");
  rig = Replaced(rig, "bounced.samples: 1024", "bounced.samples: 512");
  const std::string path = folder.Write("gi.yaml", rig);
  const std::string subspace = folder / "gi.kpsa";
  Ran({"train", path, "--name", "light", "--force", "-q"});

  const Json bench =
      Json::parse(Ran({"bench", path, "--kpsa", subspace, "--tolerance", "any", "--runs", "1", "--frames",
                       "0:24:4", "--reference", "converged", "--rival", "noisy", "--json", "-q"}));
  EXPECT_GE(bench["cue_points"], 80);
  ASSERT_TRUE(bench["cue_stages"][0].get<std::string>().ends_with("bounced.irradiance@key"))
      << bench["cue_stages"];
  const Json& reference = bench["reference"];
  EXPECT_EQ(reference["variant"], "converged");
  EXPECT_EQ(reference["points"], 400);
  EXPECT_EQ(reference["outputs"], Json({"bounced.irradiance"}));
  ASSERT_EQ(reference["rows"].size(), 3u);
  const auto rms = [&](std::size_t row, const char* name) {
    EXPECT_EQ(reference["rows"][row]["name"], name);
    EXPECT_EQ(reference["rows"][row]["frames"].size(), 7u);
    return reference["rows"][row]["rms"][0].get<double>();
  };
  const double accelerated = rms(0, "accelerated"), full = rms(1, "full"), noisy = rms(2, "noisy");
  EXPECT_GT(full, 0);
  EXPECT_LT(full, noisy / 2);
  EXPECT_LT(accelerated, noisy / 2) << "full " << full << ", noisy " << noisy;

  // A frame without changes is the reference itself
  const std::string text =
      Ran({"bench", path, "--kpsa", subspace, "--tolerance", "0", "--runs", "1", "--frames", "3:3",
           "--variant", "noisy", "--stale", "miss", "--reference", "noisy", "--per-frame", "-q"});
  EXPECT_NE(text.find("RMS from noisy"), std::string::npos) << text;
  EXPECT_NE(text.find("full from noisy"), std::string::npos) << text;
  const ProcessResult alone = RunKpsa({"bench", path, "--rival", "noisy"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.err.find("expected --reference, too"), std::string::npos) << alone.err;
}

}  // namespace
}  // namespace kpsa::engine
