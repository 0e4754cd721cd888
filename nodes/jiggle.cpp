// jiggle: points lag behind and swing. Stateful: frames in ascending order, on one evaluator.
#include "nodes/kernels/jiggle.h"

#include <fmt/format.h>

#include <utility>

#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using JiggleContext = DeformerContext<In<"time", double>, In<"stiffness", double>, In<"damping", double>,
                                      In<"jiggleWeight", double>>;

Result<BoundKernel> BindJiggle(const Binding& binding) {
  JiggleKernel kernel(binding.structural().get_double("stepsPerSecond"),
                      binding.output("outPoints").ToVector(), BoundWeights(binding));
  const std::size_t state = kernel.StateBytes();
  return MakeBound(std::move(kernel), 0, state);
}

void ComputeJiggle(JiggleContext c) {
  const auto& kernel = c.kernel_as<JiggleKernel>();
  const double time = c.get<"time">();
  const Parallel parallel = HostParallel(c);
  const JiggleKernel::Inputs inputs{time, c.get<"stiffness">(), c.get<"damping">(),
                                    c.get<"envelope">() * c.get<"jiggleWeight">()};
  switch (kernel.Run(inputs, c.get<"inPoints">(), c.out<"outPoints">(), c.state(), &parallel)) {
    case JiggleKernel::Outcome::kAdvanced:
      break;
    case JiggleKernel::Outcome::kBackwards:
      c.Fail(
          fmt::format("it remembers its previous frame and cannot go back to {} s after {} s: evaluate "
                      "frames in ascending "
                      "order, from the first one on",
                      time, kernel.StateTime(c.state())));
      break;
    case JiggleKernel::Outcome::kNoTime:
      c.Fail(fmt::format("its time is {} s", time));
      break;
  }
}

void DeclareJiggle(NodeBuilder& b) {
  b.in("time", 0.0, {.unit = Unit::kTime, .doc = "the scene's time, unless it is connected to another one"});
  b.in("stiffness", 0.5, {.min = 0, .max = 1, .doc = "how much of the way back a step's pull is"});
  b.in("damping", 0.5, {.min = 0, .max = 1, .doc = "how much of its speed a point loses in a step"});
  b.in("jiggleWeight", 1.0, {.min = 0, .max = 1, .doc = "how much of the lag shows"});
  b.structural("stepsPerSecond", 24.0,
               {.min = 1, .max = 1000, .doc = "of the simulation; times are rounded to its steps"});
}

}  // namespace

KPSA_NODES(jiggle, registry) {
  AddDeformer<ComputeJiggle>(
      registry,
      {.name = "jiggle",
       .doc = "Points lag behind and swing. It remembers the previous frame: frames are evaluated in "
              "ascending order on one thread at a time, and points after it cannot be accelerated.",
       .own = DeclareJiggle,
       .bind = BindJiggle})
      .stateful()
      .cost(200, 12);
}

}  // namespace kpsa::engine
