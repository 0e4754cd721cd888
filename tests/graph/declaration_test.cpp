// Declarations that do not fit: each is told with node, attribute, what was expected and what was given, and
// no graph takes a node of such a registry.
#include <gtest/gtest.h>

#include "graph/graph.h"
#include "graph/node_registry.h"
#include "tests/graph/declared.h"

namespace kpsa::engine {
namespace {

void FloorMany(NodeBatch<In<"p", double>, Out<"x", double>>) {}

enum class Side { kLeft, kRight };

NodeBuilder AllKinds(NodeBuilder n) {
  return n.in("flag", true)
      .in("count", 3)
      .enumeration("side", {"left", "right"}, false)
      .in("x", 1.0)
      .in("v", Double3{1, 2, 3})
      .in("q", Quaternion{})
      .in("m", Matrix4{})
      .in("list", 0.0)
      .array()
      .structural("steps", 3)
      .out("output", Type::kDouble);
}

TEST(Declarations, EveryKindThatFitsIsTaken) {
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              AllKinds(n).compute([](bool flag, std::int64_t count, Side side, double x, const Double3& v,
                                     Quaternion q, const Matrix4&, const ArrayView<double>& list) noexcept {
                return flag && side == Side::kLeft ? x + v.x + q.w + static_cast<double>(count) + list.size()
                                                   : 0.0;
              });
            }),
            "");
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              n.in("a", 1).out("output", Type::kEnum).compute([](int a) {
                return a > 0 ? Side::kLeft : Side::kRight;
              });
            }),
            "");
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              n.points_in("w", "", Type::kWeights).out("output", Type::kInt).compute([](ConstPointsView w) {
                return w.count;
              });
            }),
            "");
}

TEST(Declarations, OneParameterTooManyOrTooFew) {
  EXPECT_EQ(
      ProblemOf([](NodeBuilder n) {
        n.in("a", 0.0).structural("k", 1.0).out("output", Type::kDouble).compute([](double a, double k) {
          return a * k;
        });
      }),
      "node type \"n\": compute takes 2 parameters; expected 1, one for each input that is not structural "
      "(a)");
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              n.in("a", 0.0).in("b", 0.0).out("output", Type::kDouble).compute([](double a) { return a; });
            }),
            "node type \"n\": compute takes 1 parameter; expected 2, one for each input that is not "
            "structural (a, b)");
  EXPECT_EQ(
      ProblemOf([](NodeBuilder n) { n.out("output", Type::kDouble).compute([](double a) { return a; }); }),
      "node type \"n\": compute takes 1 parameter; expected 0, one for each input that is not structural "
      "(none)");
}

TEST(Declarations, AParameterOfAnotherType) {
  const auto with = [](auto compute) {
    return ProblemOf([&](NodeBuilder n) { n.in("a", 0.0).out("output", Type::kDouble).compute(compute); });
  };
  EXPECT_EQ(
      with([](Matrix4) { return 0.0; }),
      "node type \"n\", attribute \"a\" (double): compute takes Matrix4 as parameter 1; expected double");
  EXPECT_EQ(
      with([](int) { return 0.0; }),
      "node type \"n\", attribute \"a\" (double): compute takes an integer as parameter 1; expected double");
  EXPECT_EQ(
      with([](ArrayView<double>) { return 0.0; }),
      "node type \"n\", attribute \"a\" (double): compute takes ArrayView<double> as parameter 1; expected "
      "double");
  EXPECT_EQ(
      with([](ConstPointsView) { return 0.0; }),
      "node type \"n\", attribute \"a\" (double): compute takes ConstPointsView as parameter 1; expected "
      "double");
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              n.in("a", 0.0).array().out("output", Type::kDouble).compute([](double a) { return a; });
            }),
            "node type \"n\", attribute \"a\" (double array): compute takes double as parameter 1; expected "
            "ArrayView<double>");
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              n.in("on", true).out("output", Type::kDouble).compute([](Side) { return 0.0; });
            }),
            "node type \"n\", attribute \"on\" (bool): compute takes an enum as parameter 1; expected bool");
}

