#include "files/weights_json.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "tests/support/instruction_count.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

const char kGood[] = R"({"kpsa": "weights", "version": 1, "mesh": "head_mesh", "points": 5,
  "maps": {"upper": {"default": 0.25, "indices": [4, 0], "values": [1, 0.5]}, "rest": {}}})";

TEST(Weights, ReadsMaps) {
  const TemporaryFolder folder;
  const std::string path = folder.Write("w/lips.json", kGood);
  const Result<WeightFile> file = ReadWeightFile(path);
  ASSERT_TRUE(file.ok()) << file.status().ToString();
  EXPECT_EQ(file->path, path);
  const auto weights = [&](const std::string& reference) {
    const Result<const NamedWeights*> map = FindWeights(*file, path, SplitWeightReference(reference).map);
    EXPECT_TRUE(map.ok()) << map.status().ToString();
    return map.ok() ? DenseWeights(*file, **map) : std::vector<float>();
  };
  EXPECT_EQ(weights("w/lips.json#upper"), (std::vector<float>{0.5, 0.25, 0.25, 0.25, 1}));
  EXPECT_EQ(weights("w/lips.json#rest"), std::vector<float>(5, 0.f));
  const auto error = [&](const std::optional<std::string>& map) {
    return FindWeights(*file, path, map).status().ToString();
  };
  EXPECT_NE(error("uper").find("did you mean \"upper\""), std::string::npos);
  EXPECT_NE(error(std::nullopt).find("the file has the maps upper, rest"), std::string::npos);
  EXPECT_NE(ReadWeightFile(folder / "w/none.json").status().ToString().find("No such file"),
            std::string::npos);
}

TEST(Weights, ReferencesMayHaveHashes) {
  const auto parts = [](const std::string& text) {
    const WeightReference reference = SplitWeightReference(text);
    return reference.path + " | " + reference.map.value_or("none");
  };
  EXPECT_EQ(parts("w.json"), "w.json | none");
  EXPECT_EQ(parts("w.json#a"), "w.json | a");
  EXPECT_EQ(parts("take#2/w.json#a#b"), "take#2/w.json | a#b");
  EXPECT_EQ(parts("#a"), " | a");
}

// Any finite float, in few digits, with names that JSON escapes.
TEST(Weights, TextReadsBackTheSameBits) {
  const TemporaryFolder folder;
  WeightFile file{"say \"hi\"\n", 3000, {{"a\\b", 0.1f, {}, {}}}};
  std::uint32_t bits = 1;
  for (Index i = 0; i < 3000; ++i) {
    bits = bits * 1664525u + 1013904223u;
    const auto value = std::bit_cast<float>(bits);
    file.maps[0].indices.push_back(i);
    file.maps[0].values.push_back(std::isfinite(value) ? value : 1.0f / static_cast<float>(i + 1));
  }
  const std::string text = WeightFileText(file);
  EXPECT_NE(text.find("\"default\": 0.1,"), std::string::npos) << text.substr(0, 200);
  const Result<WeightFile> read = ReadWeightFile(folder.Write("w.json", text));
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->mesh, file.mesh);
  ASSERT_EQ(read->maps.size(), 1u);
  EXPECT_EQ(read->maps[0].name, file.maps[0].name);
  EXPECT_EQ(read->maps[0].indices, file.maps[0].indices);
  EXPECT_EQ(read->maps[0].values, file.maps[0].values);
  EXPECT_EQ(WeightFileText(*read), text);
}

TEST(Weights, RoundTrip) {
  const TemporaryFolder folder;
  WeightFile file{"m", 3, {{"b", 0.1f, {2}, {0.7f}}, {"a", 1, {}, {}}}};
  ASSERT_TRUE(WriteWeightFile(folder / "w.json", file, false).ok());
  EXPECT_FALSE(WriteWeightFile(folder / "w.json", file, false).ok());
  const Result<WeightFile> read = ReadWeightFile(folder / "w.json");
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->mesh, "m");
  EXPECT_EQ(read->points, 3u);
  ASSERT_EQ(read->maps.size(), 2u);
  EXPECT_EQ(read->maps[0].name, "b");
  EXPECT_EQ(read->maps[0].default_value, 0.1f);
  EXPECT_EQ(read->maps[0].values, (std::vector<float>{0.7f}));
  EXPECT_EQ(read->maps[1].default_value, 1.f);
}

