#include "graph/graph.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

// The message of a refusal; "" where there was none.
std::string Why(const Status& status) { return status.ToString(); }
template <typename T>
std::string Why(const Result<T>& result) {
  return result.status().ToString();
}
bool Says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

class GraphTest : public testing::Test {
 protected:
  GraphTest() : g(ToyRegistry()) {}
  Status Connect(const std::string& from, const std::string& to, bool replace = false) {
    return g.graph.Connect(g.plug(from), g.plug(to), replace);
  }
  std::string NameOf(const std::string& text) {
    const Result<PlugRef> plug = g.graph.FindPlug(text);
    return plug.ok() ? g.graph.PlugName(*plug) : plug.status().ToString();
  }
  TestGraph g;
};

TEST_F(GraphTest, UnknownTypesAndTakenNames) {
  EXPECT_EQ(Why(g.graph.AddNode("ad", "x")), "unknown node type \"ad\" (did you mean \"add\"?)");
  g.add("add", "x");
  EXPECT_EQ(Why(g.graph.AddNode("sum", "x")), "a node named \"x\" exists already");
}

TEST_F(GraphTest, TypesAndRangesOfValues) {
  g.add("grid", "g");
  EXPECT_EQ(Why(g.graph.Set(g.plug("g.size"), 11.0)), "g.size = 11 is outside of 0 to 10");
  EXPECT_EQ(Why(g.graph.Set(g.plug("g.size"), NAN)), "g.size takes finite numbers, not nan");
  EXPECT_EQ(Why(g.graph.Set(g.plug("g.size"), "big")), "g.size takes a double, not big");
  EXPECT_EQ(Why(g.graph.Set(g.plug("g.center"), 1.0)), "g.center takes a double3, not 1");
  EXPECT_TRUE(Says(Why(g.graph.Set(g.plug("g.center"), Double3{0, INFINITY, 0})), "finite"));
  Matrix4 broken;
  broken.m[5] = NAN;
  EXPECT_TRUE(Says(Why(g.graph.Set(g.plug("g.matrix"), broken)), "finite"));
  EXPECT_TRUE(Says(Why(g.graph.Set(g.plug("g.mode"), "smoth")),
                   "expected one of linear, smooth (did you mean \"smooth\"?)"));
  EXPECT_TRUE(Says(Why(g.graph.Set(g.plug("g.mode"), 2)), "has no choice 2"));
  EXPECT_TRUE(g.graph.Set(g.plug("g.mode"), "smooth").ok());
  EXPECT_EQ(g.graph.FindValue(g.plug("g.mode"))->AsInt(), 1);
  EXPECT_TRUE(g.graph.Set(g.plug("g.size"), 3).ok());  // an int widens
  EXPECT_TRUE(Says(Why(g.graph.Set(g.plug("g.outPoints"), 1.0)), "is an output"));
  const auto points = std::make_shared<PointBuffer>(2);
  points->view().y[1] = NAN;
  EXPECT_EQ(Why(g.graph.Set(g.plug("g.points"), Value(PointBufferPtr(points)))),
            "g.points: point 1 is not finite");
}

TEST_F(GraphTest, TheLatestValueWins) {
  g.add("scale3", "s");
  g.hold("s.input.y", 5.0);
  g.hold("s.input", Double3{1, 2, 3});
  EXPECT_EQ(g.pull<Double3>("s.out"), (Double3{1, 2, 3}));
  g.hold("s.input.y", 7.0);
  EXPECT_EQ(g.pull<Double3>("s.out"), (Double3{1, 7, 3}));
  EXPECT_TRUE(g.graph.Unset(g.plug("s.input.y")).ok());
  g.plan = nullptr;
  EXPECT_EQ(g.pull<Double3>("s.out"), (Double3{1, 2, 3}));

  g.add("grid", "g");
  g.hold("g.points[1].x", 4.0);
  g.hold("g.points[2]", Double3{6, 0, 0});
  EXPECT_EQ(g.pull_points("g.outPoints")[3], 4.0f);
  EXPECT_EQ(g.pull_points("g.outPoints")[6], 6.0f);
  g.hold("g.points[1]", Double3{8, 0, 0});
  EXPECT_EQ(g.graph.Values(g.plug("g.points").node, g.plug("g.points").attribute).size(), 2u);
  EXPECT_EQ(g.pull_points("g.outPoints")[3], 8.0f);
}

