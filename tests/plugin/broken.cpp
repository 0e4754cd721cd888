// Libraries that must be refused, one a KPSA_BROKEN_...
#include <cstdlib>
#include <stdexcept>

#include "graph/plugin.h"

[[maybe_unused]] static void AddOne(kpsa::NodeRegistry& registry, const char* name) {
  registry.add(name, "Half a value.")
      .in("input", 0.0)
      .out("output", kpsa::Type::kDouble)
      .compute([](double x) { return x / 2; });
}

#if defined(KPSA_BROKEN_silent)
extern "C" int nothing_that_kpsa_knows() { return 0; }
#elif defined(KPSA_BROKEN_mute)
extern "C" int kpsa_plugin_abi() { return kpsa::engine::kPluginAbi; }
#elif defined(KPSA_BROKEN_deadly)
[[maybe_unused]] static const bool loaded = (std::_Exit(77), true);
#elif defined(KPSA_BROKEN_old)
extern "C" int kpsa_plugin_abi() { return kpsa::engine::kPluginAbi - 1; }
extern "C" void kpsa_register(kpsa::NodeRegistry&) {}
#elif defined(KPSA_BROKEN_unresolved)
extern "C" int a_function_that_nobody_has();
extern "C" int kpsa_plugin_abi() { return a_function_that_nobody_has(); }
extern "C" void kpsa_register(kpsa::NodeRegistry&) {}
#else
KPSA_PLUGIN(registry) {
  AddOne(registry, "fine");
#if defined(KPSA_BROKEN_twice)
  AddOne(registry, "half");
  AddOne(registry, "half");
#elif defined(KPSA_BROKEN_taken)
  AddOne(registry, "transform");
#elif defined(KPSA_BROKEN_rival)
  AddOne(registry, "wobble");
#elif defined(KPSA_BROKEN_nameless)
  AddOne(registry, "");
#elif defined(KPSA_BROKEN_mistyped)
  registry.add("three", "Reads one value more than there are.")
      .in("a", 0.0)
      .in("b", 0.0)
      .out("output", kpsa::Type::kDouble)
      .compute([](double a, double b, double c) { return static_cast<int>(a + b + c); });
#elif defined(KPSA_BROKEN_explosive)  // nothing that can be seen before it runs
  registry.add("fuse", "Passes what is at most 1.")
      .in("input", 0.0, {.unit = kpsa::Unit::kTime})
      .out("output", kpsa::Type::kDouble)
      .compute([](double x) {
        if (x > 1) throw std::runtime_error("the fuse has blown");
        return x;
      });
#elif defined(KPSA_BROKEN_throwing)
  throw std::runtime_error("no licence found");
#endif
}
#endif
