// The rigs with a production's stack: they are valid without a word, each deformer does something, and some
// points are the same bits as all of them.
#include <algorithm>
#include <cstring>
#include <random>

#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

class Production : public ::testing::TestWithParam<const char*> {
 protected:
  std::string path() const { return std::string(KPSA_SCENES_DIR "/") + GetParam(); }
  // With the controls at a pose, or at rest.
  static std::unique_ptr<Evaluator> Evaluated(const Rig& rig, Compiler* compiler,
                                              std::vector<RequestedOutput> outputs,
                                              const std::vector<double>* pose) {
    Result<std::shared_ptr<const Plan>> plan =
        compiler->Compile(*rig.graph, {std::move(outputs), VaryingPlugs(rig)});
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    auto evaluator = std::make_unique<Evaluator>(*plan);
    for (std::size_t c = 0; pose != nullptr && c < rig.controls.size(); ++c) {
      const PlugRef& plug = rig.controls[c].plug;
      const Index varying = (*plan)->FindVarying(plug);
      if (varying == kNoIndex) continue;
      evaluator->Set(varying, (*pose)[c],
                     (*plan)->varying()[varying].type == Type::kDouble3 ? plug.component : -1);
    }
    EXPECT_TRUE(evaluator->Evaluate().ok());
    return evaluator;
  }
};

TEST_P(Production, IsValidWithoutAWord) {
  const ProcessResult result = RunKpsa({"validate", path()});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_NE(result.out.find("fine"), std::string::npos) << result.out;
}

// Every stage moves points, and those of a subset by the same bits.
TEST_P(Production, SomePointsHaveTheBitsOfAll) {
  RigOptions rest;
  rest.rest = true;
  Result<Rig> rig = LoadRig(AcceleratedRegistry(), path(), rest);
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  EXPECT_TRUE(rig->notes.empty());
  const std::vector<double> pose = SmoothPoses(*rig, 2, 0.8)[1];
  const auto& mesh = rig->scene.meshes[0];
  const auto total = static_cast<Index>(mesh.mesh().point_count());
  std::vector<Index> some(total);
  for (Index i = 0; i < total; ++i) some[i] = i;
  std::shuffle(some.begin(), some.end(), std::mt19937(7));
  some.resize(33);
  std::sort(some.begin(), some.end());
  Compiler compiler;
  const auto start = [&](const std::vector<PointSet>& sets, bool posed) {
    std::vector<RequestedOutput> outputs;
    for (const Stage& stage : mesh.stages) {
      for (const PointSet& set : sets) outputs.push_back({stage.points, set});
    }
    return Evaluated(*rig, &compiler, std::move(outputs), posed ? &pose : nullptr);
  };
  const auto whole = start({PointSet()}, true), part = start({PointSet::Of(some, total)}, true);
  const auto still = start({PointSet()}, false);
  for (std::size_t s = 0; s < mesh.stages.size(); ++s) {
    SCOPED_TRACE(mesh.stages[s].name);
    const ConstPointsView all = whole->Points(s), few = part->Points(s), resting = still->Points(s);
    ASSERT_EQ(few.count, some.size());
    for (std::size_t i = 0; i < some.size(); ++i) {
      EXPECT_EQ(all.x[some[i]], few.x[i]);
      EXPECT_EQ(all.y[some[i]], few.y[i]);
      EXPECT_EQ(all.z[some[i]], few.z[i]);
    }
    if (s == 0) continue;
    const ConstPointsView before = whole->Points(s - 1), resting_before = still->Points(s - 1);
    double moved = 0, moved_at_rest = 0;
    for (std::size_t i = 0; i < all.count; ++i) {
      moved = std::max(moved, double{std::abs(all.y[i] - before.y[i]) + std::abs(all.z[i] - before.z[i])});
      moved_at_rest = std::max(moved_at_rest, double{std::abs(resting.y[i] - resting_before.y[i])});
    }
    EXPECT_GT(moved, 1e-5);
    EXPECT_LT(moved_at_rest, 1e-5);
  }
}

// Deformers that touch none of a request's points are left out of its plan: of one point most are.
TEST_P(Production, OnePointHasTheBitsOfAll) {
  RigOptions rest;
  rest.rest = true;
  Result<Rig> rig = LoadRig(AcceleratedRegistry(), path(), rest);
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  const std::vector<double> pose = SmoothPoses(*rig, 2, 0.8)[1];
  const PlugRef last = rig->scene.meshes[0].stages.back().points;
  const auto total = static_cast<Index>(rig->scene.meshes[0].mesh().point_count());
  Compiler compiler;
  const auto evaluate = [&](const PointSet& set) { return Evaluated(*rig, &compiler, {{last, set}}, &pose); };
  const auto all = evaluate({});
  const std::size_t all_steps = all->plan().steps().size();
  std::size_t least_steps = all_steps;
  for (Index point = 0; point < total; point += total / 60) {
    const auto one = evaluate(PointSet::Of({point}, total));
    least_steps = std::min(least_steps, one->plan().steps().size());
    const float* const wanted[] = {all->Points(0).x, all->Points(0).y, all->Points(0).z};
    const float* const got[] = {one->Points(0).x, one->Points(0).y, one->Points(0).z};
    for (int k = 0; k < 3; ++k) EXPECT_EQ(std::memcmp(wanted[k] + point, got[k], sizeof(float)), 0) << point;
  }
  EXPECT_LT(least_steps, all_steps / 2);
}

// Hidden cages are nobody's output, unless a rig accelerates them.
TEST(HiddenMeshes, AreShownWhereTheyAreAccelerated) {
  const TemporaryFolder folder;
  folder.Write("boy.glb", TemporaryFolder::Read(KPSA_SCENES_DIR "/boy/boy.glb"));
  const auto shown = [&](const std::string& more) {
    const std::string rig = "kpsa: 1\ncharacter: boy.glb\n" + more;
    Result<Rig> loaded = LoadRig(AcceleratedRegistry(), folder.Write("rig.yaml", rig), {});
    EXPECT_TRUE(loaded.ok()) << loaded.status().ToString();
    std::vector<std::string> names;
    for (const std::size_t m : ShownMeshes(loaded->scene)) names.push_back(loaded->scene.meshes[m].name);
    return names;
  };
  EXPECT_EQ(shown(""), (std::vector<std::string>{"face_mesh", "eyes"}));
  EXPECT_EQ(shown("accelerate: {a: {points: [clay@skin], subspace: a.kpsa}}\n"),
            (std::vector<std::string>{"face_mesh", "eyes", "clay"}));

  ASSERT_EQ(RunKpsa({"init", folder / "boy.glb", "-o", folder / "init.yaml"}).exit_code, 0);
  const std::string text = TemporaryFolder::Read(folder / "init.yaml");
  EXPECT_NE(text.find("- meshes: [face_mesh, eyes]\n"), std::string::npos) << text;
  EXPECT_NE(text.find("points: [face_mesh@mush, eyes@mush]"), std::string::npos) << text;
  EXPECT_EQ(text.find("clay"), std::string::npos) << text;
}

INSTANTIATE_TEST_SUITE_P(Rigs, Production,
                         ::testing::Values("boy/boy.yaml", "boy/boy_heavy.yaml", "animal/animal.yaml",
                                           "animal/animal_heavy.yaml"));

}  // namespace
}  // namespace kpsa::engine