TEST_F(GraphTest, TypesOfConnections) {
  g.add("scale3", "s");
  g.add("add", "a");
  g.add("choice", "c");
  g.add("move", "m");
  EXPECT_EQ(Why(Connect("s.out", "a.a")), "s.out is a double3 and cannot drive a.a, a double");
  EXPECT_EQ(Why(Connect("a.out", "s.input")), "a.out is a double and cannot drive s.input, a double3");
  EXPECT_EQ(Why(Connect("a.a", "a.out")), "a.out is an output and takes no connection");
  EXPECT_TRUE(Says(Why(Connect("a.out", "m.points")), "cannot drive m.points, a points"));
  EXPECT_TRUE(Says(Why(g.graph.FindPlug("s.out.w")), "has no component .w"));
  EXPECT_TRUE(Connect("s.out.z", "a.a").ok());
  EXPECT_TRUE(Connect("a.out", "c.selector").ok());  // numbers convert
  PlugRef point = g.plug("m.points");
  point.element = 3;
  EXPECT_TRUE(Says(Why(g.graph.Connect(point, g.plug("s.input"))), "a single point cannot be a source"));
}

TEST_F(GraphTest, ACycleIsToldWithItsWholePath) {
  for (int i = 0; i < 40; ++i) g.add("add", "n" + std::to_string(i));
  for (int i = 0; i + 1 < 40; ++i)
    g.connect("n" + std::to_string(i) + ".out", "n" + std::to_string(i + 1) + ".a");
  const std::string why = Why(Connect("n39.out", "n0.b"));
  EXPECT_TRUE(Says(why, "n39.out -> n0.b would make a cycle: n0.b -> n0.out -> n1.a -> n1.out -> n2.a"))
      << why;
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(Says(why, "n" + std::to_string(i) + ".out")) << i;
  EXPECT_TRUE(why.ends_with("n39.out -> n0.b")) << why;
  EXPECT_EQ(g.graph.FindConnection(g.plug("n0.b")), nullptr);
  EXPECT_TRUE(Says(Why(Connect("n3.out", "n3.a", true)), "n3.a -> n3.out -> n3.a"));
}

TEST_F(GraphTest, WhatIsNoCycleByAttributesIsAllowed) {
  g.add("twoWays", "w");
  g.connect("w.outA", "w.b");  // from one way into the other
  EXPECT_FALSE(Connect("w.outB", "w.a").ok());
  g.hold("w.a", 1.0);
  EXPECT_DOUBLE_EQ(g.pull<double>("w.outB"), 4);
  // Components of one vector
  g.add("scale3", "s", {{"input", Double3{1, 2, 3}}});
  g.connect("s.input.x", "s.input.y");
  EXPECT_FALSE(Connect("s.input.y", "s.input.x").ok());
  EXPECT_FALSE(Connect("s.out.y", "s.input.x").ok());
  EXPECT_EQ(g.pull<Double3>("s.out"), (Double3{1, 1, 3}));
  // Elements of an array
  g.add("sum", "t", {{"input[0]", 4.0}});
  g.connect("t.input[0]", "t.input[1]");
  EXPECT_FALSE(Connect("t.input[1]", "t.input[0]").ok());
  EXPECT_DOUBLE_EQ(g.pull<double>("t.out"), 8);
}

