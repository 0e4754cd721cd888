// What the page is told of the rig, and the arrays beside it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kpsa/library.h"
#include "kpsa/scene.h"
#include "rig/build/deformer_weights.h"
#include "tests/view/live_server.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

template <typename T>
std::vector<T> ArrayOf(const std::string& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

TEST(LiveMeta, TellsOfTheRig) {
  const auto live = LiveServer::Hello(true);
  const Json meta = live->Get("/meta.json").json();
  ASSERT_TRUE(meta.is_object());
  const auto rig = Library().Load(live->rig());
  ASSERT_TRUE(rig);
  const MeshInfo& mesh = rig->meshes()[0];
  EXPECT_EQ(meta["format"], 1);
  EXPECT_EQ(meta["generation"], 1);
  EXPECT_EQ(meta["points"], mesh.vertices);
  EXPECT_EQ(meta["rig"], "rig.yaml");
  EXPECT_EQ(meta["character"], "hello.glb");
  EXPECT_EQ(meta["accelerated"], true);
  EXPECT_DOUBLE_EQ(meta["tolerance"].get<double>(), 2e-3);
  ASSERT_EQ(meta["clips"].size(), 1u);
  EXPECT_EQ(meta["clips"][0]["name"], "wave");
  EXPECT_EQ(meta["clips"][0]["fps"], 24);
  EXPECT_EQ(meta["clips"][0]["frames"].get<double>() - 1, std::floor(rig->clips()[0].end * 24 + 1e-3));
  ASSERT_EQ(meta["controls"].size(), 2u);
  EXPECT_EQ(meta["controls"][1]["name"], "upper.rotateZ");
  EXPECT_EQ(meta["controls"][1]["group"], "upper");
  EXPECT_EQ(meta["controls"][1]["label"], "rotateZ");
  EXPECT_NEAR(meta["controls"][1]["min"].get<double>(), -75, 1e-9);
  EXPECT_NEAR(meta["controls"][1]["max"].get<double>(), 30, 1e-9);

  for (const auto& [name, info] : meta["blobs"].items()) {
    const std::size_t bytes = info["type"] == "f32" || info["type"] == "u32" ? 4
                              : info["type"] == "i16"                        ? 2
                                                                             : 1;
    EXPECT_EQ(live->Get("/blob/" + name).body.size(), bytes * info["count"].get<std::size_t>()) << name;
  }
  const std::string rest = live->Get("/blob/" + meta["rest"].get<std::string>()).body;
  Scene scene(*rig);
  const auto points = scene.Points("column");
  ASSERT_TRUE(points);
  EXPECT_EQ(ArrayOf<float>(rest), std::vector<float>(points->begin(), points->end()));
  EXPECT_EQ(
      ArrayOf<std::uint32_t>(live->Get("/blob/" + meta["meshes"][0]["triangles"].get<std::string>()).body),
      mesh.triangles);
}

TEST(LiveMeta, NothingIsAcceleratedUnlessItIsAskedFor) {
  const auto live = LiveServer::Hello();
  const Json meta = live->Get("/meta.json").json();
  EXPECT_EQ(meta["accelerated"], false);
  EXPECT_FALSE(meta.contains("tolerance"));
  const Evaluated evaluated = live->Evaluate({{"mode", "both"}});
  EXPECT_EQ(evaluated.facts["parts"], Json{"full"});
  EXPECT_EQ(evaluated.facts["verdict"], nullptr);
}

TEST(LiveMeta, FieldsAreWhatWeightFilesHave) {
  const auto live = LiveServer::Hello();
  const Json meta = live->Get("/meta.json").json();
  const Rig& rig = live->session().rig()->rest();
  const Result<DeformedMesh> skin = FindDeformed(rig, "column@skin");
  ASSERT_TRUE(skin.ok());
  const Result<WeightFile> weights = DeformerWeights(rig, *skin);
  ASSERT_TRUE(weights.ok());
  std::size_t joints = 0;
  std::vector<std::string> names;
  for (const Json& field : meta["fields"]) {
    names.push_back(field["name"]);
    const std::vector<float> values = ArrayOf<float>(live->Get("/field/" + names.back()).body);
    ASSERT_EQ(values.size(), meta["points"].get<std::size_t>()) << names.back();
    if (field["group"] != "joints") continue;
    ++joints;
    const NamedWeights* map = weights->Find(field["label"].get<std::string>());
    ASSERT_NE(map, nullptr) << names.back();
    EXPECT_EQ(values, DenseWeights(*weights, *map)) << names.back();
  }
  EXPECT_EQ(joints, 2u);
  EXPECT_NE(std::find(names.begin(), names.end(), "deformer:mush"), names.end());
}

}  // namespace
}  // namespace kpsa::engine
