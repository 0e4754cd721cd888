#include <algorithm>

#include "nodes/kernels/power.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

double Remap(double value, double in_min, double in_max, double out_min, double out_max) {
  if (in_max == in_min) return out_min;
  const double t = std::clamp((value - in_min) / (in_max - in_min), 0.0, 1.0);
  return out_min + t * (out_max - out_min);
}

enum class Operation { kNone, kMultiply, kDivide, kPower };

Double3 MultiplyDivide(Double3 a, Double3 b, Operation operation) {
  Double3 out = a;
  for (int i = 0; i < 3; ++i) {
    if (operation == Operation::kMultiply) out[i] = a[i] * b[i];
    if (operation == Operation::kDivide) out[i] = b[i] == 0 ? 0 : a[i] / b[i];
    if (operation == Operation::kPower) out[i] = Power(a[i], b[i]);
  }
  return out;
}

enum class SumOperation { kNone, kSum, kSubtract, kAverage };

double PlusMinusAverage(ArrayView<double> input, SumOperation operation) {
  if (input.size() == 0) return 0;
  double sum = input[0];
  if (operation == SumOperation::kNone) return sum;
  for (std::uint32_t i = 1; i < input.size(); ++i)
    sum += operation == SumOperation::kSubtract ? -input[i] : input[i];
  return operation == SumOperation::kAverage ? sum / input.size() : sum;
}

}  // namespace

KPSA_NODES(math_nodes, registry) {
  registry.add("remapValue", "Maps a value from one range to another, clamped to it.")
      .in("inputValue", 0.0)
      .alias("input")
      .in("inputMin", 0.0)
      .in("inputMax", 1.0)
      .in("outputMin", 0.0)
      .in("outputMax", 1.0)
      .out("outValue", Type::kDouble)
      .compute([](double value, double in_min, double in_max, double out_min, double out_max) {
        return Remap(value, in_min, in_max, out_min, out_max);
      });
  registry
      .add("multiplyDivide",
           "Multiplies, divides or raises to a power, component by component. Dividing by 0 gives 0.")
      .in("input1", Double3())
      .in("input2", Double3{1, 1, 1})
      .enumeration<Operation>("operation",
                              {{"noOperation", Operation::kNone},
                               {"multiply", Operation::kMultiply},
                               {"divide", Operation::kDivide},
                               {"power", Operation::kPower}},
                              false, {}, Operation::kMultiply)
      .out("output", Type::kDouble3)
      .compute([](Double3 a, Double3 b, Operation operation) { return MultiplyDivide(a, b, operation); });
  registry.add("plusMinusAverage", "Adds, subtracts from the first, or averages any number of inputs.")
      .in("input", 0.0)
      .array()
      .alias("input1D")
      .enumeration<SumOperation>("operation",
                                 {{"noOperation", SumOperation::kNone},
                                  {"sum", SumOperation::kSum},
                                  {"subtract", SumOperation::kSubtract},
                                  {"average", SumOperation::kAverage}},
                                 false, {}, SumOperation::kSum)
      .out("output", Type::kDouble)
      .alias("output1D")
      .compute(
          [](ArrayView<double> input, SumOperation operation) { return PlusMinusAverage(input, operation); });
  registry
      .add("unitConversion", "Multiplies by a fixed factor: between the runtime's units and a rig file's.")
      .in("input", 0.0)
      .in("conversionFactor", 1.0)
      .out("output", Type::kDouble)
      .compute([](double input, double factor) { return input * factor; });
}

}  // namespace kpsa::engine