TEST_F(GraphTest, ADestinationTakesOneConnection) {
  for (const char* name : {"a", "b"}) g.add("scale3", name);
  g.add("add", "n");
  g.add("sum", "t");
  g.add("grid", "g");
  g.connect("n.out", "a.input.x");
  EXPECT_EQ(Why(Connect("b.out.x", "a.input.x")), "a.input.x is driven by n.out already");
  EXPECT_EQ(Why(Connect("b.out", "a.input")), "a.input.x is driven by n.out already");
  EXPECT_EQ(Why(Connect("b.out", "a.input", true)), "a.input.x is driven by n.out already");
  EXPECT_TRUE(Connect("b.out.x", "a.input.x", true).ok());
  EXPECT_EQ(g.graph.PlugName(g.graph.FindConnection(g.plug("a.input.x"))->source), "b.out.x");
  EXPECT_EQ(g.graph.Outputs(g.plug("n.out").node).size(), 0u);
  g.connect("n.out", "t.input[2]");
  EXPECT_TRUE(Connect("n.out", "t.input[1]").ok());
  EXPECT_FALSE(Connect("n.out", "t.input[2]").ok());
  EXPECT_EQ(g.graph.ArraySize(g.plug("t.out").node, g.plug("t.input[0]").attribute), 3);
  // Points, as a whole, one by one and by component
  g.add("source", "src");
  g.connect("n.out", "g.points[1].x");
  EXPECT_TRUE(Connect("n.out", "g.points[1].y").ok());
  EXPECT_FALSE(Connect("b.out", "g.points[1]").ok());
  EXPECT_FALSE(Connect("src.outPoints", "g.points").ok());
  ASSERT_TRUE(g.graph.Disconnect(g.plug("g.points[1].x")).ok());
  ASSERT_TRUE(g.graph.Disconnect(g.plug("g.points[1].y")).ok());
  EXPECT_TRUE(Says(Why(g.graph.Disconnect(g.plug("g.points[1].y"))), "has no connection"));
  g.connect("src.outPoints", "g.points");
  EXPECT_EQ(Why(Connect("b.out", "g.points[0]")), "g.points is driven by src.outPoints already");
  EXPECT_EQ(Why(Connect("n.out", "g.points[0].z")), "g.points is driven by src.outPoints already");
}

TEST_F(GraphTest, ARefusedReplacementKeepsWhatWasThere) {
  for (const char* name : {"a", "b", "c"}) g.add("add", name);
  g.connect("a.out", "b.a");
  g.connect("b.out", "c.a");
  EXPECT_TRUE(Says(Why(Connect("c.out", "b.a", true)), "cycle"));
  ASSERT_NE(g.graph.FindConnection(g.plug("b.a")), nullptr);
  EXPECT_EQ(g.graph.PlugName(g.graph.FindConnection(g.plug("b.a"))->source), "a.out");
  EXPECT_EQ(g.graph.Outputs(g.plug("a.out").node).size(), 1u);
  // What it replaces is no part of the cycle
  EXPECT_TRUE(Connect("b.out", "a.a").ok() == false);
  ASSERT_TRUE(g.graph.Disconnect(g.plug("b.a")).ok());
  g.connect("b.out", "a.a");
  EXPECT_TRUE(Connect("a.b", "b.a").ok());
}

TEST_F(GraphTest, ARemovedNodeIsGoneAndItsIdIsStale) {
  const NodeId a = g.add("add", "a"), b = g.add("add", "b", {{"b", 2.0}}), c = g.add("add", "c");
  g.connect("a.out", "b.a");
  g.connect("b.out", "c.a");
  g.graph.AddAlias(b, "other");
  const PlugRef stale = g.plug("b.a");
  ASSERT_TRUE(g.graph.RemoveNode(b).ok());
  EXPECT_FALSE(g.graph.IsAlive(b));
  EXPECT_TRUE(g.graph.Outputs(a).empty());
  EXPECT_TRUE(g.graph.Inputs(c).empty());
  EXPECT_FALSE(g.graph.FindNode("b").ok());
  EXPECT_FALSE(g.graph.FindNode("other").ok());
  EXPECT_EQ(Why(g.graph.Set(stale, 1.0)), "a plug of a node that was removed");
  EXPECT_EQ(Why(g.graph.Connect(g.plug("a.out"), stale)), "a plug of a node that was removed");
  EXPECT_EQ(Why(g.graph.RemoveNode(b)), "the node was removed before");
  EXPECT_EQ(g.graph.PlugName(stale), "(removed node)");
  g.request.outputs = {{stale, {}}};
  EXPECT_FALSE(g.compile().ok());
  g.request = Request();
  g.request.varying = {stale};
  EXPECT_FALSE(g.compile().ok());
  // Another node of that name, wired anew
  const NodeId again = g.add("add", "b", {{"b", 3.0}});
  EXPECT_FALSE(again == b);
  g.request = Request();
  g.connect("a.out", "b.a");
  g.connect("b.out", "c.a");
  EXPECT_DOUBLE_EQ(g.pull<double>("c.out"), 3);
  EXPECT_EQ(g.graph.Nodes().size(), 3u);
}

