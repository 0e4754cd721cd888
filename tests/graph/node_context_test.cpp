// Inputs and outputs by name: what a compute's list reads and writes, what is told of lists that do not fit
// the declaration, and that a name costs what a number costs.
#include "graph/node_context.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "base/matrix.h"
#include "tests/graph/declared.h"
#include "tests/support/instruction_count.h"
#include "tests/support/test_graph.h"

namespace kpsa::engine {
namespace {

enum class Hand { kLeft, kRight };
enum class Other { kOne, kTwo };

using EveryKind = NodeContext<In<"flag", bool>, In<"count", std::int64_t>, In<"side", Hand>, In<"x", double>,
                              In<"v", Double3>, In<"q", Quaternion>, In<"m", Matrix4>,
                              In<"list", ArrayView<double>>, In<"p", ConstPointsView>, Out<"sum", double>,
                              Out<"doubled", OutArray<double>>, Out<"odd", bool>, Out<"points", PointsView>>;

void ComputeEveryKind(EveryKind c) {
  const ArrayView<double> list = c.get<"list">();
  const ConstPointsView& p = c.get<"p">();
  c.out<"sum">() = (c.get<"flag">() ? 1 : 0) + static_cast<double>(c.get<"count">()) +
                   (c.get<"side">() == Hand::kRight ? 10 : 0) + c.get<"x">() + c.get<"v">().y +
                   c.get<"q">().w + c.get<"m">()(0, 3);
  const OutArray<double> doubled = c.out<"doubled">();
  for (std::uint32_t i = 0; i < doubled.size(); ++i) doubled[i] = i < list.size() ? 2 * list[i] : 0;
  c.out<"odd">() = c.get<"count">() % 2 != 0;
  for (std::size_t i = 0; i < p.count; ++i) c.out<"points">().x[i] = 2 * p.x[i];
}

void AddEveryKind(NodeRegistry& registry) {
  registry.add("all", "")
      .in("flag", true)
      .in("count", 3)
      .enumeration<Hand>("side", {{"left", Hand::kLeft}, {"right", Hand::kRight}}, false, "", Hand::kRight)
      .in("x", 1.0)
      .in("v", Double3{1, 2, 3})
      .in("q", Quaternion{})
      .in("m", Translation({5, 0, 0}))
      .in("list", 0.0)
      .array()
      .points_in("p")
      .out("sum", Type::kDouble)
      .out("doubled", Type::kDouble)
      .array()
      .out("odd", Type::kBool)
      .out("points", Type::kPoints)
      .compute<ComputeEveryKind>();
}

void ComputeHand(NodeContext<In<"count", std::int64_t>, Out<"side", std::int64_t>> c) {
  c.out<"side">() = c.get<"count">() % 2;
}

TEST(NodeContexts, AnEnumIsWrittenAsItsNumber) {
  NodeRegistry registry;
  registry.add("hand", "").in("count", 3).out("side", Type::kEnum).compute<ComputeHand>();
  ASSERT_TRUE(registry.status().ok()) << registry.status().ToString();
  TestGraph g(registry);
  g.add("hand", "n");
  EXPECT_EQ(g.pull<std::int64_t>("n.side"), 1);
}

TEST(NodeContexts, ReadAndWriteEveryKindByName) {
  NodeRegistry registry;
  AddEveryKind(registry);
  ASSERT_TRUE(registry.status().ok()) << registry.status().ToString();
  TestGraph g(registry);
  auto points =
      std::make_shared<PointBuffer>(PointBuffer::FromPlaces(std::vector<Double3>{{1, 0, 0}, {4, 0, 0}}));
  g.add("all", "n", {{"list[0]", 2.5}, {"list[1]", 4.0}, {"p", Value(PointBufferPtr(points))}});
  EXPECT_DOUBLE_EQ(g.pull<double>("n.sum"), 1 + 3 + 10 + 1 + 2 + 1 + 5);
  EXPECT_DOUBLE_EQ(g.pull<double>("n.doubled[1]"), 8);
  EXPECT_EQ(g.pull<std::int64_t>("n.odd"), 1);
  EXPECT_EQ(g.pull_points("n.points")[3], 8);
}

template <typename Context>
void Nothing(Context) {}
template <typename Context>
std::uint64_t DecideNothing(Context) {
  return 0;
}

// Of a compute with this list beside inputs a (double), w (double array), k (structural), side (enum Hand) and
// an output x (double).
template <typename... Ports>
std::string ProblemOfPorts() {
  return ProblemOf([](NodeBuilder n) {
    n.in("a", 0.0)
        .alias("alpha")
        .in("w", 1.0)
        .array()
        .structural("k", 1.0)
        .enumeration<Hand>("side", {{"left", Hand::kLeft}, {"right", Hand::kRight}}, false)
        .out("x", Type::kDouble)
        .compute<Nothing<NodeContext<Ports...>>>();
  });
}
using A = In<"a", double>;
using W = In<"w", ArrayView<double>>;
using S = In<"side", Hand>;
using X = Out<"x", double>;

TEST(NodeContexts, NamesThatAreNotDeclared) {
  EXPECT_EQ((ProblemOfPorts<A, W, S, X>()), "");
  EXPECT_EQ((ProblemOfPorts<X, S, A, W>()), "") << "in any order";
  EXPECT_EQ((ProblemOfPorts<A, W, S, In<"b", double>, X>()),
            "node type \"n\", attribute \"b\": compute reads it, but it is not declared; expected one of the "
            "inputs "
            "before it (a, w, side)");
  EXPECT_NE((ProblemOfPorts<A, W, S, In<"alpha", double>, X>())
                .find("\"alpha\": compute reads it, but it is not declared"),
            std::string::npos)
      << "an alias is for rigs";
  EXPECT_EQ((ProblemOfPorts<A, W, S, X, Out<"y", double>>()),
            "node type \"n\", attribute \"y\": compute writes it, but it is not declared; expected one of "
            "the outputs "
            "before it (x)");
  EXPECT_EQ((ProblemOfPorts<A, W, S, In<"k", double>, X>()),
            "node type \"n\", attribute \"k\": compute reads it, but it is structural; expected it to be "
            "read where "
            "kernels are bound");
  EXPECT_EQ((ProblemOfPorts<A, W, S, X, Out<"k", double>>()),
            "node type \"n\", attribute \"k\": compute writes it, but it is an input");
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              n.in("a", 0.0).out("x", Type::kDouble).out("y", Type::kDouble);
              n.compute<Nothing<NodeContext<A, X>>>()
                  .compute<Nothing<NodeContext<In<"x", double>, Out<"y", double>>>>();
            }),
            "node type \"n\", attribute \"x\": compute reads it, but it is an output");
}

