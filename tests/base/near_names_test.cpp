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
  EXPECT_EQ(NearOrAll("visibel", names, names), " (did you mean \"visible\"?)");
  EXPECT_EQ(NearOrAll("tz", names, names), " (did you mean \"tx\" or \"ty\"?)");
  EXPECT_EQ(NearOrAll("tint", {}, {"a", "b"}), "; there is a, b");
  EXPECT_EQ(NearOrAll("tint", {}, {}), "");
  Names many(15, "attribute");
  const std::string shortened = NearOrAll("tint", many, many);
  EXPECT_TRUE(shortened.ends_with(", attribute and 3 more")) << shortened;
  EXPECT_EQ(NearOrAll("e", {"a", "b", "c", "d", "f"}, {}).find("\"f\""), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
