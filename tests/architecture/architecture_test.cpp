// The rooms know only whom they may know, and every header stands by itself. Each check has a canary: a small
// bad tree that it must find fault with.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include "tests/architecture/source_tree.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

std::string Lines(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += text + "\n";
  return all;
}

TEST(IncludeArrows, PointAsTheyMay) {
  const std::vector<SourceFile> files = ReadSourceTree(KPSA_SOURCE_DIR);
  ASSERT_GT(files.size(), 200u) << "the tree was not found";
  std::size_t includes = 0;
  for (const SourceFile& file : files) includes += file.includes.size();
  ASSERT_GT(includes, 1000u);
  EXPECT_EQ(Lines(FindBreaches(files)), "");
}

TEST(IncludeArrows, CanaryOfEveryArrow) {
  TemporaryFolder tree;
  const std::pair<const char*, const char*> bad[] = {
      {"base/a.h", "graph/a.h"},
      {"base/b.cpp", "cli/a.h"},
      {"base/c.h", "files/a.h"},
      {"graph/a.cpp", "nodes/a.h"},
      {"graph/b.h", "kpsa/a.h"},
      {"graph/c.h", "rig/build/a.h"},
      {"graph/d.h", "bench/a.h"},
      {"graph/e.h", "files/a.h"},
      {"nodes/a.h", "kpsa/a.h"},
      {"nodes/b.h", "gltf/a.h"},
      {"nodes/kernels/a.h", "graph/a.h"},
      {"nodes/kernels/b.h", "nodes/a.h"},
      {"files/a.h", "graph/a.h"},
      {"files/b.h", "gltf/a.h"},
      {"gltf/a.h", "graph/a.h"},
      {"gltf/b.h", "rig/character/a.h"},
      {"rig/a.h", "rig/build/a.h"},
      {"rig/file/a.h", "gltf/a.h"},
      {"rig/file/b.h", "rig/character/a.h"},
      {"rig/character/a.h", "rig/file/a.h"},
      {"rig/character/b.h", "rig/build/a.h"},
      {"rig/build/a.h", "kpsa/a.h"},
      {"rig/build/b.h", "nodes/a.h"},
      {"kpsa/a.h", "nodes/a.h"},
      {"kpsa/b.cpp", "gltf/a.h"},
      {"kpsa/c.cpp", "nodes/kernels/a.h"},
      {"kpsa/d.h", "kpsa/training/a.h"},
      {"kpsa/training/a.h", "rig/build/a.h"},
      {"kpsa/training/b.cpp", "host/a.h"},
      {"rig/build/c.h", "tests/support/a.h"},
      {"include/kpsa/a.h", "base/a.h"},
      {"host/a.h", "cli/a.h"},
      {"host/b.cpp", "report/a.h"},
      {"host/bench/a.cpp", "picture/a.h"},
      {"report/a.h", "picture/a.h"},
      {"report/b.cpp", "cli/a.h"},
      {"picture/a.h", "report/a.h"},
      {"picture/b.cpp", "cli/a.h"},
      {"report/c.h", "view/a.h"},
      {"host/c.h", "view/a.h"},
      {"view/a.h", "picture/a.h"},
      {"view/b.cpp", "cli/a.h"},
  };
  for (const auto& [file, include] : bad)
    tree.Write(file, std::string("#pragma once\n  #  include \"") + include + "\"\n");
  const std::vector<std::string> breaches = FindBreaches(ReadSourceTree(tree.path()));
  EXPECT_EQ(breaches.size(), std::size(bad)) << Lines(breaches);
  for (const auto& [file, include] : bad) {
    EXPECT_NE(Lines(breaches).find(std::string(file) + ":2: "), std::string::npos)
        << file << " includes " << include << "\n"
        << Lines(breaches);
  }
}

TEST(IncludeArrows, CanaryOfEveryDoor) {
  TemporaryFolder tree;
  const char* const libraries[] = {"tbb/parallel_for.h", "oneapi/tbb.h",     "yaml-cpp/yaml.h", "tiny_gltf.h",
                                   "nlohmann/json.hpp",  "embree3/rtcore.h", "hwy/highway.h",   "zip.h",
                                   "httplib.h"};
  for (std::size_t i = 0; i < std::size(libraries); ++i) {
    for (const char* room : {"base", "graph", "nodes", "nodes/kernels", "kpsa", "rig/build", "cli"}) {
      tree.Write(std::string(room) + "/h" + std::to_string(i) + ".h",
                 std::string("#include <") + libraries[i] + ">\n");
    }
  }
  const std::vector<std::string> breaches = FindBreaches(ReadSourceTree(tree.path()));
  EXPECT_EQ(breaches.size(), 7 * std::size(libraries)) << Lines(breaches);

  TemporaryFolder sources;
  sources.Write("graph/a.cpp", "#include <tbb/task_arena.h>\n#include <nlohmann/json.hpp>\n");
  sources.Write("gltf/other.cpp", "#include <yaml-cpp/yaml.h>\n");
  sources.Write("base/parallel.cpp", "#include <tbb/task_arena.h>\n");
  sources.Write("kpsa/a.cpp", "#include \"../base/types.h\"\n#include \"types.h\"\n");
  const std::vector<std::string> found = FindBreaches(ReadSourceTree(sources.path()));
  ASSERT_EQ(found.size(), 4u) << Lines(found);
  EXPECT_EQ(found[1], "graph/a.cpp:1: <tbb/task_arena.h> belongs behind base/parallel.cpp");
  EXPECT_EQ(found[0], "gltf/other.cpp:1: <yaml-cpp/yaml.h> belongs behind files/yaml_document.cpp");

  TemporaryFolder own;  // a door that is a header of ours
  own.Write("base/embree.h", "#include <embree3/rtcore.h>\n");
  own.Write("base/triangle_tree.cpp", "#include \"base/embree.h\"\n");
  own.Write("nodes/kernels/wire.cpp", "#include \"base/embree.h\"\n");
  own.Write("base/points.h", "#include \"base/embree.h\"\n");
  const std::vector<std::string> beside = FindBreaches(ReadSourceTree(own.path()));
  ASSERT_EQ(beside.size(), 2u) << Lines(beside);
  EXPECT_TRUE(beside[0].starts_with("base/points.h:1: <base/embree.h> belongs behind base/embree.cpp, "))
      << beside[0];
  EXPECT_TRUE(beside[1].starts_with("nodes/kernels/wire.cpp:1: ")) << beside[1];
}

