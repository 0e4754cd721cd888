// Code in the docs is that of the file that stands before it: <!-- from FILE -->.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

// Blocks with a file, and what is wrong with them.
struct Quotations {
  std::size_t count = 0;
  std::vector<std::string> problems;
};

void CheckPage(const fs::path& root, const fs::path& page, Quotations* found) {
  constexpr std::string_view kFrom = "<!-- from ", kEnd = " -->";
  std::istringstream in(TemporaryFolder::Read(page.string()));
  std::string file, code;
  bool inside = false;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (!inside && line.starts_with(kFrom) && line.ends_with(kEnd)) {
      file = line.substr(kFrom.size(), line.size() - kFrom.size() - kEnd.size());
    } else if (line.starts_with("```")) {
      if (inside && !file.empty()) {
        ++found->count;
        const bool there = fs::is_regular_file(root / file);
        // Whole lines
        if (!there ||
            ("\n" + TemporaryFolder::Read((root / file).string())).find("\n" + code) == std::string::npos)
          found->problems.push_back(
              fmt::format("{}:{}: not what is in {}", page.filename().string(), number, file));
        file.clear();
      }
      inside = !inside;
      code.clear();
    } else if (inside) {
      code += line + "\n";
    } else if (!line.empty()) {
      file.clear();
    }
  }
}

Quotations CheckDocs(const fs::path& root) {
  Quotations found;
  std::vector<fs::path> pages;
  if (fs::exists(root / "README.md")) pages.push_back(root / "README.md");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / "docs")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  for (const fs::path& page : pages) CheckPage(root, page, &found);
  return found;
}

TEST(Docs, CodeIsThatOfItsFile) {
  const Quotations found = CheckDocs(KPSA_SOURCE_DIR);
  EXPECT_GE(found.count, 10u);
  for (const std::string& problem : found.problems) ADD_FAILURE() << problem;
}

TEST(Docs, CanaryOfCodeThatIsNot) {
  TemporaryFolder tree;
  tree.Write("a.cpp", "one();\ntwo();\nthree();\n");
  tree.Write("docs/good.md", "<!-- from a.cpp -->\n```cpp\ntwo();\nthree();\n```\n\n```cpp\nanything\n```\n");
  EXPECT_TRUE(CheckDocs(tree.path()).problems.empty());
  EXPECT_EQ(CheckDocs(tree.path()).count, 1u);
  tree.Write("docs/bad.md", "<!-- from a.cpp -->\n```cpp\ntwo();\nfour();\n```\n");
  tree.Write("docs/none.md", "<!-- from b.cpp -->\n```cpp\ntwo();\n```\n");
  tree.Write("docs/part.md", "<!-- from a.cpp -->\n```cpp\nwo();\n```\n");
  EXPECT_EQ(CheckDocs(tree.path()).problems.size(), 3u);
}

}  // namespace
}  // namespace kpsa::engine
