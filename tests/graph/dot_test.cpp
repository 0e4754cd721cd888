#include "graph/dot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

// A reader of the part of the DOT language that drawings use (graphviz.org/doc/info/lang.html). What it
// cannot read is no valid drawing.
class DotReader {
 public:
  struct Attributes : std::map<std::string, std::string> {
  };  // strings with their escapes resolved, \n as a line break
  std::map<std::string, Attributes> nodes;
  std::map<std::pair<std::string, std::string>, Attributes> edges;
  std::string error;

  explicit DotReader(const std::string& text) : text_(text) {
    Expect(Token() == "digraph", "digraph");
    Token();
    Expect(Token() == "{", "{");
    for (std::string token = Token(); error.empty() && token != "}"; token = Token()) Statement(token);
    Expect(Token().empty(), "nothing after the last }");
    for (const auto& [ends, attributes] : edges) {
      Expect(nodes.contains(ends.first) && nodes.contains(ends.second), "an arrow between declared nodes");
    }
  }

 private:
  void Expect(bool fine, const std::string& what) {
    if (!fine && error.empty()) error = "expected " + what + " before position " + std::to_string(at_);
  }
  std::string Token() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    quoted_ = false;
    if (at_ >= text_.size()) return "";
    std::string token;
    const auto is_word = [&](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
    if (text_[at_] == '"') {
      quoted_ = true;
      for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
        Expect(static_cast<unsigned char>(text_[at_]) >= 0x20, "no control character in a string");
        if (text_[at_] == '\\' && at_ + 1 < text_.size()) {
          ++at_;
          Expect(text_[at_] == 'n' || text_[at_] == '"' || text_[at_] == '\\', "a known escape");
          token += text_[at_] == 'n' ? '\n' : text_[at_];
        } else {
          token += text_[at_];
        }
      }
      Expect(at_ < text_.size(), "a closing quote");
      ++at_;
    } else if (is_word(text_[at_])) {
      while (at_ < text_.size() && is_word(text_[at_])) token += text_[at_++];
    } else if (text_.compare(at_, 2, "->") == 0) {
      at_ += 2;
      token = "->";
    } else {
      token = text_[at_++];
    }
    return token;
  }
  void Statement(const std::string& name) {
    Expect(!name.empty() && (std::isalnum(static_cast<unsigned char>(name[0])) || quoted_), "a statement");
    std::string token = Token();
    Attributes* attributes = nullptr;
    Attributes defaults;
    if (token == "=") {
      Token();
      token = Token();
    } else if (token == "->") {
      attributes = &edges[{name, Token()}];
      token = Token();
    } else {
      attributes = name == "node" ? &defaults : &nodes[name];
    }
    if (token == "[") {
      Expect(attributes != nullptr, "no attributes of an assignment");
      for (token = Token(); error.empty() && token != "]"; token = Token()) {
        if (token == ",") continue;
        const std::string key = token;
        Expect(Token() == "=", "=");
        if (attributes != nullptr) (*attributes)[key] = Token();
      }
      token = Token();
    }
    Expect(token == ";", ";");
  }

  const std::string& text_;
  std::size_t at_ = 0;
  bool quoted_ = false;
};

std::string NodeName(const TestGraph& g, const std::string& name) {
  return "n" + std::to_string(g.graph.FindNode(name)->index);
}

class DotTest : public ::testing::Test {
 protected:
  TestGraph g{ToyRegistry()};
  DotReader Draw(const DotOptions& options = {}) {
    EXPECT_TRUE(g.compile().ok());
    text = DrawDot(g.graph, *g.plan, options);
    return DotReader(text);
  }
  std::string text;
};

TEST_F(DotTest, NamesOfAnyKind) {
  const char* const kNames[] = {"say \"hi\"", "back\\slash",          "ends in \\", "two\nlines", "];}",
                                "a -> b",     "\xc3\xa4\xe2\x9c\x93", "\\N",        "n0"};
  std::string from;
  for (const char* name : kNames) {
    const NodeId node = *g.graph.AddNode("add", name);
    const PlugRef plug{node, g.graph.def(node).FindAttribute("a"), -1, -1};
    if (from.empty()) {
      g.request.varying.push_back(plug);
    } else {
      const NodeId before = *g.graph.FindNode(from);
      ASSERT_TRUE(g.graph.Connect({before, g.graph.def(before).FindAttribute("out"), -1, -1}, plug).ok());
    }
    from = name;
  }
  const NodeId last = *g.graph.FindNode(from);
  g.request.outputs.push_back({{last, g.graph.def(last).FindAttribute("out"), -1, -1}, {}});
  const DotReader dot = Draw();
  EXPECT_EQ(dot.error, "") << text;
  EXPECT_EQ(dot.nodes.size(), std::size(kNames));
  EXPECT_EQ(dot.edges.size(), std::size(kNames) - 1);
  for (std::string name : kNames) {
    const std::string node = NodeName(g, name);
    std::replace(name.begin(), name.end(), '\n', ' ');
    EXPECT_EQ(dot.nodes.at(node).at("label"), name + "\nadd");
  }
  EXPECT_EQ(DotQuoted("a\"b\\c\n"), "\"a\\\"b\\\\c \"");
}

