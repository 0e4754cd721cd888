// Weights of deformers and skins as files and over a plane, on a strip of quads along x with the joints hip
// (in the middle), leg.L and leg.R; two vertices of its right end lie on one point (a seam).
#include "rig/build/deformer_weights.h"

#include <cmath>

#include "rig/character/mesh_weights.h"
#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

constexpr int kColumns = 9;  // x from -1 to 1; even vertices below, odd ones above

// stored: positions are as KHR_mesh_quantization has them, of other units and from another origin, and the skin says where
// they are.
std::string Strip(float shift = 0, bool stored = false) {
  GltfBuilder b;
  std::vector<float> positions, weights;
  std::vector<std::uint8_t> joints;
  std::vector<std::uint16_t> indices;
  const auto add = [&](int column, int row) {
    const float x = static_cast<float>(column - kColumns / 2) / 4, side = std::fabs(x);
    positions.insert(positions.end(), {x + shift, static_cast<float>(row), 0});
    joints.insert(joints.end(), {static_cast<std::uint8_t>(x > 0 ? 1 : 2), 0, 0, 0});
    weights.insert(weights.end(), {side * 0.9f, 1 - side * 0.9f, 0, 0});
  };
  for (int column = 0; column < kColumns; ++column) {
    for (int row = 0; row < 2; ++row) add(column, row);
    if (column == 0) continue;
    for (int i : {-2, 0, -1, -1, 0, 1}) indices.push_back(static_cast<std::uint16_t>(2 * column + i));
  }
  add(0, 0);  // a seam
  std::vector<float> inverse_binds(48, 0.f);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 4; ++k) inverse_binds[16 * i + 5 * k] = 1;
  }
  for (std::size_t i = 0; stored && i < positions.size(); ++i)
    positions[i] = (positions[i] + (i % 3 == 0 ? 5.f : 0.f)) * 1024;
  for (std::size_t i = 0; stored && i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) inverse_binds[16 * i + 5 * k] = 1 / 1024.f;
    inverse_binds[16 * i + 12] = -5;
  }
  b.Push("meshes", {{"primitives",
                     {{{"attributes",
                        {{"POSITION", b.Accessor(positions, "VEC3")},
                         {"JOINTS_0", b.Accessor(joints, "VEC4")},
                         {"WEIGHTS_0", b.Accessor(weights, "VEC4")}}},
                       {"indices", b.Accessor(indices, "SCALAR")}}}}});
  b.Push("skins", {{"joints", {1, 2, 3}}, {"inverseBindMatrices", b.Accessor(inverse_binds, "MAT4")}});
  b.Push("nodes", {{"name", "strip"}, {"mesh", 0}, {"skin", 0}});
  b.Push("nodes", {{"name", "hip"}, {"children", {2, 3}}});
  b.Push("nodes", {{"name", "leg.L"}});
  b.Push("nodes", {{"name", "leg.R"}});
  b.Push("scenes", {{"nodes", {0, 1}}});
  b.root["scene"] = 0;
  return b.Text();
}

class DeformerWeightsTest : public RigFixture {
 protected:
  DeformerWeightsTest() { folder.Write("c.gltf", Strip()); }

