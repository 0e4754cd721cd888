#include "base/near_names.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace kpsa::engine {
namespace {

using Names = std::vector<std::string>;

TEST(NearNames, AllThatAreEquallyNear) {
  const Names names = {"rotate", "rotateX", "rotateY", "rotateZ", "scale"};
  EXPECT_EQ(NearNames("rotatex", names), Names({"rotateX"}));
  EXPECT_EQ(NearNames("rotateW", names), Names({"rotate", "rotateX", "rotateY", "rotateZ"}));
  EXPECT_EQ(NearNames("visibility", names), Names());
  EXPECT_EQ(NearNames("", names), Names());
  EXPECT_EQ(NearNames("scale", {"scale", "scale"}), Names({"scale"}));
  EXPECT_EQ(NearNames(std::string(300, 'x'), {std::string(300, 'x')}), Names());
}

// Beside all insertions, deletions, changes and swaps of neighbours, in a table of its own.
std::size_t Edits(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] =
          std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

TEST(NearNames, AreThoseWithFewestEdits) {
  std::mt19937 random(3);
  const auto word = [&](std::size_t length) {
    std::string text;
    for (std::size_t i = 0; i < length; ++i) text += static_cast<char>('a' + random() % 3);
    return text;
  };
  int found = 0;
  for (int round = 0; round < 400; ++round) {
    const std::string asked = word(1 + random() % 30);
    Names names, expected;
    for (int n = 0; n < 12; ++n) {
      std::string name = n % 2 == 0 ? word(1 + random() % 30) : asked;
      for (std::size_t edit = random() % 4; edit > 0 && name.size() > 1; --edit) {
        const std::size_t at = random() % (name.size() - 1);
        if (random() % 2 == 0)
          std::swap(name[at], name[at + 1]);
        else
          name.erase(at, 1);
      }
      names.push_back(name);
    }
    std::size_t best = std::clamp<std::size_t>(asked.size() / 3, 1, 8);
    for (const std::string& name : names) best = std::min(best, Edits(asked, name));
    for (const std::string& name : names) {
      if (Edits(asked, name) == best && std::find(expected.begin(), expected.end(), name) == expected.end())
        expected.push_back(name);
    }
    EXPECT_EQ(NearNames(asked, names), expected) << asked;
    found += !expected.empty();
  }
  EXPECT_GT(found, 200);
}

TEST(NearNames, AreSaidInWords) {
  const Names names = {"tx", "ty", "visible"};
  EXPECT_EQ(NearOrAll("visibel", names, names).ToString(), " (did you mean \"visible\"?)");
  EXPECT_EQ(NearOrAll("tz", names, names).ToString(), " (did you mean \"tx\" or \"ty\"?)");
  EXPECT_EQ(NearOrAll("tint", {}, {"a", "b"}).ToString(), "; there is a, b");
  EXPECT_EQ(NearOrAll("tint", {}, {}).ToString(), "");
  Names many(15, "attribute");
  const std::string shortened = NearOrAll("tint", many, many).ToString();
  EXPECT_TRUE(shortened.ends_with(", attribute and 3 more")) << shortened;
  EXPECT_EQ(NearOrAll("e", {"a", "b", "c", "d", "f"}, {}).ToString().find("\"f\""), std::string::npos);
}

// What a message suggests is told beside it, wherever it stands in it.
TEST(NearNames, AreSuggestionsOfErrors) {
  const Status one =
      Status::Invalid("unknown plug \"{}\"{}; see {}", "tz", NearOrAll("tz", {"tx", "ty"}, {}), "docs");
  EXPECT_EQ(one.errors()[0].message, "unknown plug \"tz\" (did you mean \"tx\" or \"ty\"?); see docs");
  EXPECT_EQ(one.errors()[0].suggestion, "did you mean \"tx\" or \"ty\"?");
  const Suggestion kept = DidYouMean("visibel", {"visible"});
  EXPECT_EQ(Status::Usage("no {}{}", "visibel", kept).errors()[0].suggestion, "did you mean \"visible\"?");
  // None is near; words of a user that read like one
  EXPECT_EQ(Status::Invalid("no \"{}\"{}", "q", DidYouMean("q", {"visible"})).errors()[0].suggestion, "");
  EXPECT_EQ(Status::Invalid("no \"{}\"", "a (did you mean \"b\"?)").errors()[0].suggestion, "");
}

}  // namespace
}  // namespace kpsa::engine
