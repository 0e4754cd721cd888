// Formulas, compiled and run. The text after the last newline is not part of the formula: its bytes are the inputs.
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "nodes/kernels/expression.h"
#include "tests/fuzz/fuzzer.h"

namespace kpsa::engine {

KPSA_FUZZER(expression) {
  const std::string all = AsText(bytes);
  const std::size_t cut = std::min(all.find('\n'), all.size());
  constexpr std::size_t kInputs = 4;
  const Result<Expression> formula = Expression::Compile(all.substr(0, cut), kInputs);
  if (!formula.ok()) return RequireRefusal(formula.status());
  Reached("compiled");
  Require(formula->stack_size() <= Expression::kMaxLength + 8, "a stack larger than the formula");
  std::vector<double> inputs(kInputs, 0.75);
  for (std::size_t i = 0; i < kInputs && cut + 1 + 8 * (i + 1) <= all.size(); ++i)
    std::memcpy(&inputs[i], all.data() + cut + 1 + 8 * i, 8);
  // The same bytes whatever is left on the stack
  std::vector<double> stack(formula->stack_size(), 0), other(formula->stack_size(), -1e300);
  for (const double first : {inputs[0], 0.0, -1.5, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    inputs[0] = first;
    const double a = formula->Run(inputs, stack), b = formula->Run(inputs, other);
    Require(std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b),
            "two runs of a formula give two results");
  }
}

}  // namespace kpsa::engine
