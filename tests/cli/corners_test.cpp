// init, train and bench where a character is out of the ordinary: without clips, with clips in which nothing
// moves, with very many controls, with very many points. What is small has tests
// elsewhere: two controls and a single clip (init_test.cpp), points that a joint carries
// (train_check_test.cpp).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/process.h"
#include "tests/support/sheet_character.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

#if defined(KPSA_WITH_ASAN) || defined(KPSA_WITH_TSAN)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif
constexpr char kTakesLong[] = "takes many minutes with sanitizers";
// sh tests/long.sh: the sizes that are asked for; a quarter of them otherwise, so that the tests stay short.
const bool kLong = std::getenv("KPSA_LONG_TESTS") != nullptr;

bool Holds(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

class Corners : public ::testing::Test {
 protected:
  // The starter rig of the character.
  void Init(const SheetCharacter& character) {
    folder_.Write("sheet.glb", character.builder.Glb());
    init_ = Run({"init", "sheet.glb", "-o", "sheet.yaml"});
    ASSERT_EQ(init_.exit_code, 0) << init_.err;
  }
  ProcessResult Run(const std::vector<std::string>& arguments) const {
    return RunKpsa(arguments, 600, folder_.path());
  }
  // What train and bench say, as JSON; null where they fail.
  nlohmann::json Json(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--json", "-q"});
    const ProcessResult run = Run(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return nlohmann::json::parse(run.out, nullptr, false);
  }

  // `options` are of train. The promise is kept on the frames of bench, or the test fails.
  void TrainAndBench(const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"train", "sheet.yaml", "--force"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    train_ = Json(arguments);
    ASSERT_TRUE(train_.is_object());
    bench_ = Json({"bench", "sheet.yaml", "--runs", "1"});
    ASSERT_TRUE(bench_.is_object());
    EXPECT_EQ(bench_["promise"]["kept"], true) << bench_["promise"];
  }

  const TemporaryFolder folder_;
  ProcessResult init_;
  nlohmann::json train_, bench_;
};

TEST_F(Corners, WithoutAClipControlsTrainAndTheRestPoseIsMeasured) {
  Init(SheetCharacter(20, 2, 5));
  EXPECT_TRUE(Holds(init_.err, "no clip moves its points: controls alone train it")) << init_.err;
  TrainAndBench({"--samples", "300", "--calibration", "100"});
  EXPECT_EQ(train_["trained_on"]["clip_poses"], 0);
  EXPECT_EQ(train_["predicted"]["clip_frames"], 0) << "poses are timed";
  EXPECT_EQ(train_["calibration"]["hit_rate_of"], "sampled");
  EXPECT_GT(train_["calibration"]["hit_rate"], 0.5);
  EXPECT_EQ(bench_["frames"], 1);
  EXPECT_EQ(bench_["hit_rate"], 1.0);
}

TEST_F(Corners, TooFewNumbersAreSaidToBe) {
  Init(SheetCharacter(20, 2, 5));
  const ProcessResult train = Run({"train", "sheet.yaml", "--force", "-q", "--samples", "60", "--rows", "3"});
  EXPECT_EQ(train.exit_code, 3);
  EXPECT_TRUE(Holds(train.err, "no cue can be chosen: 3 numbers are too few")) << train.err;
}

TEST_F(Corners, ClipsThatStandStillAreNoMotion) {
  SheetCharacter character(20, 1, 1);
  character.Swing("still", 30, 0);
  character.Swing("idle", 30, 0);
  folder_.Write("sheet.glb", character.builder.Glb());
  folder_.Write(
      "sheet.yaml",
      "kpsa: 1\ncharacter: sheet.glb\naccelerate:\n  sheet: {points: [sheet@skin], subspace: sheet.kpsa, "
      "tolerance: 1mm, train: {clips: [still], samples: 0}, test: {clips: [idle]}}\n");
  const ProcessResult train = Run({"train", "sheet.yaml", "--force"});
  EXPECT_EQ(train.exit_code, 3) << train.out << train.err;
  EXPECT_TRUE(Holds(train.err, "nothing moves")) << train.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "sheet.kpsa"));
}

TEST_F(Corners, ThousandsOfControlsTrain) {
  if (kSanitized) GTEST_SKIP() << kTakesLong;
  SheetCharacter character(25, kLong ? 29 : 13, kLong ? 23 : 13);
  character.Swing("a", 40, 0.2f);
  character.Swing("b", 30, 0.15f);
  Init(character);
  const std::string rig = TemporaryFolder::Read(folder_ / "sheet.yaml");
  std::size_t controls = 0;
  for (std::size_t at = rig.find(".rotate"); at != std::string::npos; at = rig.find(".rotate", at + 1))
    ++controls;
  EXPECT_GE(controls, kLong ? 2000u : 500u);
  TrainAndBench({"--samples", "100", "--calibration", "100"});
  EXPECT_GT(train_["trained_on"]["sampled_poses"], controls) << "each alone";
  EXPECT_GT(bench_["hit_rate"], 0.9);
}

TEST_F(Corners, HundredsOfThousandsOfPointsTrain) {
  if (kSanitized) GTEST_SKIP() << kTakesLong;
  SheetCharacter character(kLong ? 448 : 142, 2, 3);
  character.Swing("a", 20, 0.4f);
  character.Swing("b", 10, 0.3f);
  Init(character);
  TrainAndBench(
      {"--samples", "40", "--calibration", "40", "--violation-rate", "10%", "--rows", "60", "--modes", "40"});
  EXPECT_GT(train_["points"], kLong ? 200'000 : 20'000);
  EXPECT_EQ(train_["calibration"]["hit_rate_of"], "clips");
  EXPECT_GT(bench_["hit_rate"], 0.5);
}

}  // namespace
}  // namespace kpsa::engine
