// Mistakes on the command line and in files: one clear message of at most five lines, the right exit code, no
// output.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/process.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

struct Refusal {
  std::vector<std::string> arguments;
  int exit_code;
  std::string message;  // part of what is printed
};

void ExpectRefused(const Refusal& refusal, const TemporaryFolder& folder) {
  std::string line;
  for (const std::string& word : refusal.arguments) line += word + " ";
  SCOPED_TRACE(line);
  const std::size_t before = folder.FileCount();
  const ProcessResult run = RunKpsa(refusal.arguments, 20, folder.path());
  EXPECT_EQ(run.exit_code, refusal.exit_code) << run.err;
  EXPECT_NE(run.err.find(refusal.message), std::string::npos) << run.err;
  EXPECT_GE(run.error_lines(), 1u);
  EXPECT_LE(run.error_lines(), 5u) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(folder.FileCount(), before) << "something was written";
}

TEST(Arguments, UsageMistakes) {
  const TemporaryFolder folder;
  folder.Write("taken.npz", "x");
  folder.Write("head.json", "{}");
  const auto eval = [](std::vector<std::string> more) {
    std::vector<std::string> words = {"eval", kHello, "-o", "out.npz"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const std::vector<Refusal> refusals = {
      {{"evla", kHello}, 2, "did you mean \"eval\""},
      {{"--versoin"}, 2, "did you mean \"--version\""},
      {{"eval"}, 2, "FILE"},
      {{"eval", kHello}, 2, "expected -o"},
      {eval({"--frmaes", "0:1"}), 2, "did you mean \"--frames\""},
      {eval({"extra"}), 2, "unexpected argument \"extra\""},
      {eval({"--frames", "10:1"}), 2, "before the first"},
      {eval({"--frames", "0:10:0"}), 2, "step of 1 or more"},
      {eval({"--frames", "0:10:-1"}), 2, "step of 1 or more"},
      {eval({"--frames", "0:1e12"}), 2, "whole numbers"},
      {eval({"--frames", "0:1000000000000"}), 2, "more than"},
      {eval({"--frames", "0:99999999999999999999"}), 2, "whole numbers"},
      {eval({"--frames", "0:1:2:3"}), 2, "4 parts"},
      {eval({"--frames", ""}), 2, "whole numbers"},
      {eval({"--frames", ":"}), 2, "whole numbers"},
      {eval({"--times", "nan"}), 2, "finite number"},
      {eval({"--times", "0,inf"}), 2, "finite number"},
      {eval({"--times", "0,,1"}), 2, "finite number"},
      {eval({"--times", "1e999"}), 2, "finite number"},
      {eval({"--times", "0x10"}), 2, "finite number"},
      {eval({"--times", "0", "--frames", "0"}), 2, "one of them"},
      {eval({"--threads", "0"}), 2, "from 1 to 1024"},
      {eval({"--threads", "-3"}), 2, "from 1 to 1024"},
      {eval({"--threads", "many"}), 2, "from 1 to 1024"},
      {eval({"--threads", "1000000000000"}), 2, "from 1 to 1024"},
      {eval({"--fps", "0"}), 2, "--fps"},
      {eval({"--fps", "nan"}), 2, "--fps"},
      {eval({"--fps", "-24"}), 2, "--fps"},
      {eval({"--clip", "wavee"}), 2, "did you mean \"wave\""},
      {eval({"--clip", "wave", "--rest"}), 2, "one of them"},
      {eval({"--variant", "game"}), 2, "game"},
      {eval({"--set", "upper.rotatZ=3"}), 2, "did you mean"},
      {eval({"--set", "uper.rotateZ=3"}), 2, "upper"},
      {eval({"--set", "upper.rotateZ"}), 2, "plug=value"},
      {eval({"--set", "upper.rotateZ=fast"}), 2, "fast"},
      {eval({"--set", "upper.rotateZ=.nan"}), 2, "nan"},
      {eval({"--set", "mush.iterations=-1"}), 2, "mush.iterations"},
      {eval({"--set", "upper.worldMatrix=3"}), 2, "output"},
      {eval({"--pose", "none.yaml"}), 3, "none.yaml"},
      {eval({"--stale", "miss"}), 2, "--accelerate"},
      {eval({"--accelerate", "--stale", "perhaps"}), 2, "refuse or miss"},
      {eval({"--accelerate", "--kpsa", "x.kpsa"}), 2, "one of them"},
      {eval({"--kpsa", "x.kpsa"}), 3, "no such file"},
      {eval({"--accelerate", "--tolerance", "-1mm"}), 2, "--tolerance"},
      {eval({"--accelerate", "--tolerance", "nan"}), 2, "--tolerance"},
      {eval({"--accelerate", "--tolerance", "all"}), 2, "or any"},
      {{"train", kHello, "--tolerance", "any", "-o", "out.kpsa"}, 2, "--tolerance"},
      {{"train", kHello, "--tolerance", "0", "-o", "out.kpsa"}, 2, "a length above 0"},
      {eval({"--accelerate", "--violation-rate", "2"}), 2, "0 to 1"},
      {eval({"--blender"}), 2, ".pc2"},
      {{"eval", kHello, "-o", "out.abc"}, 2, ".usda"},
      {{"eval", kHello, "-o", "out"}, 2, ".npz"},
      {{"eval", kHello, "-o", ""}, 2, "empty"},
      {{"eval", kHello, "-o", "taken.npz"}, 2, "--force"},
      {{"eval", kHello, "-o", "no/such/folder/out.npz"}, 2, "cannot be written"},
      {{"eval", kHello, "-o", "-", "--json"}, 2, "one of them"},
      {{"eval", kHelloGlb, "-o", kHelloGlb, "--force"}, 2, "is the input"},
      {{"eval", "none.yaml", "-o", "out.npz"}, 3, "none.yaml"},
      {{"eval", "none.glb", "-o", "out.npz"}, 3, "none.glb"},
      {{"eval", folder.path(), "-o", "out.npz"}, 3, "folder"},
      {{"get", kHello}, 2, "PLUG"},
      {{"get", kHello, "upper.worldMatrxi"}, 2, "did you mean"},
      {{"get", kHello, "colum@mush"}, 2, "did you mean \"column\""},
      {{"get", kHello, "column@bogus"}, 2, "it has"},
      {{"get", kHello, "upper.worldMatrix", "--format", "xml"}, 2, "csv or json"},
      {{"compile", kHello, "--vertices", "0:9999999"}, 2, "out of range"},
      {{"compile", kHello, "--vertices", "5:1"}, 2, "0:99,120"},
      {{"profile", kHello, "--trace", "trace.txt"}, 2, ".json"},
      {{"profile", kHello, "--sort", "colour"}, 2, "inclusive"},
      {{"profile", kHello, "--top", "0"}, 2, "--top"},
      {{"compare", "a.npz"}, 2, "B"},
      {{"compare", "a.txt", "b.txt"}, 2, ".npz"},
      {{"compare", "a.npz", "b.npz"}, 3, "a.npz"},
      {{"compare", "taken.npz", "taken.npz"}, 3, "taken.npz"},
      {{"compare", "a.npz", "b.npz", "--tolerance", "-1"}, 2, "--tolerance"},
      {{"nodes", "deltaMsh"}, 2, "did you mean \"deltaMush\""},
      {{"nodes", "nonLinear"}, 2, "bend, flare, sine, squash, twist or wave"},
      {{"inspect", "a.txt"}, 2, ".glb"},
      {{"inspect", "none.npz"}, 3, "none.npz"},
      {{"inspect", "head.json"}, 3, "head.json"},
      {{"init", kHello}, 2, ".glb"},
      {{"init", "none.glb"}, 3, "none.glb"},
      {{"train", kHelloGlb}, 3, "accelerate"},
      {{"train", kHello, "--samples", "-1", "-o", "x.kpsa"}, 2, "--samples"},
      {{"train", kHello, "--clips", "wavy", "-o", "x.kpsa"},
       2,
       "(did you mean \"wave\"?); its clips are wave"},
      {{"train", kHello, "--clips", "wave", "-o", "x.kpsa"}, 2, "never trained on"},
      {{"train", kHello, "-o", "x.npz"}, 2, ".kpsa"},
      {{"train", kHello, "--name", "colum", "-o", "x.kpsa"},
       2,
       "--name: \"colum\": the rig accelerates column (did you mean \"column\"?)"},
      {{"train", kHello, "--key-points", "1", "-o", "x.kpsa"}, 2, "--key-points"},
      {{"bench", kHello, "--kpsa", "none.kpsa"}, 3, "kpsa train"},
      {{"bench", kHello, "--runs", "0"}, 2, "--runs"},
      {{"get", KPSA_SCENES_DIR "/boy/boy.yaml", "face_mesh@fixx"}, 2, " more"},
      {{"nodes", "bend", "--pictures", "pictures"}, 2, "no TYPE"},
      {{"bench", kHello, "--tolerance", "1mm", "--tolerance", "2mm"}, 2, "one for each"},
      {{"bench", kHello, "--tolerance", "some"}, 2, "--tolerance"},
      {{"report"}, 2, "FILE"},
      {{"report", "none.json"}, 3, "none.json"},
      {{"report", "head.json"}, 3, "kpsa bench --json"},
      {{"report", "head.json", "--csv", "a.png"}, 2, ".csv"},
      {{"report", "none.json", "--csv", "a.csv"}, 3, "none.json"},
      {{"report", "head.json", "--reference", "1x", "--reference", "2x"}, 2, "--reference"},
      {{"render", kHello}, 2, ".png"},
      {{"render", kHello, "-o", "a.png", "--size", "1000000x1"}, 2, "--size"},
      {{"render", kHello, "-o", "a.png", "--size", "big"}, 2, "WIDTHxHEIGHT"},
      {{"render", kHello, "-o", "a.png", "--azimuth", "nan"}, 2, "finite"},
      {{"render", kHello, "-o", "a.png", "--turntable", "1000"}, 2, "--turntable"},
      {{"graph", kHello, "-o", "a.txt"}, 2, ".dot"},
  };
  for (const Refusal& refusal : refusals) ExpectRefused(refusal, folder);
}

TEST(Arguments, BrokenFiles) {
  const TemporaryFolder folder;
  const auto broken = [&](const std::string& name, const std::string& content, const std::string& message) {
    folder.Write(name, content);
    ExpectRefused({{"eval", name, "-o", "out.npz"}, 3, message}, folder);
    ExpectRefused({{"profile", name}, 3, message}, folder);
  };
  broken("empty.yaml", "", "empty.yaml");
  broken("text.yaml", "hello", "text.yaml");
  broken("tab.yaml", "kpsa: 1\n\tcharacter: x.glb\n", "tab.yaml:2");
  broken("nochar.yaml", "kpsa: 1\ncharacter: none.glb\n", "none.glb");
  broken("typo.yaml", "kpsa: 1\ncharacter: " + kHelloGlb + "\nnodes:\n  m: {type: deltaMsuh}\n",
         "did you mean \"deltaMush\"");
  broken("deep.yaml", "kpsa: 1\nnodes: " + std::string(100000, '[') + "\n", "deep.yaml");
  broken("empty.glb", "", "empty.glb");
  broken("short.glb", "glTF", "short.glb");
  broken("deep.gltf", std::string(200000, '['), "deep.gltf");
  broken("json.gltf",
         R"({"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]})",
         "json.gltf");
  // Many errors: the first ones, and how many there are
  std::string many = "kpsa: 1\ncharacter: " + kHelloGlb + "\nnodes:\n";
  for (int i = 0; i < 50; ++i) many += "  n" + std::to_string(i) + ": {type: nonsense}\n";
  broken("many.yaml", many, "more lines");
  const ProcessResult all = RunKpsa({"validate", folder / "many.yaml"});
  EXPECT_EQ(all.exit_code, 3);
  EXPECT_GE(all.error_lines(), 50u);
  const ProcessResult json = RunKpsa({"validate", folder / "many.yaml", "--json"});
  EXPECT_EQ(json.exit_code, 3);
  const auto document = nlohmann::json::parse(json.out, nullptr, false);
  ASSERT_FALSE(document.is_discarded());
  EXPECT_EQ(document["valid"], false);
  EXPECT_EQ(document["errors"].size(), 50u);
  EXPECT_EQ(document["errors"][0]["line"], 4);
}