TEST_F(DotTest, TheReaderRefusesWhatIsNoDrawing) {
  for (const char* bad : {"", "digraph g {", "digraph g { n0 [label=\"a\"b\"]; }", "digraph g { n0 -> n1; }",
                          "digraph g { n0 [label=\"\\x\"]; }", "graph g { }"}) {
    EXPECT_NE(DotReader(bad).error, "") << bad;
  }
}

TEST_F(DotTest, KeptOnDemandAndLeftOut) {
  g.add("source", "src");
  g.add("move", "cheap");
  g.add("move", "full");
  g.add("cached", "k", {{"cues", std::vector<std::int64_t>{1, 2}}});
  g.add("add", "unused");
  g.connect("src.outPoints", "cheap.points");
  g.connect("cheap.outPoints", "k.cuePoints");
  g.connect("cheap.outPoints", "full.points");
  g.connect("full.outPoints", "k.full");
  g.vary("src.step");
  g.want("k.outPoints");
  DotReader dot = Draw();
  EXPECT_EQ(dot.error, "") << text;
  EXPECT_EQ(dot.nodes.size(), 4u);
  EXPECT_EQ(dot.nodes[NodeName(g, "full")]["tooltip"], "only on demand");
  EXPECT_EQ(dot.nodes[NodeName(g, "full")]["label"], "full\nmove\n10 of 10 points");
  EXPECT_FALSE(dot.nodes[NodeName(g, "k")].contains("tooltip"));
  EXPECT_NE(dot.nodes[NodeName(g, "k")]["fillcolor"], dot.nodes[NodeName(g, "full")]["fillcolor"]);
  EXPECT_EQ((dot.edges[{NodeName(g, "cheap"), NodeName(g, "k")}]["tooltip"]), "outPoints > cuePoints");
  DotReader all = Draw({.all = true});
  EXPECT_EQ(all.error, "") << text;
  EXPECT_EQ(all.nodes.size(), 5u);
  EXPECT_EQ(all.nodes[NodeName(g, "unused")]["tooltip"], "not needed by the request");
}

TEST_F(DotTest, RedIsWhereTheTimeGoes) {
  for (const char* name : {"a", "b", "c"}) g.add("add", name);
  g.connect("a.out", "b.a");
  g.connect("a.out", "b.b");
  g.connect("b.out", "c.a");
  g.vary("a.a");
  g.want("c.out");
  ASSERT_TRUE(g.compile().ok());
  Profile profile(*g.plan);
  for (Index s = 0; s < 3; ++s) {
    const std::uint64_t ns = std::string(g.plan->step_name(s)) == "b"   ? 80000
                             : std::string(g.plan->step_name(s)) == "c" ? 20000
                                                                        : 0;
    profile.Add({s, kNoIndex, 1000, 1000 + ns, 0, 0});
  }
  DotReader dot = Draw({.profile = &profile, .frames = 4});
  EXPECT_EQ(dot.error, "") << text;
  EXPECT_EQ(dot.nodes[NodeName(g, "b")]["label"], "b\nadd\n20.0 us");
  EXPECT_EQ(dot.nodes[NodeName(g, "b")]["fillcolor"], "#ff3c28");  // all red
  EXPECT_EQ(dot.nodes[NodeName(g, "a")]["fillcolor"], "#fffac8");  // pale
  const std::string between = dot.nodes[NodeName(g, "c")]["fillcolor"];
  EXPECT_GT(between, "#ff3c28");
  EXPECT_LT(between, "#fffac8");
  EXPECT_EQ((dot.edges[{NodeName(g, "a"), NodeName(g, "b")}]["tooltip"]), "out > a and 1 more");
}

}  // namespace
}  // namespace kpsa::engine