TEST_F(GraphTest, ElementsOfOneNameAreToldApart) {
  g.add("grid", "cage");
  const PlugRef first = g.plug("cage.weight[0]");
  g.graph.SetElementNames(first.node, first.attribute, {"smile", "jaw", "smile", ""});
  EXPECT_EQ(NameOf("cage.weight[0]"), "cage.weight[smile#0]");
  EXPECT_EQ(NameOf("cage.weight[smile#2]"), "cage.weight[smile#2]");
  EXPECT_EQ(NameOf("cage.weight[3]"), "cage.weight[3]");
  EXPECT_EQ(NameOf("cage.weight[smile]"), "cage.weight has several elements \"smile\": smile#0, smile#2");
}

TEST_F(GraphTest, PlugsByName) {
  g.add("scale3", "upperarm01.L");
  g.add("scale3", "upperarm01.L.a b");
  g.add("grid", "Cage 1");
  g.graph.SetElementNames(g.plug("Cage 1.size").node, g.plug("Cage 1.weight[0]").attribute,
                          {"smile", "jaw.open", "brow up"});
  EXPECT_EQ(NameOf("upperarm01.L.input.x"), "upperarm01.L.input.x");
  EXPECT_EQ(NameOf("upperarm01.L.a b.inputY"), "upperarm01.L.a b.input.y");  // the longest name wins
  EXPECT_EQ(NameOf("Cage 1.weight[jaw.open]"), "Cage 1.weight[jaw.open]");
  EXPECT_EQ(NameOf("Cage 1.weight[2]"), "Cage 1.weight[brow up]");
  EXPECT_EQ(NameOf("Cage 1.weight[smil]"), "Cage 1.weight has no element \"smil\" (did you mean \"smile\"?)");
  EXPECT_EQ(NameOf("Cage 1.weight[3]"),
            "Cage 1.weight has no element \"3\"; there is smile, jaw.open, brow up");
  EXPECT_EQ(NameOf("Cage 1.points[1,2,1]"), "Cage 1.points[11]");  // s fastest
  EXPECT_EQ(NameOf("Cage 1.points[1,0,0].y"), "Cage 1.points[1].y");
  EXPECT_TRUE(Says(NameOf("Cage 1.points[1,3,0]"), "expected three indices within the divisions [2, 3, 2]"));
  EXPECT_TRUE(Says(NameOf("Cage 1.points[1,2]"), "expected three indices"));
  EXPECT_TRUE(Says(NameOf("Cage 1.points[-1]"), "expected an index from 0"));
  g.add("grid", "flat", {{"divisions", Value(std::vector<std::int64_t>{2, 5})}});
  EXPECT_TRUE(Says(NameOf("flat.points[0,2,0]"), "divisions takes three numbers, not 2"));
  EXPECT_TRUE(Says(NameOf("Cage 1.points[99999999999999999999]"), "expected an index from 0"));
  EXPECT_EQ(NameOf("Cage 1.pivot.z"), "Cage 1.center.z");
  EXPECT_EQ(NameOf("Cage 1.weight"),
            "Cage 1.weight is an array: name an element, weight[smile]; there is smile, jaw.open, brow up");
  EXPECT_EQ(NameOf("Cage 1.size[0]"), "Cage 1.size is no array");
  EXPECT_TRUE(Says(NameOf("Cage 1.points[1"), "[ without ]"));
  EXPECT_TRUE(Says(NameOf("Cage 1.center.q"), "expected .x, .y or .z"));
  EXPECT_EQ(NameOf("Cage 1.sice"),
            "node \"Cage 1\" (grid) has no attribute \"sice\" (did you mean \"size\"?)");
  EXPECT_EQ(NameOf("Cgae 1.size"),
            "unknown node \"Cgae 1\" in plug \"Cgae 1.size\" (did you mean \"Cage 1\"?)");
  EXPECT_EQ(Why(g.graph.FindPlug("elbow.rotate.x")), "unknown node \"elbow\" in plug \"elbow.rotate.x\"");
  EXPECT_EQ(NameOf("size"), "\"size\" is no plug: expected node.attribute");
  for (const char* odd : {"", ".", "..", "[", "]", ".[", "Cage 1.", ".size", "Cage 1.[0]", "Cage 1.weight[]",
                          "Cage 1.points[,,]", "Cage 1.center.x.y"}) {
    EXPECT_FALSE(g.graph.FindPlug(odd).ok()) << odd;
  }
}

