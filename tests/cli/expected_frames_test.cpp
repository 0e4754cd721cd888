// `kpsa eval` of every shared character and clip against frames that independent programs computed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "files/npz.h"
#include "tests/cli/process.h"
#include "tests/support/expected_files.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

// The largest distance of two points as a share of the diagonal of all expected positions.
double RelativeError(const Npz& expected, const Npz& actual) {
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300}, worst = 0;
  for (const NpzArray& array : expected.arrays) {
    const NpzArray* found = actual.Find(array.name);
    if (found == nullptr || found->shape != array.shape) {
      ADD_FAILURE() << array.name << (found == nullptr ? " is missing" : " has another shape");
      return 1e300;
    }
    const std::vector<double> e = array.Doubles(), a = found->Doubles();
    if (array.name == "times") {
      EXPECT_EQ(e, a);
      EXPECT_EQ(found->type, NpzType::kFloat64);
      continue;
    }
    EXPECT_EQ(found->type, NpzType::kFloat32);
    for (std::size_t i = 0; i < e.size(); i += 3) {
      double sum = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        low[c] = std::min(low[c], e[i + c]), high[c] = std::max(high[c], e[i + c]);
        sum += (e[i + c] - a[i + c]) * (e[i + c] - a[i + c]);
      }
      worst = std::isfinite(sum) ? std::max(worst, sum) : 1e300;
    }
  }
  return std::sqrt(worst) / std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

TEST(ExpectedFrames, EveryCharacterAndClip) {
  const std::vector<ExpectedFile> files = ExpectedFiles();
  if (files.empty()) GTEST_SKIP() << "no expected frames beside the checkout";
  const TemporaryFolder folder;
  for (const ExpectedFile& file : files) {
    SCOPED_TRACE(file.stem);
    const Result<Npz> expected = ReadNpz(file.path);
    ASSERT_TRUE(expected.ok()) << expected.status().ToString();
    std::string times;
    for (double time : expected->Find("times")->Doubles())
      times += fmt::format("{}{:.17g}", times.empty() ? "" : ",", time);
    const std::string output = folder / (file.stem + ".npz");
    std::vector<std::string> arguments = {"eval", file.character, "--times", times, "-o", output};
    if (file.clip == "rest") {
      arguments.push_back("--rest");
    } else {
      arguments.insert(arguments.end(), {"--clip", file.clip});
    }
    const ProcessResult run = RunKpsa(arguments);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Result<Npz> actual = ReadNpz(output);
    ASSERT_TRUE(actual.ok()) << actual.status().ToString();
    EXPECT_EQ(actual->arrays.size(), expected->arrays.size());
    const double error = RelativeError(*expected, *actual);
    EXPECT_LT(error, 1e-5);
    if (std::getenv("KPSA_SHOW") != nullptr) std::printf("%-36s %.3g\n", file.stem.c_str(), error);
    std::filesystem::remove(output);
  }
}

}  // namespace
}  // namespace kpsa::engine