TEST(NodeContexts, NamesThatAreForgotten) {
  EXPECT_EQ((ProblemOfPorts<A, S, X>()),
            "node type \"n\", attribute \"w\": no compute names this input; expected it in the list of one");
  EXPECT_EQ(
      ProblemOf([](NodeBuilder n) {
        n.in("a", 0.0).out("x", Type::kDouble).out("y", Type::kDouble).compute<Nothing<NodeContext<A, X>>>();
      }),
      "node type \"n\", attribute \"y\": nothing computes this output; expected a compute() after it is "
      "declared");
  EXPECT_EQ(ProblemOf([](NodeBuilder n) {
              n.in("a", 0.0).out("x", Type::kDouble).compute<Nothing<NodeContext<A, X>>>();
              n.compute<Nothing<NodeContext<A, X>>>();
            }),
            "node type \"n\", attribute \"x\": compute writes it, as another one does; expected one compute "
            "for each "
            "output");
}

TEST(NodeContexts, TypesAndShapesOfAnotherKind) {
  EXPECT_EQ((ProblemOfPorts<In<"a", Matrix4>, W, S, X>()),
            "node type \"n\", attribute \"a\" (double): compute reads it as Matrix4; expected double");
  EXPECT_EQ((ProblemOfPorts<A, In<"w", double>, S, X>()),
            "node type \"n\", attribute \"w\" (double array): compute reads it as double; expected "
            "ArrayView<double>");
  EXPECT_EQ(
      (ProblemOfPorts<In<"a", ArrayView<double>>, W, S, X>()),
      "node type \"n\", attribute \"a\" (double): compute reads it as ArrayView<double>; expected double");
  EXPECT_EQ((ProblemOfPorts<A, W, S, Out<"x", Double3>>()),
            "node type \"n\", attribute \"x\" (double): compute writes it as Double3; expected double");
  EXPECT_EQ(
      (ProblemOfPorts<A, W, S, Out<"x", OutArray<double>>>()),
      "node type \"n\", attribute \"x\" (double): compute writes it as OutArray<double>; expected double");
  EXPECT_EQ((ProblemOfPorts<A, W, S, Out<"x", PointsView>>()),
            "node type \"n\", attribute \"x\" (double): compute writes it as PointsView; expected double");
  EXPECT_EQ((ProblemOfPorts<A, W, In<"side", std::int64_t>, X>()),
            "node type \"n\", attribute \"side\" (enum): compute reads it as an integer; expected the enum "
            "that it is "
            "declared with");
  EXPECT_EQ(
      (ProblemOfPorts<A, W, In<"side", Other>, X>()),
      "node type \"n\", attribute \"side\" (enum): compute reads it as an enum; expected the enum that it is "
      "declared with");
}

