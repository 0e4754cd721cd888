#include "rig/build/type_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <string>

#include "nodes/standard_nodes.h"

namespace kpsa::engine {
namespace {

using ::testing::HasSubstr;

class TypeNames : public testing::Test {
 protected:
  TypeNames() { AddStandardNodes(registry_); }
  std::string Suggest(std::string_view type) const { return SuggestType(type, registry_).ToString(); }

  NodeRegistry registry_;
};

TEST_F(TypeNames, OfOtherProgramsAreKnown) {
  EXPECT_EQ(Suggest("nonLinear"),
            "; what other programs call so is bend, flare, sine, squash, twist or wave here");
  for (const char* name : {"Corrective Smooth", "corrective_smooth", "CorrectiveSmooth"})
    EXPECT_THAT(Suggest(name), HasSubstr("deltaMush here")) << name;
}

TEST_F(TypeNames, ThatAreNearAreSuggested) {
  EXPECT_EQ(Suggest("deltaMsuh"), " (did you mean \"deltaMush\"?)");
  EXPECT_EQ(Suggest("blah"), "");
}

// What is suggested exists, and no name of ours is taken for another program's.
TEST_F(TypeNames, LeadToTypesThatExist) {
  const std::regex words("[A-Za-z]+");
  for (const auto& [name, here] : OtherTypeNames()) {
    EXPECT_EQ(Suggest(name), fmt::format("; what other programs call so is {} here", here));
    const std::string types(here);
    for (std::sregex_iterator word(types.begin(), types.end(), words), end; word != end; ++word) {
      if (word->str() == "or") continue;
      EXPECT_NE(registry_.Find(word->str()), nullptr) << name << ": " << word->str();
    }
  }
  for (const std::string& name : registry_.Names())
    EXPECT_FALSE(Suggest(name).starts_with(";")) << name << Suggest(name);
}

}  // namespace
}  // namespace kpsa::engine
