// What hangs is ended, whatever else runs on the machine.
#include "tests/cli/process.h"

#include <gtest/gtest.h>

namespace kpsa::engine {
namespace {

TEST(Process, IsEndedAfterItsProcessorTime) {
  EXPECT_EQ(RunShell("while :; do :; done", 0.2, "/").exit_code, -1);
  EXPECT_EQ(RunKpsa({"nodes"}, 1e-4).exit_code, -1);
}

TEST(Process, ThatWaitsForEverIsEnded) { EXPECT_EQ(RunShell("exec sleep 600", 0.02, "/").exit_code, -1); }

TEST(Process, ThatEndsIsNot) { EXPECT_EQ(RunShell("sleep 0.1; exit 7", 0.05, "/").exit_code, 7); }

}  // namespace
}  // namespace kpsa::engine
