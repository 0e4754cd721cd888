// A trained rig end to end: what must hold of the KPSA node in a graph (tolerance 0, infinity, order of
// frames, staleness, tripwire). On the bundled hello rig, which trains in a second.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "graph/evaluator.h"
#include "host/rig_training.h"
#include "kpsa/kpsa_node.h"
#include "nodes/standard_nodes.h"
#include "rig/graph_editor.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

class TrainedRig : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    registry_ = new NodeRegistry;
    AddStandardNodes(*registry_);
    AddKpsaNode(*registry_);
    subspace_ = new std::shared_ptr<const Subspace>(TrainAt(5e-4));
    ASSERT_NE(*subspace_, nullptr);
  }
  static std::shared_ptr<const Subspace> TrainAt(double tolerance) {
    Rig rig = Load();
    TrainOptions options;
    options.samples = 300;
    options.calibration_poses = 100;
    options.tolerance = tolerance;
    options.violation_rate = 0.05;
    Result<Subspace> subspace = Train(MakeTrainingRig(&rig, rig.accelerate[0]), {}, options);
    EXPECT_TRUE(subspace.ok()) << subspace.status().ToString();
    return subspace.ok() ? std::make_shared<const Subspace>(std::move(*subspace)) : nullptr;
  }
  static void TearDownTestSuite() {
    delete subspace_;
    delete registry_;
  }

  static Rig Load() {
    RigOptions options;
    options.rest = true;
    Result<Rig> rig = LoadRig(*registry_, KPSA_SCENES_DIR "/hello/hello.yaml", options);
    EXPECT_TRUE(rig.ok()) << rig.status().ToString();
    return std::move(*rig);
  }

  struct Run {
    std::shared_ptr<const Plan> plan;
    std::unique_ptr<Evaluator> evaluator;
    std::unique_ptr<Profile> profile;
  };
  // The rig's points under its controls; accelerated where a tolerance is given.
  static Run Start(Rig* rig, const double* tolerance,
                   const std::shared_ptr<const Subspace>& subspace = *subspace_) {
    Request request;
    request.varying = VaryingPlugs(*rig);
    request.outputs.push_back({rig->scene.meshes[0].points, {}});
    Compiler compiler;
    if (tolerance != nullptr) {
      AccelerateOptions options;
      options.tolerance = *tolerance;
      Result<Accelerated> accelerated = Accelerate(
          rig->graph.get(), &compiler, MakeTarget(*rig, rig->accelerate[0]), subspace, "kpsa", options);
      EXPECT_TRUE(accelerated.ok()) << accelerated.status().ToString();
      const NodeDef& def = rig->graph->def(accelerated->node);
      request.outputs[0].plug = {accelerated->node, def.FindAttribute("outPoints"), 0, -1};
      request.outputs.push_back({{accelerated->node, def.FindAttribute("hit"), -1, -1}, {}});
    }
    Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig->graph, request);
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    Run run{*plan, std::make_unique<Evaluator>(*plan), std::make_unique<Profile>(**plan)};
    run.evaluator->Record(run.profile.get());
    return run;
  }
  // Frame f of a little clip on the rig's controls.
  static void Pose(const Rig& rig, int frame, Evaluator* evaluator) {
    for (std::size_t c = 0; c < rig.controls.size(); ++c) {
      const Control& control = rig.controls[c];
      const Index varying = evaluator->plan().FindVarying(control.plug);
      const double phase = 0.5 + 0.45 * std::sin(0.37 * frame + static_cast<double>(c));
      evaluator->Set(varying, control.min + phase * (control.max - control.min), control.plug.component);
    }
  }
  static std::vector<float> Points(const Evaluator& evaluator) {
    const ConstPointsView p = evaluator.Points(0);
    std::vector<float> all(p.x, p.x + p.count);
    all.insert(all.end(), p.y, p.y + p.count);
    all.insert(all.end(), p.z, p.z + p.count);
    return all;
  }
  static std::uint64_t Computes(const Run& run, const std::string& node) {
    std::uint64_t count = 0;
    for (Index s = 0; s < run.plan->steps().size(); ++s) {
      if (node == run.plan->step_name(s)) count += run.profile->counts()[s];
    }
    return count;
  }

  static NodeRegistry* registry_;
  static std::shared_ptr<const Subspace>* subspace_;
};

NodeRegistry* TrainedRig::registry_ = nullptr;
std::shared_ptr<const Subspace>* TrainedRig::subspace_ = nullptr;

