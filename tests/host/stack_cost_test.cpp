#include "host/checks/stack_cost.h"

#include <gtest/gtest.h>

namespace kpsa::engine {
namespace {

TEST(StackCost, LittleIsLittleInTimeOrInShare) {
  EXPECT_TRUE((FrameCost{10e3, 8e3, 5.6e3}.little()));
  EXPECT_NEAR((FrameCost{10e3, 8e3, 5.6e3}.saving()), 2.4e3, 1e-9);
  EXPECT_EQ((FrameCost{10e3, 4e3, 6e3}.saving()), 0);
  EXPECT_EQ((FrameCost{10e3, 4e3, 6e3}.bound()), 1);
  EXPECT_FALSE((FrameCost{100e3, 90e3, 6e3}.little()));
  EXPECT_TRUE((FrameCost{1e6, 100e3, 6e3}.little())) << "1.1x";
  StackCost cost;
  EXPECT_FALSE(cost.worth_it());
  cost.timed = {100e3, 90e3, 6e3};
  EXPECT_TRUE(cost.worth_it()) << "as of a plugin that says nothing of what it costs";
}

}  // namespace
}  // namespace kpsa::engine
