#include "files/yaml_document.h"

#include <gtest/gtest.h>

#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

YamlNode Parse(std::string_view text) {
  Result<YamlNode> root = ParseYaml(text, "t.yaml");
  EXPECT_TRUE(root.ok()) << root.status().ToString();
  return root.ok() ? *root : YamlNode();
}
std::string Failure(std::string_view text) {
  Result<YamlNode> root = ParseYaml(text, "t.yaml");
  return root.ok() ? "no error" : root.status().ToString();
}
bool Has(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

TEST(YamlDocument, KeepsTextOrderAndPlaces) {
  const YamlNode root = Parse("a: 010\nb: [no, \"12\", ~]\nc:\n  d e: x\n");
  ASSERT_TRUE(root.is_map());
  ASSERT_EQ(root.keys.size(), 3u);
  EXPECT_EQ(root.Find("a")->scalar, "010");
  EXPECT_FALSE(root.Find("a")->quoted);
  EXPECT_EQ(root.Find("a")->where().ToString(), "t.yaml:1:4");
  const YamlNode& list = *root.Find("b");
  ASSERT_EQ(list.items.size(), 3u);
  EXPECT_EQ(list.items[0].scalar, "no");
  EXPECT_TRUE(list.items[1].quoted);
  EXPECT_TRUE(list.items[2].is_null());
  EXPECT_EQ(root.Find("c")->Find("d e")->where().ToString(), "t.yaml:4:8");
  EXPECT_EQ(root.Find("missing"), nullptr);
}

TEST(YamlDocument, AcceptsByteOrderMarkAndCrlf) {
  const YamlNode root = Parse(
      "\xEF\xBB\xBF"
      "a: 1\r\nb: \"x\"\r\n");
  EXPECT_EQ(root.Find("a")->scalar, "1");
  EXPECT_EQ(root.Find("b")->scalar, "x");
  EXPECT_EQ(root.Find("b")->where().ToString(), "t.yaml:2:4");
}

TEST(YamlDocument, NamesBothLinesOfEveryDuplicateKey) {
  const std::string text = Failure("a: 1\nb: 2\na: 3\nc: {x: 1, x: 2}\n");
  EXPECT_TRUE(Has(text, "t.yaml:3:1: \"a\" is defined twice in this map: first at line 1")) << text;
  EXPECT_TRUE(Has(text, "t.yaml:4:11: \"x\" is defined twice")) << text;
}

TEST(YamlDocument, RefusesEmptyAndSeveralDocuments) {
  EXPECT_TRUE(Has(Failure(""), "no YAML document"));
  EXPECT_TRUE(Has(Failure("# only a comment\n"), "no YAML document"));
  EXPECT_TRUE(Has(Failure("---\n...\n"), "no YAML document"));
  EXPECT_TRUE(Has(Failure("a: 1\n---\nb: 2\n"), "t.yaml:3:1: the file holds several YAML documents"));
}

TEST(YamlDocument, PlacesSyntaxErrors) {
  EXPECT_TRUE(Has(Failure("a: 1\nb: [1, 2\nc: 3\n"), "t.yaml:3:")) << Failure("a: 1\nb: [1, 2\nc: 3\n");
  const std::string tabs = Failure("a:\n\tb: 1\n");
  EXPECT_TRUE(Has(tabs, "t.yaml:2:3: YAML: ") && Has(tabs, "no tabs there")) << tabs;
  const std::string bracket = Failure("controls: {head.weight[open]: 1}\n");
  EXPECT_TRUE(Has(bracket, "t.yaml:1:") && Has(bracket, "quote plugs that contain [ ] inside { }"))
      << bracket;
  const std::string value = Failure("n: {type: x, input: lips.cv[1]}\n");
  EXPECT_TRUE(Has(value, "quote plugs that contain [ ] inside { }")) << value;
  EXPECT_FALSE(Has(Failure("a: [1, 2\n"), "quote plugs"));
  for (const char* pattern : {"mask: [f?_*, g]\n", "mask: [a, *_L]\n", "mask: [?inger]\n"})
    EXPECT_TRUE(Has(Failure(pattern), "quote names with ? or * inside { } or [ ]")) << Failure(pattern);
  EXPECT_FALSE(Has(Failure("a: [1, finger*, \"f?\"\n"), "quote names"));
}

TEST(YamlDocument, BoundsAliases) {
  const YamlNode root = Parse("a: &x {p: 1}\nb: *x\n");
  EXPECT_EQ(root.Find("b")->Find("p")->scalar, "1");
  EXPECT_EQ(root.Find("b")->where().ToString(), "t.yaml:2:4");
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    bomb += fmt::format(
        "a{0}: &a{0} [*a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}, *a{1}]\n", i, i - 1);
  }
  EXPECT_TRUE(Has(Failure(bomb), "aliases of this file expand to more than 100000")) << Failure(bomb);
  EXPECT_TRUE(Has(Failure("a: &x [1, *x]\n"), "within its own anchor")) << Failure("a: &x [1, *x]\n");
  EXPECT_TRUE(Has(Failure("a: &x {p: 1}\nb:\n  <<: *x\n"), "t.yaml:3:3: \"<<\" merges are not read"));
  EXPECT_FALSE(ParseYaml("a: *nobody\n", "t.yaml").ok());
}