TEST(IncludeArrows, AGoodTreeHasNoBreach) {
  TemporaryFolder tree;
  tree.Write("graph/a.h", "#include \"base/types.h\"\n#include <vector>\n// #include \"rig/a.h\"\n");
  tree.Write("nodes/kernels/a.cpp", "#include \"nodes/kernels/a.h\"\n#include \"base/types.h\"\n");
  tree.Write("nodes/a.cpp", "#include \"nodes/kernels/a.h\"\n#include \"graph/a.h\"\n");
  tree.Write("cli/a.cpp",
             "#include \"rig/build/a.h\"\n#include \"kpsa/a.h\"\n#include <nlohmann/json.hpp>\n");
  tree.Write("build-x/a.h", "#include \"rig/a.h\"\n");
  EXPECT_EQ(Lines(FindBreaches(ReadSourceTree(tree.path()))), "");
}

TEST(Headers, IncludeWhatTheyUse) {
  EXPECT_EQ(Lines(FindMissingIncludes(ReadSourceTree(KPSA_SOURCE_DIR))), "");
}

TEST(Headers, CanaryOfOnesThatDoNot) {
  TemporaryFolder tree;
  tree.Write("base/good.h",
             "#pragma once\n#include <vector>\ninline std::vector<int> Good() { return {}; }\n");
  tree.Write("base/through.h",
             "#include \"base/good.h\"\nstd::vector<int> Also();  // no std::string here\n");
  tree.Write("base/bad.h",
             "#pragma once\n#include <string_view>\nstd::vector<int> Bad(std::string_view s);\n");
  tree.Write(
      "kpsa/worse.h",
      "#include <Eigen/Core>\nvoid Worse(std::string s, Eigen::MatrixXd m,\n           nlohmann::json j);\n");
  tree.Write("base/source.cpp", "std::map<int, int> sources_are_compiled;\n");
  EXPECT_EQ(FindMissingIncludes(ReadSourceTree(tree.path())),
            (std::vector<std::string>{"base/bad.h:3: uses std::vector, but includes no <vector>",
                                      "kpsa/worse.h:2: uses std::string, but includes no <string>",
                                      "kpsa/worse.h:3: uses nlohmann, but includes no <nlohmann/>"}));
}

// Texts with a flag of the program ("--set") in rooms that others use, too: "path:line: text".
std::vector<std::string> FindFlagsInTexts(const std::vector<SourceFile>& files) {
  const std::regex text(R"re("(?:[^"\\]|\\.)*")re"), flag("--[a-z]");
  std::vector<std::string> found;
  for (const SourceFile& file : files) {
    const std::string room = file.path.substr(0, file.path.find('/'));
    const char* const rooms[] = {"base", "graph", "nodes", "files", "gltf", "rig", "kpsa", "host"};
    if (std::find(std::begin(rooms), std::end(rooms), room) == std::end(rooms)) continue;
    for (std::size_t line = 0; line < file.code.size(); ++line) {
      if (file.code[line].find("--") == std::string::npos) continue;
      for (std::sregex_iterator it(file.code[line].begin(), file.code[line].end(), text), end; it != end;
           ++it)
        if (std::regex_search(it->str(), flag))
          found.push_back(file.path + ":" + std::to_string(line + 1) + ": " + it->str());
    }
  }
  return found;
}

TEST(Messages, NameNoFlagsBelowTheProgram) {
  EXPECT_EQ(Lines(FindFlagsInTexts(ReadSourceTree(KPSA_SOURCE_DIR))), "");
}

TEST(Messages, CanaryOfAFlag) {
  TemporaryFolder tree;
  tree.Write("host/a.cpp", "// As --set does\nconst char* a = \"try --set\";\n");
  tree.Write("host/b.cpp", "int b(const char*, int i) { return b(\"a\", --i); }\n");
  tree.Write("cli/c.cpp", "const char* c = \"try --set\";\n");
  EXPECT_EQ(Lines(FindFlagsInTexts(ReadSourceTree(tree.path()))), "host/a.cpp:2: \"try --set\"\n");
}

}  // namespace
}  // namespace kpsa::engine
