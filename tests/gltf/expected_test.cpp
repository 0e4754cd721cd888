// The import, evaluated by the naive reference, against frames that independent programs computed.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "files/npz.h"
#include "gltf/import.h"
#include "tests/support/expected_files.h"
#include "tests/support/gltf_reference.h"

namespace kpsa::engine {
namespace {

// The largest distance of two points as a share of the diagonal of all expected positions.
double RelativeError(const Npz& expected, const std::map<std::string, std::vector<double>>& actual) {
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300}, worst = 0;
  for (const NpzArray& array : expected.arrays) {
    if (array.name == "times") continue;
    const std::vector<double> e = array.Doubles();
    const auto found = actual.find(array.name);
    if (found == actual.end() || found->second.size() != e.size()) {
      ADD_FAILURE() << array.name << (found == actual.end() ? " is missing" : " has another size");
      return 1e300;
    }
    for (std::size_t i = 0; i < e.size(); i += 3) {
      double sum = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        low[c] = std::min(low[c], e[i + c]), high[c] = std::max(high[c], e[i + c]);
        sum += (e[i + c] - found->second[i + c]) * (e[i + c] - found->second[i + c]);
      }
      worst = std::isfinite(sum) ? std::max(worst, sum) : 1e300;
    }
  }
  return std::sqrt(worst) / std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

TEST(GltfExpected, EveryFileWithinTolerance) {
  const std::vector<ExpectedFile> files = ExpectedFiles();
  if (files.empty()) GTEST_SKIP() << "no expected frames beside the checkout";
  std::map<std::string, Result<gltf::Character>> characters;
  for (const ExpectedFile& file : files) {
    SCOPED_TRACE(file.path);
    auto found = characters.find(file.character);
    if (found == characters.end()) {
      found = characters.emplace(file.character, gltf::LoadGltf(file.character)).first;
    }
    ASSERT_TRUE(found->second.ok()) << found->second.status().ToString();
    const gltf::Character& character = *found->second;
    const gltf::Clip* clip = nullptr;
    if (file.clip != "rest") {
      const Index index = character.FindClip(file.clip);
      ASSERT_NE(index, kNoIndex);
      clip = &character.clips[index];
    }
    const Result<Npz> expected = ReadNpz(file.path);
    ASSERT_TRUE(expected.ok()) << expected.status().ToString();
    const NpzArray* times = expected->Find("times");
    ASSERT_NE(times, nullptr);
    const auto actual = gltf_reference::AllPoints(character, clip, times->Doubles());
    EXPECT_EQ(actual.size(), expected->arrays.size() - 1);
    const double error = RelativeError(*expected, actual);
    EXPECT_LT(error, 1e-5);
    RecordProperty(file.character + "_" + file.clip, std::to_string(error));
    if (std::getenv("KPSA_SHOW") != nullptr)
      std::printf("%s__%s %.3g\n", file.character.c_str(), file.clip.c_str(), error);
  }
}

}  // namespace
}  // namespace kpsa::engine