TEST(NodeContexts, EnumsThatDoNotCountUp) {
  EXPECT_EQ(
      ProblemOf([](NodeBuilder n) {
        n.enumeration<Hand>("side", {{"left", Hand::kLeft}, {"right", Hand::kLeft}}, false);
      }),
      "node type \"n\", attribute \"side\": its choices are not the values 0, 1, 2, ... of its enum in their "
      "order");
}

TEST(NodeContexts, DecideAndBatchReadWhatComputeReads) {
  const auto with = [](auto add) {
    return ProblemOf([&](NodeBuilder n) {
      add(n.in("a", 0.0)
              .in("b", 0.0)
              .out("x", Type::kDouble)
              .compute<Nothing<NodeContext<A, In<"b", double>, X>>>());
    });
  };
  EXPECT_EQ(with([](NodeBuilder& n) { n.decide<DecideNothing<NodeContext<A>>>(); }), "");
  EXPECT_EQ(
      with([](NodeBuilder& n) { n.decide<DecideNothing<NodeContext<In<"b", double>>>>(); }),
      "node type \"n\", attribute \"b\": decide() names it as input 1; expected a (double), as the compute "
      "before it");
  EXPECT_EQ(
      with([](NodeBuilder& n) { n.decide<DecideNothing<NodeContext<In<"a", Double3>>>>(); }),
      "node type \"n\", attribute \"a\": decide() names it as input 1; expected a (double), as the compute "
      "before it");
  using B = In<"b", double>;
  EXPECT_EQ(with([](NodeBuilder& n) { n.batch<Nothing<NodeBatch<A, B, X>>>(nullptr); }), "");
  EXPECT_EQ(with([](NodeBuilder& n) { n.batch<Nothing<NodeBatch<A, B, In<"c", double>, X>>>(nullptr); }),
            "node type \"n\", attribute \"c\": batch() names it as input 3; expected no more of them, as the "
            "compute "
            "before it");
}

// A context of two doubles and an output, without a graph.
struct Table {
  std::array<double, 3> slots = {2, 3, 0};
  std::array<std::uint32_t, 2> in = {0, 8};
  std::array<std::uint32_t, 1> out = {16};
  ComputeContext context;
  Table() {
    context.values = reinterpret_cast<std::byte*>(slots.data());
    context.in = in.data();
    context.out = out.data();
  }
};

void MultiplyByNumber(ComputeContext& c) { c.out_value<double>(0) = c.get<double>(0) * c.get<double>(1); }
void MultiplyByName(NodeContext<A, In<"b", double>, X> c) { c.out<"x">() = c.get<"a">() * c.get<"b">(); }

TEST(InstructionCount, OfANameIsThatOfANumber) {
  NodeRegistry registry;
  registry.add("number", "").in("a", 0.0).in("b", 0.0).out("x", Type::kDouble).compute(&MultiplyByNumber);
  registry.add("name", "").in("a", 0.0).in("b", 0.0).out("x", Type::kDouble).compute<MultiplyByName>();
  ASSERT_TRUE(registry.status().ok()) << registry.status().ToString();
  Table table;
  const auto count = [&](const char* type) {
    const ComputeFn compute = registry.Find(type)->groups[0].compute;
    return CountInstructions([&] { compute(table.context); });
  };
  const auto by_number = count("number"), by_name = count("name");
  EXPECT_EQ(table.slots[2], 6);
  if (!by_number.has_value()) GTEST_SKIP() << "instructions cannot be counted here";
#ifdef __OPTIMIZE__
  EXPECT_LE(*by_name, *by_number);
#else
  GTEST_SKIP() << "calls are not inlined here";
#endif
}

}  // namespace
}  // namespace kpsa::engine
