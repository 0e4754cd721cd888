// condition and choice: only the chosen side is evaluated.
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

bool Holds(double a, double b, std::int64_t operation) {
  switch (operation) {
    case 0:
      return a == b;
    case 1:
      return a != b;
    case 2:
      return a > b;
    case 3:
      return a >= b;
    case 4:
      return a < b;
    default:
      return a <= b;
  }
}

bool Holds(const ComputeContext& c) {
  return Holds(c.get<double>(0), c.get<double>(1), c.get<std::int64_t>(2));
}

std::uint64_t DecideChoice(ComputeContext& c) {
  const std::int64_t selector = c.get<std::int64_t>(0);
  const auto count = static_cast<std::int64_t>(c.array<double>(1).size());
  if (count == 0) return 0;
  if (selector < 0 || selector >= count) {
    c.host->Fail("selector is not the number of an input");
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
      .enumeration("operation",
                   {"equal", "notEqual", "greaterThan", "greaterOrEqual", "lessThan", "lessOrEqual"}, false)
      .in("colorIfTrue", Double3())
      .lazy()
      .in("colorIfFalse", Double3{1, 1, 1})
      .lazy()
      .out("outColor", Type::kDouble3)
      .compute([](ComputeContext& c) { c.out_value<Double3>(0) = c.get<Double3>(Holds(c) ? 3 : 4); })
      .decide([](ComputeContext& c) -> std::uint64_t { return Holds(c) ? 1 : 2; });
  registry.add("choice", "One of many values, by its number. The others are not evaluated.")
      .category("selection")
      .in("selector", 0)
      .in("input", 0.0)
      .array()
      .lazy()
      .out("output", Type::kDouble)
      .compute([](ComputeContext& c) {
        const ArrayView<double> input = c.array<double>(1);
        c.out_value<double>(0) =
            input.size() == 0 ? 0.0 : input[static_cast<std::uint32_t>(c.get<std::int64_t>(0))];
      })
      .decide(&DecideChoice);
}

}  // namespace kpsa::engine
