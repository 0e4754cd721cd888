// What a node's author got wrong in the functions of a node is an error that names the node, wherever these run: while a
// plan is made, in an evaluation, on whatever thread. The host goes on.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "tests/support/test_graph.h"
#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

constexpr double kWrong = 1;  // from there on, `input` makes computes do it wrong

// Inputs 0 to 4: input, many (an array), place, on, points; outputs 0 and 1: out, matrix.
NodeBuilder Declare(NodeRegistry* registry) {
  return registry->add("odd", "")
      .in("input", 0.0)
      .in("many", 0.0)
      .array()
      .in("place", Double3())
      .in("on", false)
      .points_in("points")
      .structural("count", 2)
      .out("out", Type::kDouble)
      .out("matrix", Type::kMatrix);
}

template <typename F>
std::string Said(F mistake, bool varying = true, bool parallel = false) {
  static F* wrong = nullptr;
  wrong = &mistake;
  NodeRegistry registry;
  Declare(&registry).compute([](ComputeContext& c) {
    if (c.get<double>(0) >= kWrong) (*wrong)(c);
    c.out_value<double>(0) = c.get<double>(0) + c.array<double>(1)[1];
    c.out_value<Matrix4>(1) = Matrix4();
  });
  EXPECT_TRUE(registry.status().ok()) << registry.status().ToString();
  TestGraph g(registry);
  g.options.parallel = parallel;
  g.add("odd", "nose", {{"many[0]", 3.0}, {"many[1]", 4.0}});
  if (!varying) {
    g.hold("nose.input", kWrong);
    return g.try_pull("nose.out").ToString();
  }
  g.vary("nose.input");
  EXPECT_EQ(g.pull<double>("nose.out"), 4) << "nothing is wrong yet";
  g.set("nose.input", kWrong);
  const std::string said = g.try_pull("nose.out").ToString();
  g.set("nose.input", 0.5);
  EXPECT_EQ(g.pull<double>("nose.out"), 4.5) << "and nothing afterwards";
  return said;
}

bool Tells(const std::string& said, const std::string& what) {
  return said.find("nose") != std::string::npos && said.find(what) != std::string::npos;
}

TEST(AuthorMistakes, PositionsThatAreNotThere) {
  const std::string inputs = "it has 5 (input, many, place, on, points)";
  for (const bool varying : {true, false}) {
    const std::string said = Said([](ComputeContext& c) { c.get<double>(7); }, varying);
    EXPECT_TRUE(Tells(said, "its compute asks for input 7 (counted from 0), " + inputs)) << said;
  }
  for (const auto& wrong :
       {+[](ComputeContext& c) { c.get<double>(-1); }, +[](ComputeContext& c) { c.array<double>(5); },
        +[](ComputeContext& c) { c.points(1000); }}) {
    const std::string said = Said(wrong);
    EXPECT_TRUE(Tells(said, inputs)) << said;
  }
  const std::string output = Said([](ComputeContext& c) { c.out_value<double>(2) = 1; });
  EXPECT_TRUE(Tells(output, "asks for output 2 (counted from 0), it has 2 (out, matrix)")) << output;
}

TEST(AuthorMistakes, SlotsOfAnotherType) {
  const std::pair<void (*)(ComputeContext&), const char*> kWrongs[] = {
      {[](ComputeContext& c) { c.get<Double3>(0); }, "reads input 0, \"input\" (double), as Double3"},
      {[](ComputeContext& c) { c.points(0); }, "reads input 0, \"input\" (double), as points"},
      {[](ComputeContext& c) { c.get<double>(4); }, "reads input 4, \"points\" (points), as double"},
      {[](ComputeContext& c) { c.get<double>(1); }, "reads input 1, \"many\" (double array), as double"},
      {[](ComputeContext& c) { c.array<double>(0); },
       "reads input 0, \"input\" (double), as an array of double"},
      {[](ComputeContext& c) { c.array<Matrix4>(1); }, "\"many\" (double array), as an array of Matrix4"},
      {[](ComputeContext& c) { c.get<float>(0); }, "as a type that no slot is of"},
      {[](ComputeContext& c) { c.get<bool>(3); }, "\"on\" (bool), as a type that no slot is of"},
      {[](ComputeContext& c) { c.get<int>(3); }, "as a type that no slot is of"},
      {[](ComputeContext& c) { c.out_value<Matrix4>(0) = Matrix4(); },
       "writes output 0, \"out\" (double), as Matrix4"},
      {[](ComputeContext& c) { c.out_points(1); }, "writes output 1, \"matrix\" (matrix), as points"},
      {[](ComputeContext& c) { c.out_value<double>(0, 0) = 1; }, "\"out\" (double), as an array of double"},
  };
  for (const auto& [wrong, what] : kWrongs) {
    for (const bool parallel : {false, true}) {
      const std::string said = Said(wrong, true, parallel);
      EXPECT_TRUE(Tells(said, what)) << said;
    }
  }
  // What is right goes through
  EXPECT_EQ(Said([](ComputeContext& c) {
              c.get<std::int64_t>(3), c.get<Double3>(2), c.points(4), c.array<double>(1),
                  c.out_value<Matrix4>(1);
            }),
            "");
}

