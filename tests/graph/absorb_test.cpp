// Graph::Absorb: all that a graph holds is there in the other one, under its prefix.
#include <gtest/gtest.h>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

class AbsorbTest : public testing::Test {
 protected:
  AbsorbTest() : into(ToyRegistry()), from(ToyRegistry()) {
    // Both have a hole
    into.add("add", "gone");
    into.add("add", "sum", {{"a", 1.0}, {"b", 2.0}});
    Remove(&into, "gone");
    from.add("add", "first", {{"a", 10.0}});
    from.add("sum", "gone");
    from.add("add", "second", {{"b", 100.0}});
    from.connect("first.out", "second.a");
    from.connect("first.out", "gone.input[0]");
    Remove(&from, "gone");
  }
  static void Remove(TestGraph* g, const std::string& name) {
    ASSERT_TRUE(g->graph.RemoveNode(*g->graph.FindNode(name)).ok());
    g->plan = nullptr;
  }
  // A copy of `from`, so that it can be looked at afterwards.
  Result<Index> Absorb(const std::string& prefix) {
    into.plan = nullptr;
    return into.graph.Absorb(from.graph, prefix);
  }
  std::string NameOf(const std::string& text) const {
    const Result<PlugRef> plug = into.graph.FindPlug(text);
    return plug.ok() ? into.graph.PlugName(*plug) : plug.status().ToString();
  }
  std::string NamesOfNodes() const {
    std::string names;
    for (const NodeId node : into.graph.Nodes()) names += into.graph.name(node) + " ";
    return names;
  }
  TestGraph into, from;
};

TEST_F(AbsorbTest, NodesValuesAndConnectionsMove) {
  const NodeId before = *from.graph.FindNode("second");
  const Index capacity = into.graph.node_capacity();
  const Result<Index> offset = Absorb("hero:");
  ASSERT_TRUE(offset.ok());
  EXPECT_EQ(*offset, capacity);
  EXPECT_EQ(NamesOfNodes(), "sum hero:first hero:second ");
  EXPECT_EQ(into.graph.node_capacity(), capacity + from.graph.node_capacity());
  EXPECT_EQ(*into.graph.FindNode("hero:second"), (NodeId{before.index + *offset, before.version}));
  for (const Index removed : {Index{0}, *offset + 1}) {
    EXPECT_EQ(into.graph.IdAt(removed).version, 0u);
    EXPECT_FALSE(into.graph.IsAlive({removed, 1}));
  }
  EXPECT_FALSE(into.graph.FindNode("first").ok());
  EXPECT_FALSE(into.graph.FindNode("hero:gone").ok());
  const NodeId first = *into.graph.FindNode("hero:first");
  ASSERT_EQ(into.graph.Outputs(first).size(), 1u);
  EXPECT_EQ(into.graph.PlugName(into.graph.Outputs(first)[0].destination), "hero:second.a");
  EXPECT_EQ(into.graph.PlugName(into.graph.FindConnection(into.plug("hero:second.a"))->source),
            "hero:first.out");
  const auto values = into.graph.Values(first, into.plug("hero:first.a").attribute);
  ASSERT_EQ(values.size(), 1u);
  EXPECT_EQ(values[0].plug, into.plug("hero:first.a"));
  // And all of it goes on living
  EXPECT_EQ(into.pull<double>("hero:second.out"), 110);
  into.connect("sum.out", "hero:first.b");
  EXPECT_EQ(into.pull<double>("hero:second.out"), 113);
  EXPECT_FALSE(into.graph.Connect(into.plug("hero:second.out"), into.plug("sum.a")).ok()) << "a cycle";
  ASSERT_TRUE(into.graph.RemoveNode(first).ok());
  into.plan = nullptr;
  EXPECT_EQ(into.pull<double>("hero:second.out"), 100);
  // Twice, under another name; a name that was removed is free
  ASSERT_TRUE(Absorb("b:").ok());
  EXPECT_EQ(into.pull<double>("b:second.out"), 110);
  EXPECT_TRUE(into.graph.AddNode("add", "b:gone").ok());
}