  static constexpr char kRig[] =
      "nodes:\n"
      "  soft: {type: cluster, members: {vertices: \"4:18\"}, weights: \"w.json#ramp\", falloff: {at: [0.5, "
      "0, "
      "0], radius: 2}}\n"
      "  all: {type: deltaMush}\n"
      "deform: [{meshes: [strip], stack: [gltf, soft, all]}]\n"
      "controls: {leg.L.translateY: {min: -1, max: 1}, hip.rotateZ: {min: -9, max: 9}}\n";
  Rig Strips(const std::string& more = "") {
    WeightFile file{"strip", 19, {{"ramp", 1, {2, 8, 12}, {0.25f, 0.7f, 0.1f}}}};
    folder.Write("w.json", WeightFileText(file));
    return Loaded(kRig + more);
  }
  static DeformedMesh Find(const Rig& rig, const std::string& name) {
    const Result<DeformedMesh> found = FindDeformed(rig, name);
    EXPECT_TRUE(found.ok()) << found.status().ToString();
    return found.ok() ? *found : DeformedMesh();
  }
  static WeightFile Weights(const Rig& rig, const std::string& name) {
    Result<WeightFile> file = DeformerWeights(rig, Find(rig, name));
    EXPECT_TRUE(file.ok()) << file.status().ToString();
    return file.ok() ? std::move(*file) : WeightFile();
  }
  static MirroredWeights Mirrored(const Rig& rig, const std::string& name, MirrorOptions options) {
    if (options.names.empty()) options.names = DefaultNamePairs();
    Result<MirroredWeights> mirrored = MirrorWeights(rig, Find(rig, name), options);
    EXPECT_TRUE(mirrored.ok()) << mirrored.status().ToString();
    return mirrored.ok() ? std::move(*mirrored) : MirroredWeights();
  }
  std::vector<Double3> Posed(const std::string& rig) {
    RigPlayer player(folder.Write("posed.yaml", "kpsa: 1\ncharacter: c.gltf\n" + rig));
    player.Set("leg.L.translateY", 0.3);
    player.Set("hip.rotateZ", 0.1);
    return player.Points();
  }
  std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
};

TEST_F(DeformerWeightsTest, MembersMapsAndFalloffsAreNumbers) {
  const Rig rig = Strips();
  const WeightFile file = Weights(rig, "soft");
  EXPECT_EQ(file.mesh, "strip");
  EXPECT_EQ(file.points, 19u);
  ASSERT_EQ(file.maps.size(), 1u);
  EXPECT_EQ(file.maps[0].name, "soft");
  const std::vector<float> weights = DenseWeights(file, file.maps[0]);
  EXPECT_EQ(weights[2], 0);            // no member
  EXPECT_FLOAT_EQ(weights[12], 0.1f);  // where the falloff is 1
  EXPECT_LT(weights[8], 0.7f);         // within it
  EXPECT_GT(weights[8], 0.1f);
  EXPECT_GT(weights[14], weights[8]);
  // The seam's vertices are one point, a member by its second vertex
  EXPECT_EQ(weights[0], weights[18]);
  EXPECT_GT(weights[0], 0);
  EXPECT_TRUE(Weights(rig, "strip@all").maps[0].indices.empty());
  EXPECT_EQ(Weights(rig, "all").maps[0].default_value, 1);
}

TEST_F(DeformerWeightsTest, WhatIsWrittenReadsBackTheSameBits) {
  const Rig rig = Strips();
  folder.Write("soft.json", WeightFileText(Weights(rig, "soft")));
  folder.Write("skin.json", WeightFileText(Weights(rig, "strip_skinCluster")));
  const std::vector<Double3> expected = Posed(kRig);
  const std::string again =
      Replaced(
          kRig,
          "members: {vertices: \"4:18\"}, weights: \"w.json#ramp\", falloff: {at: [0.5, 0, 0], radius: 2}",
          "weights: \"soft.json\"") +
      "overrides: {strip_skinCluster.influences: skin.json}\n";
  EXPECT_EQ(Posed(again), expected);
  // ... and weights that were edited count
  WeightFile edited = Weights(rig, "strip@skin");
  ASSERT_EQ(edited.maps.size(), 3u);
  EXPECT_EQ(edited.maps[1].name, "leg.L");
  edited.maps[1].values.assign(edited.maps[1].values.size(), 0.5f);
  folder.Write("skin.json", WeightFileText(edited));
  EXPECT_NE(Posed(again), expected);
}