TEST(YamlDocument, BoundsDepthCountAndSize) {
  std::string deep(1'000'000, '[');
  EXPECT_FALSE(ParseYaml(deep, "t.yaml").ok());
  std::string nested;
  for (int i = 0; i < 100; ++i) nested += "[";
  nested += std::string(100, ']');
  EXPECT_TRUE(Has(Failure(nested), "nested deeper than 64")) << Failure(nested);
  // An alias may not deepen the tree, either
  std::string chain = "a0: &a0 [[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]\n";
  for (int i = 1; i < 5; ++i)
    chain += fmt::format("a{0}: &a{0} [[[[[[[[[[[[[[[[*a{1}]]]]]]]]]]]]]]]]\n", i, i - 1);
  EXPECT_TRUE(Has(Failure(chain), "nested deeper than 64")) << Failure(chain);
  EXPECT_TRUE(Has(Failure(std::string(kMaxYamlBytes + 1, ' ')), "bytes; at most"));
}

TEST(YamlDocument, RefusesWhatIsNoText) {
  EXPECT_TRUE(Has(Failure("a: 1\nb: \xff\n"), "t.yaml:2:4: the file is not UTF-8 text: byte 0xff"));
  EXPECT_TRUE(Has(Failure("a: \xC0\x80\n"), "not UTF-8"));      // overlong
  EXPECT_TRUE(Has(Failure("a: \xED\xA0\x80\n"), "not UTF-8"));  // surrogate
  EXPECT_TRUE(Has(Failure("a: \xE2\x82"), "not UTF-8"));        // cut off
  EXPECT_TRUE(Has(Failure(std::string_view("a: \0b\n", 6)), "not UTF-8"));
  EXPECT_EQ(Parse("a: \xE2\x82\xAC\n").Find("a")->scalar, "\xE2\x82\xAC");
}

TEST(YamlDocument, RefusesKeysThatAreNoScalars) {
  EXPECT_TRUE(Has(Failure("{[a]: 1}\n"), "a key is a single word")) << Failure("{[a]: 1}\n");
  EXPECT_TRUE(Has(Failure("? {a: 1}\n: 2\n"), "a key is a single word"));
  EXPECT_TRUE(Has(Failure("~: 2\n"), "a key is a single word"));
}

TEST(YamlMap, CollectsUnknownMissingAndMistypedKeys) {
  const YamlNode root = Parse("envelop: 1\ntype: [1]\nflag: maybe\ncount: 1.5\n");
  YamlErrors errors;
  YamlMap map(root, "node \"m\"", &errors);
  EXPECT_EQ(map.Find("envelope"), nullptr);
  EXPECT_EQ(map.Required("name"), nullptr);
  std::string text;
  bool flag = false;
  std::int64_t count = 0;
  EXPECT_FALSE(ReadString(*map.Find("type"), "type", &text, &errors));
  EXPECT_FALSE(ReadBool(*map.Find("flag"), "flag", &flag, &errors));
  EXPECT_FALSE(ReadInteger(*map.Find("count"), "count", 0, 10, &count, &errors));
  map.RejectUnread();
  const std::string all = errors.Take().ToString();
  EXPECT_TRUE(Has(all, "t.yaml:1:1: node \"m\": unknown key \"envelop\" (did you mean \"envelope\"?)"))
      << all;
  EXPECT_TRUE(Has(all, "the key \"name\" is missing")) << all;
  EXPECT_TRUE(Has(all, "t.yaml:2:7: type: expected a string, found a list")) << all;
  EXPECT_TRUE(Has(all, "t.yaml:3:7: flag: expected true or false, found \"maybe\"")) << all;
  EXPECT_TRUE(Has(all, "t.yaml:4:8: count: expected a whole number from 0 to 10, found 1.5")) << all;
}

