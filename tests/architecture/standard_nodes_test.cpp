// A new file of node types touches no other: the list of them is made from the files.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/architecture/source_tree.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

// The list of the folder "nodes" in `tree`, made as the build makes it.
std::string ListOf(const TemporaryFolder& tree) {
  const std::string command = std::string("\"" KPSA_CMAKE "\" \"-DFOLDER=") + tree / "nodes" +
                              "\" \"-DOUTPUT=" + tree / "list.cpp" +
                              "\" -P \"" KPSA_SOURCE_DIR "/cmake/StandardNodes.cmake\"";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return TemporaryFolder::Read(tree / "list.cpp");
}

bool Has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

TEST(StandardNodes, ANewFileIsInTheListByBeingThere) {
  TemporaryFolder tree;
  tree.Write("nodes/sculpt.cpp", "#include \"nodes/node_file.h\"\n\nKPSA_NODES(sculpt, registry) {\n}\n");
  tree.Write("nodes/helper.cpp", "// As KPSA_NODES(helper, registry) would\nint Help() { return 1; }\n");
  const std::string one = ListOf(tree);
  EXPECT_TRUE(Has(one, "KPSA_NODES(sculpt, registry);\n") && Has(one, "  AddNodesOf_sculpt(registry);\n"))
      << one;
  EXPECT_FALSE(Has(one, "helper")) << one;

  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(1);
  fs::last_write_time(tree / "list.cpp", long_ago);
  tree.Write("nodes/sculpt.cpp",
             "// Changed\n#include \"nodes/node_file.h\"\n\nKPSA_NODES(sculpt, registry) {\n}\n");
  EXPECT_EQ(ListOf(tree), one);
  EXPECT_EQ(fs::last_write_time(tree / "list.cpp"), long_ago) << "nothing is compiled anew for it";

  tree.Write("nodes/added.cpp", "KPSA_NODES(added, registry) {\n}\n");
  const std::string two = ListOf(tree);
  EXPECT_TRUE(Has(two, "AddNodesOf_added(registry);") && Has(two, "AddNodesOf_sculpt(registry);")) << two;
}

TEST(StandardNodes, NoSourceNamesThoseOfOthers) {
  std::size_t node_files = 0;
  for (const SourceFile& file : ReadSourceTree(KPSA_SOURCE_DIR)) {
    if (!file.path.starts_with("nodes/")) continue;
    for (const Include& include : file.includes)
      EXPECT_FALSE(include.text == "nodes/standard_nodes.h" && file.path != "nodes/standard_nodes.h")
          << file.path;
    const std::string own = "KPSA_NODES(" + fs::path(file.path).stem().string() + ", registry) {";
    for (const std::string& line : file.code) {
      if (!line.starts_with("KPSA_NODES(")) continue;
      ++node_files;
      EXPECT_EQ(line, own) << file.path;
    }
  }
  EXPECT_GE(node_files, 30u);
}

}  // namespace
}  // namespace kpsa::engine
