// A library of nodes, as somebody else would write it.
#include <cmath>

#include "graph/plugin.h"

KPSA_PLUGIN(registry) {
  registry.add("wobble", "A triangle wave.")
      .in("input", 0.0, {.unit = kpsa::Unit::kTime})
      .in("period", 1.0, {.min = 1e-6, .unit = kpsa::Unit::kTime})
      .in("amplitude", 1.0)
      .out("output", kpsa::Type::kDouble)
      .compute([](double t, double period, double a) {
        const double x = t / period - std::floor(t / period);
        return a * (x < 0.5 ? 4 * x - 1 : 3 - 4 * x);
      });
}