TEST(YamlErrors, SayEachErrorOnceAndAHundredAtMost) {
  const YamlNode root = Parse("a: 1\nb: 2\n");
  YamlErrors errors;
  for (int i = 0; i < 2; ++i) {
    errors.Add(*root.Find("a"), "is wrong");
    errors.Add(*root.Find("b"), "is wrong");
  }
  EXPECT_EQ(errors.count(), 2u);  // two places
  for (int i = 0; i < 300; ++i) errors.Add(root, "error {}", i);
  EXPECT_TRUE(errors.full());
  EXPECT_EQ(errors.count(), 100u);
}

TEST(Quantity, ReadsBareNumbersInTheFilesUnit) {
  FileUnits units;
  ASSERT_TRUE(units.SetLength("cm").ok());
  EXPECT_DOUBLE_EQ(*ParseQuantity("2", Unit::kLength, units), 0.02);
  EXPECT_DOUBLE_EQ(*ParseQuantity("-180", Unit::kAngle, units), -kPi);
  EXPECT_DOUBLE_EQ(*ParseQuantity("2.5e1", Unit::kNone, units), 25);
  EXPECT_DOUBLE_EQ(*ParseQuantity("+.5", Unit::kTime, units), 0.5);
}

TEST(Quantity, ReadsSuffixes) {
  FileUnits units;
  units.fps = 48;
  EXPECT_DOUBLE_EQ(*ParseQuantity("0.2mm", Unit::kLength, units), 0.0002);
  EXPECT_DOUBLE_EQ(*ParseQuantity("12 deg", Unit::kAngle, units), 12 * kPi / 180);
  EXPECT_DOUBLE_EQ(*ParseQuantity("1rad", Unit::kAngle, units), 1);
  EXPECT_DOUBLE_EQ(*ParseQuantity("1%", Unit::kNone, units), 0.01);
  EXPECT_DOUBLE_EQ(*ParseQuantity("0.5s", Unit::kTime, units), 0.5);
  EXPECT_DOUBLE_EQ(*ParseQuantity("12f", Unit::kTime, units), 0.25);
  units.fps = 0.01;
  EXPECT_DOUBLE_EQ(*ParseQuantity("1e305f", Unit::kTime, units), 1e307);
  EXPECT_EQ(ParseQuantity("1e308f", Unit::kTime, units).status().ToString(),
            "\"1e308f\" is outside of the range of numbers");
}

TEST(Quantity, SaysWhatIsWrong) {
  const FileUnits units;
  const auto failure = [&](std::string_view text, Unit unit) {
    const Result<double> number = ParseQuantity(text, unit, units);
    return number.ok() ? "no error" : number.status().ToString();
  };
  EXPECT_TRUE(Has(failure("0.2 parsec", Unit::kLength),
                  "unknown unit \"parsec\"; the units are mm, cm, m, deg, rad, s, f, %"));
  EXPECT_TRUE(Has(failure("3deg", Unit::kLength), "expected a length (mm, cm, m)"));
  EXPECT_TRUE(Has(failure("3mm", Unit::kNone), "expected a number without a unit"));
  EXPECT_TRUE(Has(failure(".nan", Unit::kNone), "not finite"));
  EXPECT_TRUE(Has(failure("-.inf", Unit::kNone), "not finite"));
  EXPECT_TRUE(Has(failure("1e999", Unit::kNone), "outside of the range"));
  EXPECT_EQ(*ParseQuantity("-1e-400", Unit::kNone, units), 0);
  EXPECT_TRUE(Has(failure("010", Unit::kNone), "leading zeros"));
  EXPECT_TRUE(Has(failure("0x10", Unit::kNone), "leading zeros"));
  EXPECT_TRUE(Has(failure("nan", Unit::kNone), "no number"));
  EXPECT_TRUE(Has(failure("", Unit::kNone), "no number"));
  EXPECT_TRUE(Has(failure("1_000", Unit::kNone), "unknown unit"));
}

TEST(ParseBool, TakesTheUsualSpellings) {
  for (const char* text : {"true", "True", "TRUE", "on", "On", "yes", "YES"})
    EXPECT_EQ(ParseBool(text), true) << text;
  for (const char* text : {"false", "False", "FALSE", "off", "OFF", "no", "No"})
    EXPECT_EQ(ParseBool(text), false) << text;
  for (const char* text : {"", "tRUE", "1", "y", "truth"}) EXPECT_EQ(ParseBool(text), std::nullopt) << text;
}

}  // namespace
}  // namespace kpsa::engine