TEST(Weights, EveryErrorIsNamed) {
  const TemporaryFolder folder;
  const auto with = [](std::string from, const std::string& to) {
    std::string text = kGood;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const auto expect = [&](const std::string& text, const std::string& part) {
    const Result<WeightFile> file = ReadWeightFile(folder.Write("w.json", text));
    ASSERT_FALSE(file.ok()) << part;
    EXPECT_NE(file.status().ToString().find(part), std::string::npos) << file.status().ToString();
    EXPECT_EQ(file.status().errors()[0].where.file, folder / "w.json");
  };
  expect(with("[4, 0]", "[4]"), "has 1 indices and 2 values");
  expect(with("[4, 0]", "[4, 5]"), "indices[1] is 5, expected a point from 0 to 4");
  expect(with("[4, 0]", "[4, -1]"), "indices[1] is -1");
  expect(with("[4, 0]", "[4, 1.5]"), "indices[1] is 1.5");
  expect(with("[4, 0]", "[4, 4]"), "point 4 occurs twice");
  expect(with("[1, 0.5]", "[1, NaN]"), ":2:");
  expect(with("[1, 0.5]", "[1, null]"), "values[1] is null");
  expect(with("[1, 0.5]", "[1, 1e39]"), "values[1] is 1e+39, expected a finite");
  expect(with("[1, 0.5]", "[1, 1e999]"), "is no valid weight file");
  expect(with("[4, 0]", "[4, [[1]]]"), "indices[1] is an entry of type array, expected a point");
  expect(with("[1, 0.5]", "[1, \"half\"]"), "values[1] is an entry of type string, expected a finite");
  expect(with("0.25", "\"x\""), "default must be a finite number");
  expect(with("\"version\": 1", "\"version\": 2"), "version must be 1");
  expect(with("\"default\"", "\"defualt\""), "did you mean \"default\"");
  expect(with("\"points\": 5", "\"points\": 1e3"), "points must be");
  expect(with("\"points\": 5", "\"points\": -5"), "points must be");
  expect(with("\"mesh\": \"head_mesh\"", "\"mesh\": 3"), "mesh must be");
  expect(with("\"rest\": {}", "\"upper\": {}"), "\"upper\" is defined twice");
  expect(with("\"rest\": {}", "\"rest\": 3"), "must be an object");
  expect(with("weights", "rig"), "is no weight file");
  expect("[]", "is no weight file");
  expect("", "is no valid JSON");
  // Collected: both errors of one file
  const auto both = ReadWeightFile(folder.Write("w.json", with("[4, 0]", "[9, 9]")));
  EXPECT_EQ(both.status().errors().size(), 2u);
}

TEST(Weights, NestedTextIsRefusedBeforeAnybodyRecurses) {
  const TemporaryFolder folder;
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  const Result<WeightFile> file =
      ReadWeightFile(folder.Write("w.json", R"({"kpsa": "weights", "version": 1, "mesh": "m", "points": 1,
        "maps": {"a": {"indices": [)" + deep + R"(], "values": [1]}}})"));
  ASSERT_FALSE(file.ok());
  EXPECT_NE(file.status().ToString().find("nested more than"), std::string::npos) << file.status().ToString();
  EXPECT_EQ(file.status().errors()[0].where.file, folder / "w.json");
}

// In the file's order, and in no time that grows by the square of their number.
// A file of `count` maps of nothing, the last name first.
std::string MapsOfNothing(int count) {
  std::string text = R"({"maps": {)";
  for (int i = 0; i < count; ++i) text += fmt::format("{}\"m{}\":{{}}", i == 0 ? "" : ",", count - i);
  return text + R"(}, "kpsa": "weights", "version": 1, "mesh": "m", "points": 1})";
}

TEST(Weights, ManyMaps) {
  const TemporaryFolder folder;
  const int count = 50'000;
  const Result<WeightFile> file = ReadWeightFile(folder.Write("w.json", MapsOfNothing(count)));
  ASSERT_TRUE(file.ok()) << file.status().ToString();
  ASSERT_EQ(file->maps.size(), static_cast<std::size_t>(count));
  for (int i = 0; i < count; i += 4999)
    EXPECT_EQ(file->maps[static_cast<std::size_t>(i)].name, fmt::format("m{}", count - i));
}

// Four times as many maps take less than four times as many instructions, and not the more that comparing each with
// those before it would take.
TEST(InstructionCount, OfWeightMapsGrowsAsTheirNumber) {
  constexpr int kFew = 12, kMany = 4 * kFew;
  constexpr double kLinear = 3.5;  // since a file costs something, however few maps it has
  const TemporaryFolder folder;
  const auto reading = [&](int maps) {
    const std::string path = folder.Write("w.json", MapsOfNothing(maps));
    return static_cast<double>(
        CountInstructions([&] { EXPECT_TRUE(ReadWeightFile(path).ok()); }).value_or(0));
  };
  const auto comparing = [](int maps) {
    std::vector<std::string> names;
    for (int i = 0; i < maps; ++i) names.push_back(fmt::format("m{}", i));
    volatile std::size_t found = 0;
    return static_cast<double>(CountInstructions([&] {
                                 for (std::size_t i = 0; i < names.size(); ++i)
                                   for (std::size_t k = 0; k < i; ++k) found = found + (names[i] == names[k]);
                               }).value_or(0));
  };
  const double few = reading(kFew), many = reading(kMany);
  if (few == 0 || many == 0) GTEST_SKIP() << "instructions cannot be counted here";
  EXPECT_LT(many, kLinear * few);
  EXPECT_GT(many + comparing(kMany), kLinear * (few + comparing(kFew))) << "it would be seen";
}

TEST(Weights, TheFirstOutOfRange) {
  const auto first = [](float default_value, std::vector<Index> indices, std::vector<float> values) {
    WeightFile file;
    file.points = 3;
    file.maps.push_back({"m", default_value, std::move(indices), std::move(values)});
    return FirstOutOfRange(file, file.maps[0]);
  };
  using Found = std::pair<Index, float>;
  EXPECT_EQ(first(0, {2, 0, 1}, {1, 0.5f, 0}), std::nullopt);
  EXPECT_EQ(first(0, {2, 0, 1}, {-1, 0.5f, 2}), Found(1, 2.0f));
  EXPECT_EQ(first(1.5f, {}, {}), Found(0, 1.5f));
  EXPECT_EQ(first(1.5f, {1, 0}, {1, 1}), Found(2, 1.5f));
  EXPECT_EQ(first(1.5f, {2, 0}, {-1, 1}), Found(1, 1.5f));
  EXPECT_EQ(first(1.5f, {0, 2}, {-1, 1}), Found(0, -1.0f));
  EXPECT_EQ(first(1.5f, {2, 1, 0}, {1, 1, 1}), std::nullopt) << "no point has the default";
}

}  // namespace
}  // namespace kpsa::engine
