// The default graph of every asset, compiled and evaluated, against frames that independent programs
// computed.
#include <algorithm>
#include <filesystem>

#include "files/npz.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "tests/rig/rig_fixture.h"
#include "tests/support/expected_files.h"

namespace kpsa::engine {
namespace {

constexpr double kTolerance = 1e-5;  // of the diagonal, as for `kpsa eval`
constexpr std::size_t kMaxFrames = 25;

struct Frames {
  std::vector<double> times;
  std::map<std::string, std::vector<double>> arrays;
  double diagonal = 0;
};

Frames ReadFrames(const std::string& path) {
  Frames frames;
  Result<Npz> npz = ReadNpz(path);
  EXPECT_TRUE(npz.ok()) << npz.status().ToString();
  if (!npz.ok()) return frames;
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
  for (const NpzArray& array : npz->arrays) {
    std::vector<double> values = array.Doubles();
    if (array.name == "times") {
      frames.times = std::move(values);
      continue;
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % 3] = std::min(low[i % 3], values[i]);
      high[i % 3] = std::max(high[i % 3], values[i]);
    }
    frames.arrays[array.name] = std::move(values);
  }
  frames.diagonal = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  return frames;
}

void CompareFile(Compiler* compiler, Rig* rig, const ExpectedFile& file) {
  const Frames expected = ReadFrames(file.path);
  ASSERT_FALSE(expected.times.empty());
  const Status set = file.clip == "rest" ? SetClip(rig, std::nullopt) : SetClip(rig, file.clip);
  ASSERT_TRUE(set.ok()) << set.ToString();
  Request request;
  request.varying.push_back(rig->scene.time);
  for (const CharacterMesh& mesh : rig->scene.meshes) request.outputs.push_back({mesh.points, {}});
  Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig->graph, request);
  ASSERT_TRUE(plan.ok()) << plan.status().ToString();
  Evaluator evaluator(*plan);
  const Result<PlugHandle> time = evaluator.FindVarying(*rig->graph, rig->scene.time);
  ASSERT_TRUE(time.ok()) << time.status().ToString();

  double worst = 0;
  const std::size_t step = std::max<std::size_t>(1, expected.times.size() / kMaxFrames);
  for (std::size_t t = 0; t < expected.times.size(); t += step) {
    ASSERT_TRUE(evaluator.Set(*time, expected.times[t]).ok());
    const Status status = evaluator.Evaluate();
    ASSERT_TRUE(status.ok()) << status.ToString();
    for (std::size_t m = 0; m < rig->scene.meshes.size(); ++m) {
      const CharacterMesh& mesh = rig->scene.meshes[m];
      const ConstPointsView points = evaluator.Points(static_cast<Index>(m));
      for (const OutputPrimitive& primitive : mesh.primitives) {
        const auto found = expected.arrays.find(primitive.key);
        ASSERT_NE(found, expected.arrays.end()) << primitive.key;
        ASSERT_EQ(found->second.size(), expected.times.size() * primitive.vertex_count * 3) << primitive.key;
        for (Index v = 0; v < primitive.vertex_count; ++v) {
          const Index p = mesh.mesh().data().vertex_to_point[primitive.first_vertex + v];
          const double* e = &found->second[(t * primitive.vertex_count + v) * 3];
          const double d =
              std::hypot(e[0] - static_cast<double>(points.x[p]), e[1] - static_cast<double>(points.y[p]),
                         e[2] - static_cast<double>(points.z[p]));
          worst = std::isfinite(d) ? std::max(worst, d) : 1e300;
        }
      }
    }
  }
  EXPECT_LE(worst / expected.diagonal, kTolerance);
}

TEST(CharacterExpected, EveryFileWithinTolerance) {
  const std::vector<ExpectedFile> files = ExpectedFiles();
  if (files.empty()) GTEST_SKIP() << "no expected frames beside the checkout";
  Compiler compiler;
  std::map<std::string, Rig> rigs;
  for (const ExpectedFile& file : files) {
    SCOPED_TRACE(file.path);
    if (rigs.count(file.character) == 0) {
      Result<Rig> rig = LoadRig(StandardRegistry(), file.character);
      ASSERT_TRUE(rig.ok()) << rig.status().ToString();
      rigs.emplace(file.character, std::move(*rig));
    }
    CompareFile(&compiler, &rigs.at(file.character), file);
  }
}

}  // namespace
}  // namespace kpsa::engine