TEST(Declarations, AResultOfAnotherType) {
  const auto with = [](Type type, auto compute) {
    return ProblemOf([&](NodeBuilder n) { n.in("a", 0.0).out("output", type).compute(compute); });
  };
  EXPECT_EQ(with(Type::kDouble, [](double) { return 1; }),
            "node type \"n\", attribute \"output\" (double): compute returns an integer; expected double");
  EXPECT_EQ(with(Type::kMatrix, [](double a) { return a; }),
            "node type \"n\", attribute \"output\" (matrix): compute returns double; expected Matrix4");
  EXPECT_EQ(with(Type::kBool, [](double) { return Double3{}; }),
            "node type \"n\", attribute \"output\" (bool): compute returns Double3; expected bool");
  EXPECT_EQ(with(Type::kPoints, [](double a) { return a; }),
            "node type \"n\", attribute \"output\" (points): compute returns double; expected a function of "
            "ComputeContext& that writes the output itself");
  EXPECT_EQ(
      ProblemOf([](NodeBuilder n) {
        n.in("a", 0.0).out("x", Type::kDouble).out("y", Type::kDouble).compute([](double a) { return a; });
      }),
      "node type \"n\": compute returns one value, but is to compute 2 outputs; expected a function of "
      "ComputeContext&, or a compute_for() for each of them");
}

TEST(Declarations, OnesThatContradictThemselves) {
  const auto copy = [](double a) { return a; };
  EXPECT_EQ(
      ProblemOf([&](NodeBuilder n) {
        n.in("a", 0.0).out("x", Type::kDouble).compute(copy).out("y", Type::kDouble);
      }),
      "node type \"n\", attribute \"y\": nothing computes this output; expected a compute() after it is "
      "declared");
  EXPECT_EQ(
      ProblemOf([&](NodeBuilder n) {
        n.in("a", 0.0).in("a", 1.0).out("x", Type::kDouble).compute([](double a, double b) { return a + b; });
      }),
      "node type \"n\", attribute \"a\": declared twice; expected each name once");
  EXPECT_EQ(ProblemOf([&](NodeBuilder n) {
              n.in("a", 0.0).out("x", Type::kDouble).compute_for({"x"}, {"a"}, copy).in_place("b");
            }),
            "node type \"n\", attribute \"b\": the compute before it has no such input");
  EXPECT_NE(ProblemOf([&](NodeBuilder n) {
              n.in("a", AssetPtr()).out("x", Type::kDouble).compute(copy);
            }).find("its default tells no type"),
            std::string::npos);

  NodeRegistry none;  // nothing of it may be touched: each of these is noted, and none crashes
  none.add("m", "").doc("of nothing").lazy().world_place();
  none.add("g", "").cost(1, 1).in_place("a").strength("a").passes("a", {"b"});
  none.add("o", "").out("x", Type::kString).compute_for({"y"}, {"x"}, copy);
  none.add("b", "")
      .points_in("p", "", Type::kDouble)
      .out("x", Type::kPoints)
      .compute([](ComputeContext&) {})
      .batch<FloorMany>(nullptr);
  EXPECT_GE(none.status().errors().size(), 12u) << none.status().ToString();
}

TEST(Declarations, NamesOfAnotherRegistryAreProblemsToo) {
  const auto fill = [](NodeRegistry* registry, const char* name) {
    registry->add(name, "").in("a", 0.0).out("x", Type::kDouble).compute([](double a) { return a; });
  };
  NodeRegistry one, other, third;
  fill(&one, "same");
  fill(&other, "other");
  fill(&third, "same");
  const NodeDef* const def = other.Find("other");
  one.Take(std::move(other));
  EXPECT_TRUE(one.status().ok());
  EXPECT_EQ(one.Find("other"), def);
  one.Take(std::move(third));
  ASSERT_EQ(one.status().errors().size(), 1u);
  EXPECT_EQ(one.status().errors()[0].message,
            "node type \"same\" is registered twice; expected each name once");
  EXPECT_FALSE(Graph(one).AddNode("other", "n").ok()) << "a registry with such a node is of no use";
}

}  // namespace
}  // namespace kpsa::engine