TEST_F(AbsorbTest, AliasesStayUniqueOrBecomeAmbiguous) {
  from.graph.AddAlias(*from.graph.FindNode("first"), "/Torso/Head");
  for (const char* node : {"first", "second"}) from.graph.AddAlias(*from.graph.FindNode(node), "Head");
  from.graph.AddAlias(*from.graph.FindNode("second"), "Hand");
  into.graph.AddAlias(*into.graph.FindNode("sum"), "hero:Hand");
  into.graph.AddAlias(*into.graph.FindNode("sum"), "Foot");
  EXPECT_EQ(NameOf("hero:Hand.a"), "sum.a");
  ASSERT_TRUE(Absorb("hero:").ok());
  EXPECT_EQ(NameOf("hero:/Torso/Head.a"), "hero:first.a");
  EXPECT_EQ(NameOf("hero:Head.a"),
            "\"hero:Head\" is the name of several nodes: write hero:first or hero:second");
  EXPECT_EQ(NameOf("hero:Hand.a"), "\"hero:Hand\" is the name of several nodes: write sum or hero:second");
  EXPECT_EQ(NameOf("Foot.a"), "sum.a");
  EXPECT_FALSE(into.graph.FindNode("Head").ok());
  Remove(&into, "hero:first");  // its aliases go with it
  EXPECT_EQ(NameOf("hero:Head.a"), "hero:second.a");
  EXPECT_FALSE(into.graph.FindNode("hero:/Torso/Head").ok());
  // A node's own name goes before the alias of another, whichever was there first
  into.add("add", "b:Head");
  ASSERT_TRUE(Absorb("b:").ok());
  EXPECT_EQ(NameOf("b:Head.a"), "b:Head.a");
}

TEST_F(AbsorbTest, DelegatesAndNamesOfElementsMove) {
  const NodeId mesh = from.add("scale3", "mesh"), grid = from.add("grid", "lattice");
  from.graph.AddDelegate(mesh, grid);
  from.graph.SetElementNames(grid, from.plug("lattice.weight[0]").attribute, {"smile", "frown"});
  from.hold("lattice.weight[1]", 0.5);
  ASSERT_TRUE(Absorb("hero:").ok());
  EXPECT_EQ(into.plug("hero:mesh.weight[smile]"), into.plug("hero:lattice.weight[0]"));
  EXPECT_EQ(into.plug("hero:mesh.weight[frown]"), into.plug("hero:lattice.weight[1]"));
  EXPECT_EQ(into.graph.FindValue(into.plug("hero:mesh.weight[frown]"))->AsDouble(), 0.5);
  Remove(&into, "hero:lattice");
  EXPECT_NE(NameOf("hero:mesh.weight[1]").find("has no attribute \"weight\""), std::string::npos);
}

TEST_F(AbsorbTest, PosesStayPoses) {
  ASSERT_TRUE(from.graph.Pose(from.plug("first.a"), 11.0).ok());
  ASSERT_TRUE(from.graph.Pose(from.plug("second.b"), 7.0).ok());
  ASSERT_TRUE(into.graph.Pose(into.plug("sum.a"), 5.0).ok());
  ASSERT_TRUE(Absorb("hero:").ok());
  for (const auto& [name, rest, now] :
       {std::tuple("hero:first.a", 10.0, 11.0), std::tuple("hero:second.b", 100.0, 7.0),
        std::tuple("sum.a", 1.0, 5.0)}) {
    const PlugRef plug = into.plug(name);
    EXPECT_TRUE(into.graph.IsPosed(plug.node, plug.attribute)) << name;
    const auto values = into.graph.RestValues(plug.node, plug.attribute);
    ASSERT_EQ(values.size(), 1u) << name;
    EXPECT_EQ(values[0].plug, plug) << name;
    EXPECT_EQ(values[0].value.AsDouble(), rest) << name;
    EXPECT_EQ(into.graph.FindValue(plug)->AsDouble(), now) << name;
  }
  EXPECT_FALSE(into.graph.IsPosed(into.plug("hero:first.b").node, into.plug("hero:first.b").attribute));
  EXPECT_EQ(into.pull<double>("hero:second.out"), 18);
}

TEST_F(AbsorbTest, ARefusalChangesNothing) {
  into.add("add", "hero:second", {{"a", 4.0}});
  into.graph.AddAlias(*into.graph.FindNode("sum"), "villain:second");
  from.graph.AddAlias(*from.graph.FindNode("first"), "Head");
  const std::string names = NamesOfNodes();
  const Index capacity = into.graph.node_capacity();
  for (const std::string prefix : {"hero:", "villain:"}) {
    const Result<Index> refused = Absorb(prefix);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.status().ToString(), "a node named \"" + prefix + "second\" exists already");
    EXPECT_EQ(NamesOfNodes(), names);
    EXPECT_EQ(into.graph.node_capacity(), capacity);
    EXPECT_FALSE(into.graph.FindNode(prefix + "first").ok());
    EXPECT_FALSE(into.graph.FindNode(prefix + "Head").ok());
    EXPECT_EQ(into.pull<double>("hero:second.out"), 4);
    EXPECT_EQ(NameOf("villain:second.a"), "sum.a");
  }
  // What was removed stands in nobody's way
  Remove(&into, "hero:second");
  Remove(&into, "sum");
  EXPECT_TRUE(Absorb("hero:").ok());
  EXPECT_TRUE(Absorb("villain:").ok());
  EXPECT_EQ(NamesOfNodes(), "hero:first hero:second villain:first villain:second ");
}

}  // namespace
}  // namespace kpsa::engine
