// What kpsa bench says besides errors: whether the promise was kept, what its clips are worth, and how its
// times spread.
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

// In a bench of its own, frames of a known error.
class Bench : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const std::shared_ptr<const Subspace> trained = TrainRig(kHello, QuickTraining(), {"wave"});
    ASSERT_NE(trained, nullptr);
    // A calibration that knows of no errors: it accepts whatever the tolerance
    ASSERT_TRUE(WriteSubspace(*WithThreshold(*trained, 1e6, 1e7), *folder_ / "bold.kpsa").ok());
  }
  static void TearDownTestSuite() { delete folder_; }
  static ProcessResult Run(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bench", kHello, "--kpsa", *folder_ / "bold.kpsa", "--runs", "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunKpsa(arguments);
  }
  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(Bench, ChecksThePromise) {
  const ProcessResult broken = Run({"--tolerance", "0.001mm", "--check", "-q"});
  EXPECT_EQ(broken.exit_code, 1);
  EXPECT_NE(broken.out.find("promise    PROMISE BROKEN: "), std::string::npos) << broken.out;
  EXPECT_NE(broken.out.find("worst accepted: frame "), std::string::npos) << broken.out;
  EXPECT_NE(broken.err.find("PROMISE BROKEN: "), std::string::npos) << broken.err;
  const ProcessResult unchecked = Run({"--tolerance", "0.001mm", "--json"});
  EXPECT_EQ(unchecked.exit_code, 0) << unchecked.err;
  const Json json = Json::parse(unchecked.out);
  EXPECT_EQ(json["promise"]["kept"], false);
  EXPECT_EQ(json["promise"]["promised"], 0.05);
  EXPECT_EQ(json["promise"]["promised_of_hits"], 0.1);
  EXPECT_GT(json["promise"]["rate"], 0.5);
  double worst = 0;
  for (const Json& frame : json["per_frame"]) worst = std::max(worst, frame["max"].get<double>());
  EXPECT_EQ(json["promise"]["worst_accepted"]["error"], worst);
  EXPECT_DOUBLE_EQ(json["promise"]["worst_accepted"]["tolerances"], worst / 1e-6);

  const ProcessResult kept = Run({"--tolerance", "20mm", "--check"});
  EXPECT_EQ(kept.exit_code, 0) << kept.out;
  EXPECT_NE(kept.out.find("promise    kept: 0 of 49 frames beyond 20 mm (promised 5 %)"), std::string::npos)
      << kept.out;
  EXPECT_EQ(Run({"--tolerance", "any", "--check"}).exit_code, 0);
}

TEST_F(Bench, SaysWhatItsClipsAreWorth) {
  EXPECT_NE(Run({}).err.find("note: wave was trained on: its errors say nothing about new frames"),
            std::string::npos);
  const ProcessResult over = Run({"--frames", "1000:1003"});  // the clip has ended
  EXPECT_NE(over.err.find("note: nothing moves in wave"), std::string::npos) << over.err;
  EXPECT_EQ(Run({}).err.find("nothing moves"), std::string::npos);
  EXPECT_EQ(Run({"--frames", "4:4"}).err.find("nothing moves in"), std::string::npos) << "one frame";
}

TEST_F(Bench, TellsTheSpreadOfItsTimes) {
  const ProcessResult run = Run({"--json"});
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["clock"], "cpu");
  EXPECT_GT(json["wall_over_cpu"], 0.5);
  for (const auto& [value, range] :
       {std::pair{json["speedup"], json["speedup_range"]},
        {json["full"]["ms_per_frame"], json["full"]["ms_range"]},
        {json["accelerated"]["ms_per_frame"], json["accelerated"]["ms_range"]}}) {
    EXPECT_LE(range[0], value);
    EXPECT_GE(range[1], value);
    EXPECT_GT(range[0], 0.0);
    EXPECT_LT(range[0], range[1]);
  }
  // Parts are of the total, whatever recording them costs
  double parts = 0;
  for (const char* part : {"graph", "cues", "projection", "reconstruction", "downstream", "misses"})
    parts += json["accelerated"][part].get<double>();
  EXPECT_NEAR(parts, json["accelerated"]["ms_per_frame"], 1e-3 * parts);
  EXPECT_GE(json["accelerated"]["parts_recorded"], 0.999 * parts);
  const ProcessResult text = Run({"--threads", "2"});
  EXPECT_NE(text.out.find(" over the runs)"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("wall time"), std::string::npos) << text.out;
}

}  // namespace
}  // namespace kpsa::engine
