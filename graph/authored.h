// Calls of what a node's author wrote for the compiler (demand, bind, ...), and what becomes of mistakes in it: errors
// that name the node.
#pragma once

#include <exception>
#include <stdexcept>
#include <utility>

#include "base/cancel.h"
#include "base/thrown.h"
#include "graph/node_binding.h"

namespace kpsa::engine {

// What the engine throws where such a function asks it for what there is not: the call below says of which node.
template <typename... Args>
[[noreturn]] void ThrowMisuse(fmt::format_string<Args...> format, Args&&... args) {
  throw std::logic_error(fmt::format(format, std::forward<Args>(args)...));
}

// An error of a node on its way to whoever compiles.
struct NodeFailure : std::exception {
  explicit NodeFailure(Status what) : status(std::move(what)) {}
  Status status;
};

// What `function` gives; whatever it throws goes on as a NodeFailure.
template <typename F>
auto CallAuthored(const InstanceTable& table, NodeId node, F&& function) {
  try {
    return function();
  } catch (const NodeFailure&) {  // of another node that it asked for
    throw;
  } catch (const Cancelled&) {
    throw;
  } catch (...) {
    throw NodeFailure(Status::Invalid("node \"{}\" ({}): {}", table.graph().name(node),
                                      table.graph().def(node).name, ThrownText())
                          .OfNode(table.graph().name(node)));
  }
}

}  // namespace kpsa::engine
