#include "base/near_names.h"

#include <gtest/gtest.h>

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
