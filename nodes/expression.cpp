// expression: a formula over inputs, compiled when it is bound.
#include "nodes/kernels/expression.h"

#include <utility>

#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

struct ExpressionKernel {
  Expression program;
  std::size_t inputs;
};

Result<BoundKernel> BindExpression(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto inputs = static_cast<std::size_t>(s.array_size("input"));
  Result<Expression> program = Expression::Compile(s.value("expression").get<std::string>(), inputs);
  if (!program.ok()) return program.status();
  const std::size_t doubles = inputs + program->stack_size();
  return MakeBound(ExpressionKernel{std::move(*program), inputs}, doubles * sizeof(double) / sizeof(float));
}

void ComputeExpression(NodeContext<In<"input", ArrayView<double>>, Out<"output", double>> c) {
  const auto& kernel = c.kernel_as<ExpressionKernel>();
  const ArrayView<double> input = c.get<"input">();
  auto* values = reinterpret_cast<double*>(c.scratch());
  for (std::uint32_t i = 0; i < kernel.inputs; ++i) values[i] = input[i];
  c.out<"output">() =
      kernel.program.Run({values, kernel.inputs}, {values + kernel.inputs, kernel.program.stack_size()});
}

}  // namespace

KPSA_NODES(expression, registry) {
  registry
      .add("expression",
           "A formula. Operators + - * / ^, comparisons, &&, ||, a ? b : c; functions sin cos tan asin acos "
           "atan atan2 sqrt exp log pow abs floor ceil round sign fmod min max clamp(x, lo, hi) linstep and "
           "smoothstep(lo, hi, x), in radians; pi and e.")
      .in("input", 0.0, {.doc = "input[0] is in0 in the formula, input[1] is in1, ..."})
      .array()
      .structural("expression", "0", {.doc = "as in \"max(in0, 0) * 0.5 + sin(in1)\""})
      .out("output", Type::kDouble)
      .compute<ComputeExpression>()
      .bind(BindExpression)
      .cost(100, 0);
}

}  // namespace kpsa::engine