TEST_F(TrainedRig, ToleranceZeroIsTheExactRigBitForBit) {
  Rig full_rig = Load(), rig = Load();
  const double zero = 0;
  Run full = Start(&full_rig, nullptr), exact = Start(&rig, &zero);
  for (int frame = 0; frame < 20; ++frame) {
    Pose(full_rig, frame, full.evaluator.get());
    Pose(rig, frame, exact.evaluator.get());
    ASSERT_TRUE(full.evaluator->Evaluate().ok());
    ASSERT_TRUE(exact.evaluator->Evaluate().ok());
    EXPECT_EQ(exact.evaluator->Get<std::int64_t>(1), 0);
    ASSERT_EQ(Points(*full.evaluator), Points(*exact.evaluator)) << frame;
  }
}

TEST_F(TrainedRig, TheNodeSaysHowLongItsPartsTakeWhereThatIsRecorded) {
  Rig rig = Load();
  const double metre = 1;
  Run run = Start(&rig, &metre);
  Pose(rig, 0, run.evaluator.get());
  ASSERT_TRUE(run.evaluator->Evaluate().ok());
  EXPECT_EQ(run.evaluator->Get<std::int64_t>(1), 1);
  const KpsaTimes times = KpsaTimesOf(*run.plan, *run.profile);
  EXPECT_GT(times.cues, 0u);
  EXPECT_GT(times.projection, 0u);
  EXPECT_GT(times.reconstruction, 0u);
  run.profile->Clear();
  run.evaluator->Record(nullptr);
  Pose(rig, 1, run.evaluator.get());
  ASSERT_TRUE(run.evaluator->Evaluate().ok());
  const KpsaTimes none = KpsaTimesOf(*run.plan, *run.profile);
  EXPECT_EQ(none.cues + none.projection + none.reconstruction, 0u);
}

TEST_F(TrainedRig, ARewriteThatFailsChangesNothing) {
  Rig rig = Load();
  Compiler compiler;
  Accelerator accelerator(rig.graph.get(), &compiler);
  const auto facts = [&] {
    std::string text;
    for (const NodeId node : rig.graph->Nodes()) {
      text += rig.graph->name(node) + ":";
      for (const Connection& c : rig.graph->Inputs(node))
        text += rig.graph->PlugName(c.source) + ">" + rig.graph->PlugName(c.destination) + " ";
    }
    return text;
  };
  const std::string before = facts();
  // The second one's name is taken by the first, when half of the work is done
  for (int i = 0; i < 2; ++i) {
    const Status added = accelerator.Add(MakeTarget(rig, rig.accelerate[0]), *subspace_, "kpsa", {});
    ASSERT_TRUE(added.ok()) << added.ToString();
  }
  EXPECT_FALSE(accelerator.Apply().ok());
  EXPECT_EQ(facts(), before);
}

TEST_F(TrainedRig, ToleranceInfiniteNeverRunsTheMush) {
  Rig full_rig = Load(), rig = Load();
  // At a tolerance at which nothing behind the mush has to be measured
  Run full = Start(&full_rig, nullptr), fast = Start(&rig, &kInfinity, TrainAt(1e-2));
  double worst = 0, moved = 0;
  for (int frame = 0; frame < 20; ++frame) {
    Pose(full_rig, frame, full.evaluator.get());
    Pose(rig, frame, fast.evaluator.get());
    ASSERT_TRUE(full.evaluator->Evaluate().ok());
    ASSERT_TRUE(fast.evaluator->Evaluate().ok());
    EXPECT_EQ(fast.evaluator->Get<std::int64_t>(1), 1) << frame;
    const std::vector<float> a = Points(*full.evaluator), b = Points(*fast.evaluator);
    for (std::size_t i = 0; i < a.size(); ++i) {
      worst = std::max(worst, std::fabs(static_cast<double>(a[i]) - b[i]));
      moved = std::max(moved, std::fabs(static_cast<double>(a[i])));
    }
  }
  EXPECT_EQ(Computes(fast, "mush"), 0u);
  EXPECT_GT(Computes(full, "mush"), 0u);
  EXPECT_LT(worst, 0.01 * moved);
}

