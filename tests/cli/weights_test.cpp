// kpsa weights, as a user runs it: maps out, in, and over to the other side.
#include <algorithm>
#include <cmath>

#include "files/weights_json.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/refusals.h"

namespace kpsa::engine {
namespace {

class WeightsCommand : public RefusalTest {
 protected:
  WeightsCommand() {
    folder.Write("hello.yaml", HelloFolder::Yaml());
    folder.Write("hello.glb", HelloFolder::Glb());
  }
  // A copy of the bundled face, whose weight maps may be changed.
  void CopyFace() const {
    for (const char* name : {"face.glb", "face.yaml", "face_curves.yaml", "w/face.json"})
      folder.Write(name, TemporaryFolder::Read(std::string(KPSA_SCENES_DIR "/face/") + name));
  }
  std::string Frame(const std::string& rig) const {
    ExpectGood({"eval", rig, "--times", "0.5", "-o", "frame.npz", "--force", "-q"});
    return TemporaryFolder::Read(folder / "frame.npz");
  }
  void Edit(const std::string& from, const std::string& to) const {
    folder.Write("hello.yaml", Replaced(TemporaryFolder::Read(folder / "hello.yaml"), from, to));
  }
  WeightFile Read(const std::string& name) const {
    Result<WeightFile> file = ReadWeightFile(folder / name);
    EXPECT_TRUE(file.ok()) << file.status().ToString();
    return file.ok() ? std::move(*file) : WeightFile();
  }
  static std::vector<float> Dense(const WeightFile& file, const std::string& map) {
    const NamedWeights* found = file.Find(map);
    EXPECT_NE(found, nullptr) << map;
    return found == nullptr ? std::vector<float>() : DenseWeights(file, *found);
  }
};

// What import says is what a user adds: then the rig evaluates as before, to the last bit.
TEST_F(WeightsCommand, ARoundTripKeepsEveryBit) {
  Edit("mush: {type: deltaMush, iterations: 10}",
       "mush: {type: deltaMush, iterations: 10, falloff: {at: [0, 0.5, 0], radius: 60}}");
  const std::string before = Frame("hello.yaml");
  ExpectGood({"weights", "export", "hello.yaml", "mush", "-o", "mush.json"});
  ExpectGood({"weights", "export", "hello.yaml", "column@skin", "-o", "skin.json"});
  folder.Write("w/others.json", "");
  std::string mush, skin;
  ExpectGood({"weights", "import", "hello.yaml", "mush", "mush.json"}, &mush);
  EXPECT_NE(mush.find("in place of its falloff (line 8)"), std::string::npos) << mush;
  EXPECT_NE(mush.find("weights: \"mush.json#mush\""), std::string::npos) << mush;
  ExpectGood({"weights", "import", "hello.yaml", "column_skinCluster", "skin.json", "-o", "w/skin.json"},
             &skin);
  const std::size_t line = skin.find("overrides:");
  ASSERT_NE(line, std::string::npos) << skin;
  Edit("falloff: {at: [0, 0.5, 0], radius: 60}", "weights: \"mush.json#mush\"");
  folder.Write("hello.yaml", TemporaryFolder::Read(folder / "hello.yaml") + skin.substr(line));
  EXPECT_TRUE(Frame("hello.yaml") == before);

  // An edited skin, imported where the rig looks for it now
  const std::string text = TemporaryFolder::Read(folder / "skin.json");
  WeightFile edited = Read("skin.json");
  edited.maps[0].values.assign(edited.maps[0].values.size(), 0.5f);
  folder.Write("skin.json", WeightFileText(edited));
  ExpectRefused({"weights", "import", "hello.yaml", "column@skin", "skin.json"}, 2,
                {"w/skin.json", "--force"});
  ExpectGood({"weights", "import", "hello.yaml", "column@skin", "skin.json", "--force"}, &skin);
  EXPECT_EQ(skin, "");
  EXPECT_FALSE(Frame("hello.yaml") == before);
  folder.Write("skin.json", text);
  ExpectGood({"weights", "import", "hello.yaml", "column@skin", "skin.json", "--force", "-q"});
  EXPECT_TRUE(Frame("hello.yaml") == before);
}

// Of a file with many maps one is replaced, all others stay.
TEST_F(WeightsCommand, ImportReplacesOneMap) {
  CopyFace();
  const WeightFile before = Read("w/face.json");
  std::string text;
  ExpectGood({"weights", "export", "face.yaml", "mush", "-q"}, &text);
  folder.Write("mush.json", text);
  EXPECT_EQ(Dense(Read("mush.json"), "mush"), Dense(before, "mush"));
  const std::string changed = Replaced(text, "\"default\": 1", "\"default\": 0.5");
  folder.Write("mush.json", changed);
  ExpectRefused({"weights", "import", "face.yaml", "mush", "mush.json"}, 2, {"w/face.json", "--force"});
  ExpectGood({"weights", "import", "face.yaml", "mush", "mush.json", "--force"});
  const WeightFile after = Read("w/face.json");
  ASSERT_EQ(after.maps.size(), before.maps.size());
  for (std::size_t m = 0; m < after.maps.size(); ++m) {
    EXPECT_EQ(after.maps[m].name, before.maps[m].name);
    EXPECT_EQ(DenseWeights(after, after.maps[m]) == DenseWeights(before, before.maps[m]),
              after.maps[m].name != "mush");
  }
  EXPECT_EQ(Dense(after, "mush"), Dense(Read("mush.json"), "mush"));
}

TEST_F(WeightsCommand, ASymmetricFaceMirrorsOntoItself) {
  const std::string face = KPSA_SCENES_DIR "/face/face.yaml";
  ExpectGood({"weights", "export", face, "browWireR", "-o", "right.json", "-q"});
  ExpectGood({"weights", "mirror", face, "browWireL", "--flip", "-o", "flipped.json", "-q"});
  const std::vector<float> right = Dense(Read("right.json"), "browWireR"),
                           flipped = Dense(Read("flipped.json"), "browWireL");
  ASSERT_EQ(right.size(), flipped.size());
  EXPECT_GT(*std::max_element(right.begin(), right.end()), 0.5f);
  for (std::size_t v = 0; v < right.size(); ++v) EXPECT_NEAR(right[v], flipped[v], 1e-3) << v;

  ExpectGood({"weights", "export", face, "face_mesh@skin", "-o", "skin.json", "-q"});
  ExpectGood({"weights", "mirror", face, "face_mesh@skin", "--right-to-left", "-o", "mirrored.json", "-q"});
  const WeightFile skin = Read("skin.json"), mirrored = Read("mirrored.json");
  ASSERT_EQ(mirrored.maps.size(), skin.maps.size());
  for (const NamedWeights& map : skin.maps) {
    const std::vector<float> a = Dense(skin, map.name), b = Dense(mirrored, map.name);
    for (std::size_t v = 0; v < a.size(); ++v) EXPECT_NEAR(a[v], b[v], 1e-3) << map.name << " " << v;
  }
}

// Files of a referenced rig's deformers are that rig's, and what import says goes into it.
TEST_F(WeightsCommand, DeformersOfReferencesHaveTheNamesOfTheirRig) {
  folder.Write("two.yaml", "kpsa: 1\nreferences: {a: {file: hello.yaml}, b: {file: hello.yaml}}\n");
  const std::string before = Frame("two.yaml");
  std::string here, there;
  for (const auto& [own, referenced] :
       {std::pair("mush", "a:mush"), std::pair("column@skin", "a:column@skin")}) {
    ExpectGood({"weights", "export", "hello.yaml", own, "-q"}, &here);
    ExpectGood({"weights", "export", "two.yaml", referenced, "-q"}, &there);
    EXPECT_EQ(here, there);
    folder.Write(own == std::string("mush") ? "mush.json" : "skin.json", there);
    ExpectGood({"weights", "mirror", "hello.yaml", own, "--flip", "-q"}, &here);
    ExpectGood({"weights", "mirror", "two.yaml", referenced, "--flip", "-q"}, &there);
    EXPECT_EQ(here, there);
  }
  std::string mush, skin;
  folder.Write("w/others.json", "");
  ExpectGood({"weights", "import", "two.yaml", "a:mush", "mush.json", "-o", "w/m.json", "-q"}, &mush);
  EXPECT_NE(mush.find("hello.yaml:8:3: give \"mush\" this map\n  weights: \"w/m.json#mush\""),
            std::string::npos)
      << mush;
  ExpectGood({"weights", "import", "two.yaml", "a:column@skin", "skin.json", "-q"}, &skin);
  const std::size_t line = skin.find("overrides:");
  ASSERT_NE(line, std::string::npos) << skin;
  Edit("iterations: 10}", "iterations: 10, weights: \"w/m.json#mush\"}");
  folder.Write("two.yaml", TemporaryFolder::Read(folder / "two.yaml") + skin.substr(line));
  EXPECT_TRUE(Frame("two.yaml") == before);
  ExpectGood({"weights", "import", "two.yaml", "a:mush", "mush.json", "--force", "-q"}, &mush);
  EXPECT_EQ(mush, "");
  folder.Write("other.json",
               Replaced(TemporaryFolder::Read(folder / "mush.json"), "\"column\"", "\"a:column\""));
  ExpectRefused({"weights", "import", "two.yaml", "a:mush", "other.json"}, 3, {"expected \"column\""});
}

TEST_F(WeightsCommand, MistakesChangeNothing) {
  folder.Write("w.json",
               R"({"kpsa": "weights", "version": 1, "mesh": "column", "points": 5, "maps": {"m": {}}})");
  folder.Write("range.json", R"({"kpsa": "weights", "version": 1, "mesh": "column", "points": 794,
    "maps": {"m": {"default": 1.5}, "n": {}}})");
  ExpectRefused({"weights"}, 2, {"kpsa weights: expected one of export, import, mirror", "--help"});
  ExpectRefused({"weights", "exprot", "hello.yaml", "mush"}, 2, {"did you mean \"export\""});
  ExpectRefused({"weights", "export", "hello.yaml"}, 2, {"kpsa weights export: expected DEFORMER"});
  ExpectRefused({"weights", "export", "hello.yaml", "mush", "--ouput", "a.json"}, 2,
                {"did you mean \"--output\""});
  ExpectRefused({"weights", "export", "hello.yaml", "mosh"}, 2, {"did you mean \"mush\""});
  ExpectRefused({"weights", "export", "hello.yaml", "mush", "-o", "a.npz"}, 2, {".json"});
  ExpectRefused({"weights", "export", "hello.yaml", "mush", "-o", "w.json"}, 2, {"--force"});
  ExpectRefused({"weights", "import", "hello.yaml", "mush", "none.json"}, 3, {"none.json"});
  ExpectRefused({"weights", "import", "hello.yaml", "mush", "w.json"}, 3, {"is for 5 vertices; column has"});
  ExpectRefused({"weights", "import", "hello.yaml", "mush", "hello.yaml"}, 3, {"hello.yaml:1:1"});
  const std::string count = std::to_string([&] {
    ExpectGood({"weights", "export", "hello.yaml", "mush", "-o", "count.json", "-q"});
    return Read("count.json").points;
  }());
  folder.Write("range.json", Replaced(TemporaryFolder::Read(folder / "range.json"), "794", count));
  ExpectRefused({"weights", "import", "hello.yaml", "mush", "range.json"}, 3, {"the file has the maps m, n"});
  ExpectRefused({"weights", "import", "hello.yaml", "mush", "range.json#m"}, 3,
                {"weighs 1.5, outside of 0 to 1"});
  ExpectRefused({"weights", "import", "hello.yaml", "mush", "range.json#o"}, 3, {"has no map \"o\""});
  ExpectRefused({"weights", "import", "hello.yaml", "column@skin", "range.json"}, 3,
                {"no joint of the skin"});
  ExpectRefused({"weights", "import", "hello.yaml", "mush", "range.json#n", "-o", "w.json", "--force"}, 3,
                {"w.json", "is for 5 vertices"});
  ExpectRefused({"weights", "mirror", "hello.yaml", "mush", "--axis", "w"}, 2, {"x, y or z"});
  ExpectRefused({"weights", "mirror", "hello.yaml", "mush", "--flip", "--left-to-right"}, 2, {"one of"});
  ExpectRefused({"weights", "mirror", "hello.yaml", "mush", "--names", ".L"}, 2, {".L=.R"});
  ExpectRefused({"weights", "mirror", "hello.yaml", "mush", "--tolerance", "-1mm"}, 2, {"--tolerance"});
}

}  // namespace
}  // namespace kpsa::engine
