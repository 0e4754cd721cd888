#include "kpsa/kpsa_node.h"

#include <gtest/gtest.h>

#include "graph/node_registry.h"

namespace kpsa::engine {
namespace {

TEST(KpsaNode, NamesWhatItReadsAndWrites) {
  NodeRegistry registry;
  AddKpsaNode(registry);
  ASSERT_TRUE(registry.status().ok()) << registry.status().ToString();
  for (const char* type : {"kpsa", "spaceOffset", "offsetMatrix"}) {
    const NodeDef* def = registry.Find(type);
    ASSERT_NE(def, nullptr) << type;
    for (const ComputeGroup& group : def->groups) EXPECT_TRUE(group.named) << type;
  }
}

}  // namespace
}  // namespace kpsa::engine