TEST_F(GraphTest, GridsOfHostileSizesAreRefused) {
  g.add("grid", "g", {{"divisions", std::vector<std::int64_t>{4000000000, 4000000000, 4000000000}}});
  EXPECT_FALSE(g.graph.FindPlug("g.points[2000000000,2000000000,2]").ok());
  EXPECT_FALSE(g.graph.FindPlug("g.points[0,9,9]").ok());
  EXPECT_TRUE(g.graph.FindPlug("g.points[7,0,0]").ok());
}

TEST_F(GraphTest, AliasesAndDelegates) {
  const NodeId a = g.add("add", "Head#3"), b = g.add("add", "Head#49"), grid = g.add("grid", "mesh_lattice"),
               s = g.add("scale3", "mesh");
  g.graph.AddAlias(a, "/Torso/Head");
  EXPECT_EQ(NameOf("/Torso/Head.a"), "Head#3.a");
  g.graph.AddAlias(a, "Head");
  EXPECT_EQ(NameOf("Head.a"), "Head#3.a");
  g.graph.AddAlias(b, "Head");
  EXPECT_EQ(NameOf("Head.a"), "\"Head\" is the name of several nodes: write Head#3 or Head#49");
  ASSERT_TRUE(g.graph.RemoveNode(a).ok());
  EXPECT_EQ(NameOf("Head.a"), "Head#49.a");
  EXPECT_FALSE(g.graph.FindNode("/Torso/Head").ok());
  g.graph.AddAlias(s, "Head#49");  // own names go first
  EXPECT_EQ(NameOf("Head#49.a"), "Head#49.a");
  EXPECT_EQ(Why(g.graph.AddNode("add", "Head")), "\"Head\" is another name of node \"Head#49\" already");

  g.graph.AddDelegate(s, grid);
  g.graph.AddDelegate(grid, s);  // round and round
  EXPECT_EQ(NameOf("mesh.weight[4]"), "mesh_lattice.weight[4]");
  EXPECT_EQ(NameOf("mesh.input.x"), "mesh.input.x");
  EXPECT_EQ(NameOf("mesh.size[1]"), "mesh_lattice.size is no array");
  EXPECT_EQ(NameOf("mesh.weigth[4]"),
            "node \"mesh\" (scale3) has no attribute \"weigth\" (did you mean \"weight\"?)");
  ASSERT_TRUE(g.graph.RemoveNode(grid).ok());
  EXPECT_TRUE(Says(NameOf("mesh.weight[4]"), "no attribute"));
}