// Any order of maps and sums, vertices of a seam apart: the mean, divided by the sum.
TEST_F(DeformerWeightsTest, SkinsAreNormalised) {
  Strips();
  const Rig plain = Loaded("");
  WeightFile file = Weights(plain, "strip@skin");
  std::reverse(file.maps.begin(), file.maps.end());
  for (NamedWeights& map : file.maps) {
    for (std::size_t i = 0; i < map.indices.size(); ++i) {
      map.values[i] *= 3;
      if (map.indices[i] == 18) map.values[i] = map.name == "hip" ? 3 : 0;
    }
  }
  folder.Write("skin.json", WeightFileText(file));
  const Rig rig = Loaded("overrides: {strip.influences: skin.json}\n");
  const CharacterMesh &before = plain.scene.meshes[0], &after = rig.scene.meshes[0];
  const Index seam = before.mesh().data().vertex_to_point[0];
  ASSERT_EQ(seam, before.mesh().data().vertex_to_point[18]);
  ASSERT_EQ(after.influences->offsets(), before.influences->offsets());
  EXPECT_EQ(after.influences->joints(), before.influences->joints());
  for (Index p = 0; p < before.mesh().point_count(); ++p) {
    double sum = 0;
    for (Index i = before.influences->offsets()[p]; i < before.influences->offsets()[p + 1]; ++i) {
      const double weight = after.influences->weights()[i], old = before.influences->weights()[i];
      sum += weight;
      const bool hip = before.influences->joints()[i] == 0;
      EXPECT_NEAR(weight, p != seam ? old : hip ? (old + 1) / 2 : old / 2, 1e-6) << p;
    }
    EXPECT_NEAR(sum, 1, 1e-6);
  }
  EXPECT_TRUE(rig.graph
                  ->FindValue({after.skin_cluster,
                               rig.graph->def(after.skin_cluster).FindAttribute("influences"), 0, -1})
                  ->asset<Influences>() == after.influences.get());
}

TEST_F(DeformerWeightsTest, BadSkinsAreRefused) {
  const Rig rig = Strips();
  const auto refuses = [&](const std::function<void(WeightFile*)>& change, const std::string& message) {
    WeightFile file = Weights(rig, "strip@skin");
    change(&file);
    folder.Write("skin.json", WeightFileText(file));
    const std::string errors = Errors("overrides: {strip_skinCluster.influences: skin.json}\n");
    EXPECT_TRUE(Has(errors, message)) << errors;
    file.path = "skin.json";
    EXPECT_FALSE(CheckWeights(rig, Find(rig, "strip@skin"), file).ok()) << message;
  };
  refuses([](WeightFile* file) { file->maps[1].name = "leg.l"; },
          "no joint of the skin of strip is called so (did you mean \"leg.L\"?)");
  refuses([](WeightFile* file) { file->maps[1].values[0] = -0.5f; }, "has the negative weight -0.5");
  refuses([](WeightFile* file) { file->maps.clear(); }, "no joint moves vertex 0");
  refuses([](WeightFile* file) { file->mesh = "stripe"; }, "is for mesh \"stripe\"");
  refuses([](WeightFile* file) { file->points = 20; }, "is for 20 vertices; strip has 19");
  EXPECT_TRUE(Has(Errors("overrides: {strip_skinCluster.influences: none.json}\n"), "none.json"));
  EXPECT_TRUE(Has(Errors("overrides: {strip_skinCluster.influences: 3}\n"), "t.yaml:3:43"));
}

TEST_F(DeformerWeightsTest, FindsDeformersByNameAndStage) {
  const Rig rig = Strips();
  EXPECT_TRUE(Find(rig, "strip@skin").is_skin());
  EXPECT_FALSE(Find(rig, "soft").is_skin());
  const auto error = [&](const std::string& name) { return FindDeformed(rig, name).status().ToString(); };
  EXPECT_TRUE(Has(error("sotf"), "did you mean \"soft\"")) << error("sotf");
  EXPECT_TRUE(Has(error("strip@sotf"), "did you mean \"strip@soft\"")) << error("strip@sotf");
}

TEST_F(DeformerWeightsTest, TheRigRemembersWhereWeightsComeFrom) {
  const Rig rig = Strips();
  std::string text;
  for (const WeightSource& source : rig.weights)
    text += fmt::format("{} {} {} {}#{}\n", rig.graph->name(source.deformer), source.key, source.geometry,
                        Short(source.path), source.map);
  EXPECT_EQ(text, "soft members  #\nsoft falloff  #\nsoft weights strip w.json#ramp\n");
}

