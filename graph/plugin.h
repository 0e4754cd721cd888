// What a library of nodes includes to be loaded by `plugins:` in a rig or by --plugin. It links nothing: what
// it uses of base/ and graph/ is in the program that loads it.
//
//   #include "graph/plugin.h"
//
//   KPSA_PLUGIN(registry) {
//     registry.add("twice", "Two times a value.").in("input", 0.0).out("output", kpsa::Type::kDouble)
//         .compute([](double input) { return 2 * input; });
//   }
//
// Compile it as C++20 with the project's root among the include directories, as a shared library, by the
// compiler (its C++ ABI, that is) that the program was built with. A name that some other node type has is
// refused, and then none of the library's types are there. A loaded library stays until the program ends.
#pragma once

#include "graph/node_registry.h"

namespace kpsa::engine {

// Of the declarations that this header includes: raised whenever one of them changes its layout or meaning.
// Libraries of another version are refused.
inline constexpr int kPluginAbi = 8;

}  // namespace kpsa::engine

// The words of node authors; those of the public face (include/kpsa) are others.
namespace kpsa {
using engine::ArrayView, engine::AttributeOptions, engine::Binding, engine::BoundKernel, engine::Choice,
    engine::ComputeContext, engine::ConstPointsView, engine::Demand, engine::Double3, engine::In, engine::Matrix4,
    engine::NodeBuilder, engine::NodeContext, engine::NodeRegistry, engine::Out, engine::OutArray, engine::PointSet,
    engine::PointsView, engine::Quaternion, engine::Structural, engine::Type, engine::Unit, engine::Value;
}  // namespace kpsa

// Begins the function that adds the library's node types to `registry`, and exports it with its ABI version.
#define KPSA_PLUGIN(registry)                                                                            \
  extern "C" __attribute__((visibility("default"))) int kpsa_plugin_abi() { return ::kpsa::engine::kPluginAbi; } \
  extern "C" __attribute__((visibility("default"))) void kpsa_register(::kpsa::NodeRegistry& registry)
