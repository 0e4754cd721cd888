#include "io/weights_json.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace kpsa {
namespace {

const char kGood[] = R"({"kpsa": "weights", "version": 1, "mesh": "head_mesh", "points": 5,
  "maps": {"upper": {"default": 0.25, "indices": [4, 0], "values": [1, 0.5]}, "rest": {}}})";

TEST(Weights, ReadsMaps) {
  const TemporaryFolder folder;
  folder.Write("w/lips.json", kGood);
  const auto upper = LoadWeights(folder.path(), "w/lips.json#upper", "head_mesh", 5);
  ASSERT_TRUE(upper.ok()) << upper.status().ToString();
  EXPECT_EQ(*upper, (std::vector<float>{0.5, 0.25, 0.25, 0.25, 1}));
  EXPECT_EQ(*LoadWeights(folder.path(), "w/lips.json#rest", "head_mesh", 5), std::vector<float>(5, 0.f));
  const auto error = [&](const std::string& reference, const std::string& mesh, std::size_t points) {
    return LoadWeights(folder.path(), reference, mesh, points).status().ToString();
  };
  EXPECT_NE(error("w/lips.json#uper", "head_mesh", 5).find("did you mean \"upper\""), std::string::npos);
  EXPECT_NE(error("w/lips.json", "head_mesh", 5).find("has 2 maps"), std::string::npos);
  EXPECT_NE(error("w/lips.json#upper", "body", 5).find("of the mesh \"head_mesh\", expected \"body\""),
            std::string::npos);
  EXPECT_NE(error("w/lips.json#upper", "head_mesh", 6).find("for 5 points, \"head_mesh\" has 6"),
            std::string::npos);
  EXPECT_NE(error("w/none.json#upper", "head_mesh", 5).find("No such file"), std::string::npos);
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

}  // namespace
}  // namespace kpsa