TEST_F(DeformerWeightsTest, AMirroredSymmetricSkinIsItself) {
  const Rig rig = Strips();
  const std::string text = WeightFileText(Weights(rig, "strip@skin"));
  for (const auto from :
       {MirrorOptions::From::kLeft, MirrorOptions::From::kRight, MirrorOptions::From::kBoth}) {
    const MirroredWeights mirrored = Mirrored(rig, "strip@skin", {.from = from});
    EXPECT_EQ(WeightFileText(mirrored.file), text);
    EXPECT_TRUE(mirrored.unmatched.empty());
    EXPECT_TRUE(mirrored.unpaired.empty());
    EXPECT_EQ(mirrored.farthest, 0);
  }
}

TEST_F(DeformerWeightsTest, OneSideGoesToTheOther) {
  Strips();
  WeightFile file = Weights(Loaded(""), "strip@skin");
  // leg.L takes vertex 16 (x = 1) whole; vertex 0 is its partner
  for (NamedWeights& map : file.maps) {
    for (std::size_t i = 0; i < map.indices.size(); ++i) {
      if (map.indices[i] == 16) map.values[i] = map.name == "leg.L" ? 1 : 0;
    }
  }
  folder.Write("skin.json", WeightFileText(file));
  const Rig rig = Loaded("overrides: {strip.influences: skin.json}\n");
  const auto weight = [](const WeightFile& of, const char* joint, Index vertex) {
    const NamedWeights* map = of.Find(joint);
    return map == nullptr ? -1 : DenseWeights(of, *map)[vertex];
  };
  const WeightFile left = Mirrored(rig, "strip@skin", {}).file;
  EXPECT_EQ(weight(left, "leg.L", 16), 1);
  EXPECT_EQ(weight(left, "leg.R", 0), 1);
  EXPECT_EQ(weight(left, "leg.R", 18), 1);
  EXPECT_EQ(weight(left, "leg.L", 0), 0);
  const WeightFile right = Mirrored(rig, "strip@skin", {.from = MirrorOptions::From::kRight}).file;
  EXPECT_FLOAT_EQ(weight(right, "leg.L", 16), 0.9f);
  EXPECT_FLOAT_EQ(weight(right, "leg.R", 0), 0.9f);
  const WeightFile both = Mirrored(rig, "strip@skin", {.from = MirrorOptions::From::kBoth}).file;
  EXPECT_EQ(weight(both, "leg.R", 0), 1);
  EXPECT_FLOAT_EQ(weight(both, "leg.L", 16), 0.9f);
  // Other names, other axis: nobody changes sides
  const MirroredWeights none = Mirrored(rig, "strip@skin", {.names = {{"_lt", "_rt"}}});
  EXPECT_EQ(weight(none.file, "leg.L", 0), 1);
  const MirroredWeights along_z = Mirrored(rig, "strip@skin", {.axis = 2});
  EXPECT_TRUE(along_z.unmatched.empty());
}

TEST_F(DeformerWeightsTest, MapsGoToTheOtherSideToo) {
  const Rig rig = Strips();
  const WeightFile before = Weights(rig, "soft");
  const std::vector<float> old = DenseWeights(before, before.maps[0]);
  const WeightFile left = Mirrored(rig, "soft", {}).file,
                   twice = Mirrored(rig, "soft", {.from = MirrorOptions::From::kBoth}).file;
  const std::vector<float> mirrored = DenseWeights(left, left.maps[0]),
                           flipped = DenseWeights(twice, twice.maps[0]);
  for (Index v = 0; v < 18; ++v) {
    const Index partner = 2 * (8 - v / 2) + v % 2;
    EXPECT_EQ(mirrored[v], v < 8 ? old[partner] : old[v]) << v;
    EXPECT_EQ(flipped[v], old[partner]) << v;
  }
  EXPECT_NE(mirrored, old);
}

