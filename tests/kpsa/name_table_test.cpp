#include "kpsa/name_table.h"

#include <gtest/gtest.h>

namespace kpsa::engine {
namespace {

Result<NameTable> TableOf(const std::string& text, const std::vector<std::uint32_t>& ends) {
  SafetensorsWriter writer;
  writer.Add<std::uint8_t>("names", {text.size()},
                           {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  writer.Add<std::uint32_t>("nameEnds", {ends.size()}, ends);
  const Result<SafetensorsFile> file = SafetensorsFile::Parse(writer.Serialize(), "names.kpsa");
  EXPECT_TRUE(file.ok());
  return NameTable::Read(*file);
}

TEST(NameTable, GivesWhatWasNumberedEachOnce) {
  NameNumbers numbers;
  const std::vector<std::string> names = {"jaw.matrix/0",         "", "größe", "jaw.matrix/0",
                                          std::string("a\0b", 3), ""};
  std::vector<std::uint32_t> of;
  for (const std::string& name : names) of.push_back(numbers.Of(name));
  EXPECT_EQ(of, (std::vector<std::uint32_t>{0, 1, 2, 0, 3, 1}));
  SafetensorsWriter writer;
  numbers.AddTo(&writer);
  const Result<SafetensorsFile> file = SafetensorsFile::Parse(writer.Serialize(), "names.kpsa");
  ASSERT_TRUE(file.ok());
  Result<NameTable> table = NameTable::Read(*file);
  ASSERT_TRUE(table.ok()) << table.status().ToString();
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::string name = "before";
    ASSERT_TRUE(table->Take(of[i], &name).ok());
    EXPECT_EQ(name, names[i]);
  }
  std::string name;
  EXPECT_EQ(table->Take(4, &name).ToString(), "name 4 of 4 is asked for");
}

TEST(NameTable, RefusesWhatIsNoText) {
  const auto refusal = [](const std::string& text, const std::vector<std::uint32_t>& ends) {
    return TableOf(text, ends).status().ToString();
  };
  EXPECT_EQ(refusal("abc", {1, 1, 3}), "");
  EXPECT_EQ(refusal("", {}), "");
  EXPECT_EQ(refusal("abc", {2, 1, 3}), "name 1 lies at bytes 2 to 1 of 3");
  EXPECT_EQ(refusal("abc", {4}), "name 0 lies at bytes 0 to 4 of 3");
  EXPECT_EQ(refusal("abc", {2}), "3 bytes of names, of which 2 belong to one");
  EXPECT_EQ(refusal("a\xffz", {1, 3}), "name 1 is not UTF-8 text");
  EXPECT_EQ(refusal("ß", {1, 2}), "name 0 is not UTF-8 text") << "cut within a character";
}

// A long name that is meant again and again would be gigabytes.
TEST(NameTable, HandsOutSoMuchAndNoMore) {
  constexpr std::size_t kLong = 1u << 20;
  Result<NameTable> table = TableOf(std::string(kLong, 'x'), {kLong});
  ASSERT_TRUE(table.ok());
  std::string name;
  std::size_t taken = 0;
  while (taken < 1000 && table->Take(0, &name).ok()) ++taken;
  EXPECT_EQ(taken, NameTable::kMostText / kLong);
  EXPECT_NE(table->Take(0, &name).ToString().find("bytes in all"), std::string::npos);
}

}  // namespace
}  // namespace kpsa::engine
