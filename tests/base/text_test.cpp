#include "base/text.h"

#include <gtest/gtest.h>

#include <set>

namespace kpsa::engine {
namespace {

TEST(Text, TheLongestKnownNameBeforeASeparatorWins) {
  const std::set<std::string_view> names = {"a", "a.b", "", ".", "größe"};
  const auto end = [&](std::string_view text) {
    return LongestBefore('.', text, [&](std::string_view name) { return names.count(name) != 0; });
  };
  EXPECT_EQ(end("a.x"), 1u);
  EXPECT_EQ(end("a.b.x"), 3u);
  EXPECT_EQ(end("a.c.b.x"), 1u);
  EXPECT_EQ(end("a.b."), 3u);
  EXPECT_EQ(end("..x"), 1u);
  EXPECT_EQ(end("größe.x"), 7u);
  for (const char* text : {"", "a", "ab.x", ".x", "b.a.x"})
    EXPECT_EQ(end(text), std::string_view::npos) << text;
}

}  // namespace
}  // namespace kpsa::engine