// Every name that is printed finds the same plug again, whatever it holds.
TEST_F(GraphTest, NamesAreReadBackAsTheyArePrinted) {
  const std::vector<std::string> nodes = {"a",     "a.b",     "a.b.c", "a.input", "upperarm01.L",
                                          "x#1",   "ns:hand", "p/q",   "m@s.",    "left arm",
                                          "größe", "w[1]",    "]",     "."};
  for (const std::string& name : nodes) {
    g.add("scale3", name);
    const NodeId grid = g.add("grid", name + "|grid");
    const int weight = g.graph.def(grid).FindAttribute("weight");
    g.graph.SetElementNames(grid, weight, {"a.b", "x", "x#1", "x", "p/3", "[0]", "größe", "x#3"});
    std::vector<PlugRef> plugs;
    const int input = g.graph.def(g.plug(name + ".input").node).FindAttribute("input");
    for (int c = -1; c < 3; ++c) plugs.push_back({g.plug(name + ".input").node, input, -1, c});
    for (int e = 0; e < 8; ++e) plugs.push_back({grid, weight, e, -1});
    for (const PlugRef& plug : plugs) {
      for (const std::string& text : {g.graph.PlugName(plug), g.graph.AuthoredName(plug)}) {
        const Result<PlugRef> found = g.graph.FindPlug(text);
        ASSERT_TRUE(found.ok()) << found.status().ToString();
        EXPECT_TRUE(*found == plug) << text << " is " << g.graph.PlugName(*found);
      }
    }
  }
  EXPECT_EQ(g.graph.AuthoredName(g.plug("a.b.input.y")), "a.b.inputY");
  EXPECT_EQ(g.graph.AuthoredName(g.plug("a.b.input")), "a.b.input");
  EXPECT_EQ(NameOf("a.input.factr"),
            "node \"a.input\" (scale3) has no attribute \"factr\" (did you mean "
            "\"factor\"?)");
}

TEST_F(GraphTest, FreeNodeNamesAreOfNobody) {
  EXPECT_EQ(g.graph.FreeNodeName("check"), "check");
  const NodeId check = g.add("add", "check");
  g.graph.AddAlias(check, "check_");
  EXPECT_EQ(g.graph.FreeNodeName("check"), "check__");
}

TEST_F(GraphTest, WhatIsWrittenIsToldFromLaterPoses) {
  const NodeId s = g.add("scale3", "s", {{"input", Double3{1, 2, 3}}}), grid = g.add("grid", "grid");
  const int input = g.plug("s.input").attribute, divisions = g.graph.def(grid).FindAttribute("divisions");
  ASSERT_TRUE(g.graph.Pose(g.plug("s.input.y"), 5.0).ok());
  g.graph.AdoptPoses();
  EXPECT_EQ(g.graph.WrittenValues(s, input).size(), 2u);
  EXPECT_EQ(g.graph.WrittenValues(s, input).data(), g.graph.Values(s, input).data());
  ASSERT_TRUE(g.graph.Pose(g.plug("s.input"), Double3{7, 8, 9}).ok());
  ASSERT_TRUE(g.graph.Pose(g.plug("s.input.x"), 4.0).ok());
  ASSERT_EQ(g.graph.WrittenValues(s, input).size(), 2u);
  EXPECT_EQ(g.graph.WrittenValues(s, input)[1].value.AsDouble(), 5);
  EXPECT_EQ(g.graph.RestValues(s, input).size(), 1u);
  // Structural ones have no pose, but are told as well
  ASSERT_TRUE(g.graph.Pose({grid, divisions, -1, -1}, std::vector<std::int64_t>{2, 2, 2}).ok());
  EXPECT_FALSE(g.graph.IsPosed(grid, divisions));
  EXPECT_EQ(g.graph.Values(grid, divisions).size(), 1u);
  EXPECT_EQ(g.graph.WrittenValues(grid, divisions).size(), 0u);
}

TEST_F(GraphTest, ElementsBeyondAnyReasonAreRefused) {
  g.add("sum", "t");
  PlugRef plug = g.plug("t.input[0]");
  plug.element = 1 << 28;
  EXPECT_FALSE(g.graph.Set(plug, 1.0).ok());
  EXPECT_EQ(g.graph.ArraySize(plug.node, plug.attribute), 0);
}

}  // namespace
}  // namespace kpsa::engine
