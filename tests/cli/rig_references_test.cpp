// Scenes of several rigs, through the program and with their subspaces.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "files/npz.h"
#include "kpsa/subspace.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

class TwoHellos : public ::testing::Test {
 protected:
  TwoHellos() {
    folder.Write("two.yaml", R"(kpsa: 1
fps: 24
references:
  a: {file: hello.yaml, translate: [1, 0, -2]}
  b: {file: hello.yaml, start: 12}
)");
  }
  std::string two() const { return folder / "two.yaml"; }
  Npz Eval(const std::string& rig, const std::string& frames) const {
    const std::string out = folder / "out.npz";
    const ProcessResult run = RunKpsa({"eval", rig, "--frames", frames, "-o", out, "--force", "-q"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    Result<Npz> npz = ReadNpz(out, 1u << 30);
    EXPECT_TRUE(npz.ok());
    return npz.ok() ? std::move(*npz) : Npz();
  }
  static std::vector<float> Array(const Npz& npz, const std::string& name) {
    for (const NpzArray& array : npz.arrays) {
      if (array.name == name) return array.Floats();
    }
    ADD_FAILURE() << "no " << name;
    return {};
  }
  HelloFolder folder;
};

// The largest difference of x y z values, `by` being added to the first ones.
double Apart(const std::vector<float>& a, const std::vector<float>& b, const Double3& by) {
  EXPECT_EQ(a.size(), b.size());
  double worst = a.empty() ? 1 : 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(a[i]) + by[static_cast<int>(i % 3)] - b[i]));
  return worst;
}

TEST_F(TwoHellos, AreTheRigShiftedInSpaceAndInTime) {
  const std::vector<float> hello = Array(Eval(folder.rig(), "6:18:6"), "column/0");
  const Npz both = Eval(two(), "6:18:6");
  ASSERT_EQ(both.arrays.size(), 3u);
  EXPECT_LT(Apart(hello, Array(both, "a:column/0"), {1, 0, -2}), 1e-6);
  EXPECT_LT(Apart(hello, Array(Eval(two(), "18:30:6"), "b:column/0"), {}), 1e-6);
  EXPECT_GT(Apart(hello, Array(both, "b:column/0"), {}), 1e-3);
  // Without frames: until all of them are over
  const ProcessResult all = RunKpsa({"eval", two(), "-o", folder / "all.npz", "--json"});
  EXPECT_NE(all.out.find("\"clip\": \"a:wave + b:wave\""), std::string::npos) << all.out << all.err;
}

TEST_F(TwoHellos, AllCommandsTakeThem) {
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"validate", two()},
           {"inspect", two()},
           {"get", two(), "b:cage.envelope", "a:upper.worldMatrix", "a.translate", "--frames", "0:2"},
           {"get", two(), "a:column@mush", "--frames", "0", "--clip", "a:wave"},
           {"graph", two()},
           {"profile", two(), "--frames", "0:2"},
           {"explain", two(), "b:mush"},
           {"explain", two(), "b:column[3]"},
           {"render", two(), "-o", folder / "a.png", "--frames", "0:2:2", "--size", "60x40"}}) {
    const ProcessResult run = RunKpsa(command);
    EXPECT_EQ(run.exit_code, 0) << command[0] << ": " << run.err;
  }
  const ProcessResult inspected = RunKpsa({"inspect", two()});
  EXPECT_NE(inspected.out.find("a:column@mush"), std::string::npos) << inspected.out;
  const ProcessResult untrained = RunKpsa({"bench", two()});
  EXPECT_NE(untrained.err.find("kpsa train " + folder.rig() + " writes it"), std::string::npos)
      << untrained.err;
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"train", two(), "--name", "a:column"},
        std::vector<std::string>{"learn", two(), "--name", "a:column", "--clip", "a:wave"}}) {
    const ProcessResult refused = RunKpsa(command);
    EXPECT_EQ(refused.exit_code, 2) << command[0];
    EXPECT_NE(refused.err.find("accelerate: \"a:column\" is an entry of "), std::string::npos) << refused.err;
  }
}

// A subspace of the rig alone serves wherever the rig stands.
TEST_F(TwoHellos, AreAcceleratedAsTheRigAlone) {
  const auto subspace = TrainRig(folder.rig(), QuickTraining(), {});
  ASSERT_NE(subspace, nullptr);
  RigRunOptions options;
  options.subspace = WithThreshold(*subspace, 50, 100);
  options.clip = std::string("wave");
  RigRun alone(folder.rig(), options);
  options.clip = std::string("a:wave");
  RigRun both(two(), options);
  ASSERT_TRUE(alone.ok()) << alone.error;
  ASSERT_TRUE(both.ok()) << both.error;
  EXPECT_EQ(both.rig.accelerate[0].name, "a:column");
  std::size_t hits = 0;
  for (int f = 0; f < 8; ++f) {
    alone.SetTime(f / 12.0);
    both.SetTime(f / 12.0);
    const RunFrame one = alone.Evaluate(), two = both.Evaluate();
    hits += one.hit ? 1 : 0;
    EXPECT_EQ(one.hit, two.hit) << f << ": " << two.text;
    EXPECT_NEAR(one.score, two.score, 1e-3 * (1 + one.score)) << f;
    const std::size_t n = one.points.size() / 3;
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_NEAR(one.points[i] + 1, two.points[i], 1e-5);
      EXPECT_NEAR(one.points[2 * n + i] - 2, two.points[2 * n + i], 1e-5);
      if (HasFailure()) return;
    }
  }
  EXPECT_GT(hits, 4u);
  // Placed anew, it still is the same rig; changed, it is not
  ASSERT_TRUE(WriteSubspace(*subspace, folder / "hello.kpsa").ok());
  const std::string text = TemporaryFolder::Read(two());
  folder.Write("two.yaml", text + "overrides: {b.rotateY: 90}\n");
  const ProcessResult run = RunKpsa({"bench", two(), "--runs", "1", "--frames", "0:3"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  // What is set on one of them, too, is told from what was trained, by the names of the rig alone
  folder.Write("two.yaml", text);
  const auto miss = [&](const std::string& set) {
    const ProcessResult eval = RunKpsa({"eval", two(), "--accelerate", "--tolerance", "1", "--rest", "--set",
                                        set, "-o", folder / "x.npz", "--force", "--json"});
    EXPECT_EQ(eval.exit_code, 0) << eval.err;
    return nlohmann::json::parse(eval.out)["accelerated"]["most_frequent_reason"].get<std::string>();
  };
  EXPECT_EQ(miss("a:upper.rotateX=12"), "");
  EXPECT_NE(miss("a:upper.rotateY=20").find("a:upper.matrix is outside its trained range"),
            std::string::npos);
  EXPECT_NE(miss("a:upper.scaleY=2").find("a:upper.scaleY = 2 is set"), std::string::npos);
  folder.Write("two.yaml", text + "overrides: {'b:mush.iterations': 3}\n");
  const ProcessResult stale =
      RunKpsa({"eval", two(), "--accelerate", "--frames", "0", "-o", folder / "y.npz"});
  EXPECT_EQ(stale.exit_code, 3) << stale.err;
  EXPECT_NE(stale.err.find("the subspace is stale: since it was trained, mush.iterations changed"),
            std::string::npos)
      << stale.err;
}

}  // namespace
}  // namespace kpsa::engine
