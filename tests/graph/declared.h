// What a registry says of a declaration.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "graph/graph.h"
#include "graph/node_registry.h"

namespace kpsa::engine {

// The only problem of what `declare` says of a type "n", which no graph takes then; "" if there is none.
template <typename F>
std::string ProblemOf(F declare) {
  NodeRegistry registry;
  declare(registry.add("n", ""));
  const Status status = registry.status();
  EXPECT_LE(status.errors().size(), 1u) << status.ToString();
  EXPECT_EQ(Graph(registry).AddNode("n", "one").ok(), status.ok());
  return status.ok() ? "" : status.errors().front().message;
}

}  // namespace kpsa::engine