TEST(AuthorMistakes, ElementsThatAreNotThere) {
  for (const bool varying : {true, false}) {
    const std::string said = Said([](ComputeContext& c) { (void)c.array<double>(1)[2]; }, varying);
    EXPECT_TRUE(Tells(said, "its compute asks for element 2 of \"many\" (double array), which has 2"))
        << said;
  }
}

void ReadChosen(NodeContext<In<"which", double>, In<"input", ArrayView<double>>, Out<"out", double>> c) {
  c.out<"out">() = c.get<"input">()[static_cast<std::uint32_t>(c.get<"which">())];
}

TEST(AuthorMistakes, ElementsOfNamedArrays) {
  NodeRegistry registry;
  registry.add("pick", "")
      .in("which", 0.0)
      .in("input", 0.0)
      .array()
      .out("out", Type::kDouble)
      .compute<ReadChosen>();
  ASSERT_TRUE(registry.status().ok()) << registry.status().ToString();
  TestGraph g(registry);
  g.add("pick", "nose", {{"input[0]", 5.0}, {"input[1]", 6.0}});
  g.vary("nose.which");
  EXPECT_EQ(g.pull<double>("nose.out"), 5);
  for (const double which : {2.0, 4e9}) {
    g.set("nose.which", which);
    const std::string said = g.try_pull("nose.out").ToString();
    EXPECT_TRUE(
        Tells(said, fmt::format("asks for element {} of \"input\" (double array), which has 2", which)))
        << said;
  }
  g.set("nose.which", 1.0);
  EXPECT_EQ(g.pull<double>("nose.out"), 6);
}

// --- While a plan is made

// A node of points whose functions are given; what compiling it says, or evaluating it.
std::string Compiled(const std::function<void(NodeBuilder&)>& finish) {
  NodeRegistry registry;
  AddToyNodes(registry);
  NodeBuilder node = registry.add("odd", "")
                         .structural("count", 2)
                         .in("amount", 0.0)
                         .points_in("inPoints")
                         .out("outPoints", Type::kPoints);
  node.compute([](ComputeContext& c) { CopyPoints(c.points(1), c.out_points(0)); });
  finish(node);
  EXPECT_TRUE(registry.status().ok()) << registry.status().ToString();
  TestGraph g(registry);
  g.add("source", "line");
  g.add("odd", "nose");
  g.connect("line.outPoints", "nose.inPoints");
  g.vary("line.step");
  return g.try_pull("nose.outPoints").ToString();
}