TEST(Arguments, HelpAndFirstMinutes) {
  const ProcessResult bare = RunKpsa({});
  EXPECT_EQ(bare.exit_code, 0);
  for (const char* word : {"kpsa init", "kpsa train", "kpsa bench"})
    EXPECT_NE(bare.out.find(word), std::string::npos);
  const ProcessResult help = RunKpsa({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* name : {"init", "validate", "inspect", "eval", "get", "render", "train", "bench", "report",
                           "compile", "profile", "explain", "compare", "graph", "nodes", "weights", "fmt"}) {
    EXPECT_NE(help.out.find(std::string("  ") + name), std::string::npos) << name;
    const ProcessResult one = RunKpsa({name, "--help"});
    EXPECT_EQ(one.exit_code, 0) << name;
    EXPECT_NE(one.out.find("Examples:"), std::string::npos) << name;
    EXPECT_EQ(one.err, "") << name;
  }
  const ProcessResult version = RunKpsa({"--version"});
  EXPECT_EQ(version.out.substr(0, 5), "kpsa ");
  for (const char* part : {"compiled by ", "vector unit in use: ", "Eigen 3.", "Embree 3."})
    EXPECT_NE(version.out.find(part), std::string::npos) << version.out;
}

}  // namespace
}  // namespace kpsa::engine