// A pin downstream asks the node for the corners of its triangle, and the node reconstructs just these.
TEST_F(TrainedRig, PinsRideOnTheAcceleratedPoints) {
  Rig full_rig = Load(), rig = Load();
  const auto play = [&](Rig* of, bool accelerate) {
    const CharacterMesh& mesh = of->scene.meshes[0];
    GraphEditor edit(of->graph.get());
    const NodeId pin = edit.Add("uvPin", "pin");
    edit.Set(pin, "driverMesh", mesh.geometry.mesh);
    edit.Set(pin, "face", 0, Value(300));
    edit.Connect(mesh.points, edit.Plug(pin, "driverPoints"));
    const PlugRef matrix = edit.Plug(pin, "outputMatrix", 0);
    EXPECT_TRUE(edit.ok()) << edit.Take().ToString();
    Compiler compiler;
    if (accelerate) {
      AccelerateOptions options;
      options.tolerance = kInfinity;
      EXPECT_TRUE(Accelerate(of->graph.get(), &compiler, MakeTarget(*of, of->accelerate[0]), *subspace_,
                             "kpsa", options)
                      .ok());
    }
    Request request;
    request.varying = VaryingPlugs(*of);
    request.outputs.push_back({matrix, {}});
    Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*of->graph, request);
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    Run run{*plan, std::make_unique<Evaluator>(*plan), std::make_unique<Profile>(**plan)};
    run.evaluator->Record(run.profile.get());
    return run;
  };
  Run full = play(&full_rig, false), fast = play(&rig, true);
  double moved = 0, rest = 0;
  for (int frame = 0; frame < 10; ++frame) {
    Pose(full_rig, frame, full.evaluator.get());
    Pose(rig, frame, fast.evaluator.get());
    ASSERT_TRUE(full.evaluator->Evaluate().ok());
    ASSERT_TRUE(fast.evaluator->Evaluate().ok());
    const Matrix4 a = full.evaluator->Get<Matrix4>(0), b = fast.evaluator->Get<Matrix4>(0);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(a(i, 3), b(i, 3), 2e-3) << frame;
    if (frame == 0) rest = a(0, 3);
    moved = std::max(moved, std::fabs(a(0, 3) - rest));
  }
  EXPECT_GT(moved, 5e-3);
  Index node_points = 0;
  for (Index s = 0; s < fast.plan->steps().size(); ++s) {
    if (std::string("kpsa") == fast.plan->step_name(s))
      node_points = std::max(node_points, fast.plan->infos()[s].points);
  }
  EXPECT_GE(node_points, 3u);
  EXPECT_LT(node_points, rig.scene.meshes[0].mesh().point_count() / 4);
}

TEST_F(TrainedRig, FramesDoNotDependOnTheirOrder) {
  Rig a = Load(), b = Load();
  const double tolerance = 5e-4;
  Run forward = Start(&a, &tolerance), backward = Start(&b, &tolerance);
  std::vector<std::vector<float>> frames;
  std::int64_t hits = 0;
  for (int frame = 0; frame < 30; ++frame) {
    Pose(a, frame, forward.evaluator.get());
    ASSERT_TRUE(forward.evaluator->Evaluate().ok());
    hits += forward.evaluator->Get<std::int64_t>(1);
    frames.push_back(Points(*forward.evaluator));
  }
  for (int frame = 29; frame >= 0; --frame) {
    Pose(b, frame, backward.evaluator.get());
    ASSERT_TRUE(backward.evaluator->Evaluate().ok());
    ASSERT_EQ(frames[static_cast<std::size_t>(frame)], Points(*backward.evaluator)) << frame;
  }
  EXPECT_GT(hits, 5);
}

TEST_F(TrainedRig, ControlsOutsideTheirTrainedRangeMiss) {
  Rig rig = Load();
  const double own = -1;
  Run run = Start(&rig, &own, WithGuardsOnly(**subspace_));
  Pose(rig, 0, run.evaluator.get());
  ASSERT_TRUE(run.evaluator->Evaluate().ok());
  EXPECT_EQ(run.evaluator->Get<std::int64_t>(1), 1);
  const Control& control = rig.controls[0];
  run.evaluator->Set(run.plan->FindVarying(control.plug), 3 * control.max, control.plug.component);
  ASSERT_TRUE(run.evaluator->Evaluate().ok());
  EXPECT_EQ(run.evaluator->Get<std::int64_t>(1), 0);
}

TEST_F(TrainedRig, AChangedRigIsRefusedByName) {
  Rig rig = Load();
  ASSERT_TRUE(rig.graph->Set(*rig.graph->FindPlug("mush.iterations"), 12).ok());
  Compiler compiler;
  const AccelerationTarget target = MakeTarget(rig, rig.accelerate[0]);
  const Result<Accelerated> refused = Accelerate(rig.graph.get(), &compiler, target, *subspace_, "kpsa", {});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.status().ToString().find("mush.iterations"), std::string::npos)
      << refused.status().ToString();
  AccelerateOptions options;
  options.stale_is_miss = true;
  EXPECT_TRUE(Accelerate(rig.graph.get(), &compiler, target, *subspace_, "kpsa", options).ok());
}

}  // namespace
}  // namespace kpsa::engine