TEST(AuthorMistakes, WhatFunctionsOfTheCompilerAskFor) {
  EXPECT_EQ(Compiled([](NodeBuilder&) {}), "");
  const auto bind = [](auto function) {
    return Compiled([&](NodeBuilder& node) {
      node.bind([function](const Binding& b) -> Result<BoundKernel> {
        function(b);
        return BoundKernel();
      });
    });
  };
  const std::string known = "it has count, amount, inPoints, outPoints";
  std::string said = bind([](const Binding& b) { b.structural().get_int("cuont"); });
  EXPECT_TRUE(Tells(said, "it asks for \"cuont\", which is no attribute of it")) << said;
  EXPECT_TRUE(Tells(said, "did you mean \"count\"") && Tells(said, known)) << said;
  said = bind([](const Binding& b) { b.output("outPoint"); });
  EXPECT_TRUE(Tells(said, "the points of \"outPoint\", which is no output of it")) << said;
  said = bind([](const Binding& b) { b.input("count"); });
  EXPECT_TRUE(Tells(said, "the points of \"count\", which is no input of it")) << said;
  said = bind([](const Binding& b) { PointSet::Of({10}, b.output("outPoints").total()); });
  EXPECT_TRUE(Tells(said, "point 10 of 10")) << said;
  said = bind([](const Binding& b) { b.output("outPoints").Union(PointSet::All(3)); });
  EXPECT_TRUE(Tells(said, "a set of 10 points and one of 3")) << said;
  enum class Mine { kOne };
  said = bind([](const Binding& b) { b.structural().choice<Mine>("nothing"); });
  EXPECT_TRUE(Tells(said, "\"nothing\"")) << said;

  const auto demand = [](DemandFn function) {
    return Compiled([&](NodeBuilder& node) { node.demand(std::move(function)); });
  };
  said = demand([](Demand& d) { d.Require("inPoint", 0, PointSet::All(10)); });
  EXPECT_TRUE(Tells(said, "the points of \"inPoint\", which is no input of it")) << said;
  EXPECT_TRUE(Tells(said, "it has amount, inPoints")) << said;
  said = demand([](Demand& d) { d.Skip("inPoints", 0); });
  EXPECT_TRUE(Tells(said, "it skips \"inPoints\"")) << said;
  said = demand([](Demand& d) { d.Require("inPoints", 0, PointSet::All(3)); });
  EXPECT_TRUE(Tells(said, "inPoints asks for points of an array of 3, its input has 10")) << said;

  const std::string text = "was told to throw";
  said = Compiled(
      [](NodeBuilder& node) { node.demand([](Demand&) { throw std::runtime_error("was told to throw"); }); });
  EXPECT_TRUE(Tells(said, text)) << said;
  said = Compiled([&](NodeBuilder& node) {
    node.point_count([](const Structural&, std::string_view, int) -> Result<Index> {
      throw std::runtime_error("was told to throw");
    });
  });
  EXPECT_TRUE(Tells(said, text)) << said;
  said = Compiled([&](NodeBuilder& node) {
    node.touches("inPoints", [](const Structural&, const PointSet&) -> bool {
      throw std::runtime_error("was told to throw");
    });
  });
  EXPECT_TRUE(Tells(said, text)) << said;
}

void ThrowMany(NodeBatch<In<"input", double>, Out<"out", double>>) {
  throw std::runtime_error("many at once");
}

TEST(AuthorMistakes, ABatchThatThrowsIsComputedOneByOne) {
  NodeRegistry registry;
  AddToyNodes(registry);
  registry.add("twice", "")
      .in("input", 0.0)
      .out("out", Type::kDouble)
      .compute([](double v) { return 2 * v; })
      .batch<ThrowMany>(nullptr);
  TestGraph g(registry);
  g.add("add", "a");
  g.vary("a.a");
  for (int i = 0; i < 16; ++i) {
    const std::string name = "t" + std::to_string(i);
    g.add("twice", name);
    g.connect("a.out", name + ".input");
    g.want(name + ".out");
  }
  ASSERT_TRUE(g.compile().ok());
  ASSERT_EQ(g.plan->batches().size(), 1u);
  g.set("a.a", 3.0);
  ASSERT_TRUE(g.evaluator->Evaluate().ok());
  for (Index output = 0; output < 16; ++output) EXPECT_EQ(g.evaluator->Get<double>(output), 6);
}

TEST(AuthorMistakes, DefaultsThatThrow) {
  NodeRegistry registry;
  AddToyNodes(registry);
  registry.add("odd", "")
      .in("amount", 1.0)
      .default_from([](const Structural& s) { return Value(s.get_double("amuont")); })
      .structural("count", 2)
      .out("out", Type::kDouble)
      .compute([](double amount) { return amount; });
  ASSERT_TRUE(registry.status().ok()) << registry.status().ToString();
  TestGraph g(registry);
  g.add("odd", "nose");
  const std::string said = g.try_pull("nose.out").ToString();
  EXPECT_TRUE(Tells(said, "it asks for \"amuont\", which is no attribute of it")) << said;
}

}  // namespace
}  // namespace kpsa::engine
