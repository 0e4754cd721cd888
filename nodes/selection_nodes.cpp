// condition and choice: only the chosen side is evaluated.
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

enum class Comparison { kEqual, kNotEqual, kGreaterThan, kGreaterOrEqual, kLessThan, kLessOrEqual };

bool Holds(double a, double b, Comparison operation) {
  switch (operation) {
    case Comparison::kEqual:
      return a == b;
    case Comparison::kNotEqual:
      return a != b;
    case Comparison::kGreaterThan:
      return a > b;
    case Comparison::kGreaterOrEqual:
      return a >= b;
    case Comparison::kLessThan:
      return a < b;
    case Comparison::kLessOrEqual:
      break;
  }
  return a <= b;
}

using ConditionInputs =
    NodeContext<In<"firstTerm", double>, In<"secondTerm", double>, In<"operation", Comparison>>;
using ConditionContext =
    NodeContext<In<"firstTerm", double>, In<"secondTerm", double>, In<"operation", Comparison>,
                In<"colorIfTrue", Double3>, In<"colorIfFalse", Double3>, Out<"outColor", Double3>>;

bool Holds(ConditionInputs c) {
  return Holds(c.get<"firstTerm">(), c.get<"secondTerm">(), c.get<"operation">());
}

void ComputeCondition(ConditionContext c) {
  c.out<"outColor">() = Holds(c) ? c.get<"colorIfTrue">() : c.get<"colorIfFalse">();
}

std::uint64_t DecideCondition(ConditionInputs c) { return Holds(c) ? 1 : 2; }

using ChoiceContext =
    NodeContext<In<"selector", std::int64_t>, In<"input", ArrayView<double>>, Out<"output", double>>;

void ComputeChoice(ChoiceContext c) {
  const ArrayView<double> input = c.get<"input">();
  c.out<"output">() = input.size() == 0 ? 0.0 : input[static_cast<std::uint32_t>(c.get<"selector">())];
}

std::uint64_t DecideChoice(ChoiceContext c) {
  const std::int64_t selector = c.get<"selector">();
  const auto count = static_cast<std::int64_t>(c.get<"input">().size());
  if (count == 0) return 0;
  if (selector < 0 || selector >= count) {
    c.Fail("selector is not the number of an input");
    return 0;
  }
  return std::uint64_t{1} << selector;
}

}  // namespace

KPSA_NODES(selection_nodes, registry) {
  registry.add("condition", "One of two values, by a comparison. The other side is not evaluated.")
      .category("selection")
      .in("firstTerm", 0.0)
      .in("secondTerm", 0.0)
      .enumeration<Comparison>("operation",
                               {{"equal", Comparison::kEqual},
                                {"notEqual", Comparison::kNotEqual},
                                {"greaterThan", Comparison::kGreaterThan},
                                {"greaterOrEqual", Comparison::kGreaterOrEqual},
                                {"lessThan", Comparison::kLessThan},
                                {"lessOrEqual", Comparison::kLessOrEqual}},
                               false)
      .in("colorIfTrue", Double3())
      .lazy()
      .in("colorIfFalse", Double3{1, 1, 1})
      .lazy()
      .out("outColor", Type::kDouble3)
      .compute<ComputeCondition>()
      .decide<DecideCondition>();
  registry.add("choice", "One of many values, by its number. The others are not evaluated.")
      .category("selection")
      .in("selector", 0)
      .in("input", 0.0)
      .array()
      .lazy()
      .out("output", Type::kDouble)
      .compute<ComputeChoice>()
      .decide<DecideChoice>();
}

}  // namespace kpsa::engine
