#include "report/bench_tables.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

TEST(BenchTables, NestedBenchesAreRefusedBeforeTheyAreCompared) {
  const TemporaryFolder folder;
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  const std::string side =
      R"({"schema": "kpsa.bench/1", "rig": "a.yaml", "tolerance": 1e30, "frame_errors": {}, "subspace": )" +
      deep;
  const std::string path = folder.Write("b.json", side + R"(, "beside": [)" + side + "}]}");
  const Result<std::string> tables = BenchTables({{path, ""}});
  ASSERT_FALSE(tables.ok());
  EXPECT_NE(tables.status().ToString().find("nested more than"), std::string::npos);
  EXPECT_FALSE(BenchFrames({path}).ok());
}

}  // namespace
}  // namespace kpsa::engine