TEST_F(DeformerWeightsTest, TellsWhoHasNoPartner) {
  const Rig rig = Strips();
  // Across y nobody of the upper row has one: it is 1 away from the lower row's mirror image
  const MirroredWeights mirrored = Mirrored(rig, "all", {.axis = 1, .from = MirrorOptions::From::kBoth});
  EXPECT_EQ(mirrored.unmatched.size(), 9u);
  EXPECT_DOUBLE_EQ(mirrored.farthest, 1);
  EXPECT_EQ(mirrored.unmatched[0], 1u);
  EXPECT_TRUE(Mirrored(rig, "all", {.axis = 1, .from = MirrorOptions::From::kBoth, .tolerance = 1.5})
                  .unmatched.empty());
  EXPECT_EQ(Mirrored(rig, "strip@skin", {.names = {{".L", ".X"}}}).unpaired,
            std::vector<std::string>{"leg.L"});
}

// A strip that is all on one side: the points that are nearest to their own mirror images are their own
// partners, and none of the other side's joints.
TEST_F(DeformerWeightsTest, NoPointBeyondTheToleranceSharesJoints) {
  for (const float shift : {1.25f, -1.25f}) {
    folder.Write("c.gltf", Strip(shift));
    const Rig rig = Loaded("");
    const std::vector<Index> own = shift > 0 ? std::vector<Index>{0, 1, 18} : std::vector<Index>{16, 17};
    const WeightFile before = Weights(rig, "strip@skin");
    for (const auto from :
         {MirrorOptions::From::kLeft, MirrorOptions::From::kRight, MirrorOptions::From::kBoth}) {
      const MirroredWeights mirrored = Mirrored(rig, "strip@skin", {.from = from});
      for (const char* joint : {"leg.L", "leg.R"}) {
        const NamedWeights *old = before.Find(joint), *now = mirrored.file.Find(joint);
        ASSERT_TRUE(old != nullptr);
        for (const Index v : own)
          EXPECT_EQ(now == nullptr ? 0 : DenseWeights(mirrored.file, *now)[v], DenseWeights(before, *old)[v])
              << v;
      }
      const bool is_source = from == (shift > 0 ? MirrorOptions::From::kLeft : MirrorOptions::From::kRight);
      EXPECT_EQ(mirrored.unmatched.size(), is_source ? 0u : 19u);
      if (is_source) {
        EXPECT_EQ(WeightFileText(mirrored.file), WeightFileText(before));
      }
    }
  }
}

TEST(MirroredName, NeedsAJointThatExists) {
  const std::vector<std::string> joints = {"up.Lower.L", "up.Lower.R", "LeftArm",      "RightArm",
                                           "l_thigh",    "r_thigh",    "upperarm01.L", "head"};
  const auto other = [&](const std::string& name) { return MirroredName(name, DefaultNamePairs(), joints); };
  EXPECT_EQ(other("up.Lower.L"), "up.Lower.R");
  EXPECT_EQ(other("up.Lower.R"), "up.Lower.L");
  EXPECT_EQ(other("RightArm"), "LeftArm");
  EXPECT_EQ(other("l_thigh"), "r_thigh");
  EXPECT_EQ(other("upperarm01.L"), "upperarm01.L");
  EXPECT_EQ(other("head"), "head");
}

// The middle of positions that are whole numbers is not the character's: a mirror there gave the left side joints of the
// right one.
TEST_F(DeformerWeightsTest, AStoredMeshIsMirroredWhereTheSkinHasIt) {
  const Rig plain = Loaded("");
  const MirroredWeights expected = Mirrored(plain, "strip@skin", {});
  folder.Write("c.gltf", Strip(0, true));
  const Rig rig = Loaded("");
  const MirroredWeights mirrored = Mirrored(rig, "strip@skin", {});
  EXPECT_TRUE(mirrored.unmatched.empty());
  EXPECT_NEAR(mirrored.tolerance, expected.tolerance, 1e-6) << "lengths are those of the world";
  ASSERT_EQ(mirrored.file.maps.size(), expected.file.maps.size());
  for (std::size_t m = 0; m < expected.file.maps.size(); ++m) {
    EXPECT_EQ(mirrored.file.maps[m].name, expected.file.maps[m].name);
    EXPECT_EQ(mirrored.file.maps[m].indices, expected.file.maps[m].indices);
    EXPECT_EQ(mirrored.file.maps[m].values, expected.file.maps[m].values);
  }
}

}  // namespace
}  // namespace kpsa::engine
