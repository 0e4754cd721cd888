// A tripwire is a node that fails when it is evaluated while armed. Armed behind what a subspace stands in
// for, it must never fire on a hit, and must fire on everything else. It proves what counts of evaluations
// only report.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "graph/frames.h"
#include "tests/cli/hello_folder.h"
#include "tests/cli/process.h"
#include "tests/cli/rig_run.h"

namespace kpsa::engine {
namespace {

const std::string kArmed = "tripwire: evaluated while armed";

// hello with a tripwire in its stack; the accelerated points are the last stage's.
class TripwireRig : public HelloFolder {
 public:
  TripwireRig(const std::string& stack, const std::string& last, const std::string& more_nodes = "") {
    Edit("  mush: {type: deltaMush, iterations: 10}\n",
         "  mush: {type: deltaMush, iterations: 10}\n  trip: {type: tripwire}\n" + more_nodes);
    Edit("[skin, cage, mush]", stack);
    Edit("column@mush", "column@" + last);
  }
};

RigRunOptions Armed(std::shared_ptr<const Subspace> subspace, double tolerance) {
  RigRunOptions options;
  options.subspace = std::move(subspace);
  options.accelerate.tolerance = tolerance;
  options.secret = {"trip.armed"};
  return options;
}

// Frames of the clip "wave" by which steps of the rig fail.
std::vector<std::string> Failures(RigRun* run, bool armed) {
  std::vector<std::string> failures;
  run->Set("trip.armed", armed ? 1 : 0);
  for (int f = 0; f <= 48; ++f) {
    run->SetTime(f / 24.0);
    const Status status = run->evaluator->Evaluate();
    failures.push_back(status.ok() ? "" : status.ToString());
  }
  return failures;
}

class Tripwire : public ::testing::Test {
 protected:
  static std::size_t Count(const std::vector<std::string>& failures) {
    return failures.size() - static_cast<std::size_t>(std::count(failures.begin(), failures.end(), ""));
  }
};

TEST_F(Tripwire, AtTheEndItFiresOnEverythingButHits) {
  const TripwireRig folder("[skin, cage, mush, trip]", "trip");
  // At a tolerance at which nothing behind the mush has to be measured
  TrainOptions training = QuickTraining();
  training.tolerance = 1e-2;
  const auto trained = TrainRig(folder.rig(), training);
  ASSERT_NE(trained, nullptr);
  const auto with_clip = [&](double tolerance) {
    RigRunOptions options = Armed(trained, tolerance);
    options.clip = std::string("wave");
    return options;
  };
  // The canaries: the rig itself, and the rig with tolerance 0
  RigRunOptions bare = with_clip(0);
  bare.subspace = nullptr;
  RigRun full(folder.rig(), bare), zero(folder.rig(), with_clip(0)), pure(folder.rig(), with_clip(kInfinity));
  ASSERT_TRUE(full.ok() && zero.ok() && pure.ok()) << full.error << zero.error << pure.error;
  EXPECT_EQ(Count(Failures(&full, false)), 0u);
  EXPECT_EQ(Count(Failures(&full, true)), 49u);
  const std::vector<std::string> at_zero = Failures(&zero, true);
  EXPECT_EQ(Count(at_zero), 49u);
  EXPECT_NE(at_zero[0].find(kArmed), std::string::npos) << at_zero[0];
  EXPECT_NE(at_zero[0].find("trip"), std::string::npos);

  EXPECT_EQ(Count(Failures(&pure, true)), 0u);
  EXPECT_EQ(pure.Computes("trip"), 0u);
  EXPECT_EQ(pure.Computes("mush"), 0u);

  // With a threshold among the scores: exactly the frames that are no hits
  std::vector<double> scores;
  for (int f = 0; f <= 48; ++f) {
    pure.SetTime(f / 24.0);
    scores.push_back(pure.Evaluate().score);
  }
  std::sort(scores.begin(), scores.end());
  RigRunOptions mixed = with_clip(-1);
  mixed.subspace = WithThreshold(*trained, scores[20], scores[35]);
  RigRun armed(folder.rig(), mixed), calm(folder.rig(), mixed);
  const std::vector<std::string> failures = Failures(&armed, true);
  std::size_t hits = 0;
  for (int f = 0; f <= 48; ++f) {
    calm.SetTime(f / 24.0);
    const bool hit = calm.Evaluate().hit;
    hits += hit;
    EXPECT_EQ(failures[static_cast<std::size_t>(f)].empty(), hit) << f;
  }
  EXPECT_GT(hits, 10u);
  EXPECT_LT(hits, 40u);

  // The same with blocks of frames on several threads; a failed frame does not touch its neighbours
  FrameOptions options;
  options.threads = 3;
  const Index armed_plug = armed.plan->FindVarying(*armed.rig.graph->FindPlug("trip.armed"));
  const Index time = armed.plan->FindVarying(armed.rig.scene.time);
  const Status status = EvaluateFrames(
      armed.plan, 49, options,
      [&](std::size_t f, Evaluator& evaluator) {
        evaluator.SetInt(armed_plug, 1);
        evaluator.Set(time, static_cast<double>(f) / 24.0);
      },
      [&](std::size_t f, const Evaluator& evaluator, const Status& evaluated) -> Status {
        EXPECT_EQ(evaluated.ok(), failures[f].empty()) << f;
        if (evaluated.ok()) {
          calm.SetTime(static_cast<double>(f) / 24.0);
          EXPECT_TRUE(SameBytes(armed.Frame(evaluator).points, calm.Evaluate().points)) << f;
        }
        return Status();
      });
  EXPECT_TRUE(status.ok()) << status.ToString();

  // Disarmed, the evaluator that failed goes on as if nothing had been
  armed.Set("trip.armed", 0);
  for (int f = 48; f >= 0; f -= 4) {
    armed.SetTime(f / 24.0), calm.SetTime(f / 24.0);
    EXPECT_TRUE(SameBytes(armed.Evaluate().points, calm.Evaluate().points)) << f;
  }
}

TEST_F(Tripwire, BeforeADeltaMushItFiresOnlyWhereCuesAreMeasuredBehindIt) {
  // Behind one mush and before another: cues lie before both, since they would drag half the mesh in, at a
  // tolerance for which no point behind them has to be measured
  const TripwireRig between("[skin, cage, mush, trip, late]", "late",
                            "  late: {type: deltaMush, iterations: 6}\n");
  TrainOptions training = QuickTraining();
  training.tolerance = 10e-3;
  auto trained = TrainRig(between.rig(), training);
  ASSERT_NE(trained, nullptr);
  RigRunOptions options = Armed(trained, kInfinity);
  options.clip = std::string("wave");
  RigRun run(between.rig(), options);
  ASSERT_TRUE(run.ok()) << run.error;
  EXPECT_EQ(Count(Failures(&run, true)), 0u);
  for (const char* node : {"mush", "trip", "late"}) EXPECT_EQ(run.Computes(node), 0u) << node;
  options.accelerate.tolerance = 0;
  RigRun zero(between.rig(), options);
  EXPECT_EQ(Count(Failures(&zero, true)), 49u);

  // Cues behind it evaluate it, for their own points: it sees that, too
  const TripwireRig before("[skin, cage, trip, mush]", "mush");
  trained = TrainRig(before.rig(), QuickTraining());
  ASSERT_NE(trained, nullptr);
  const bool behind = std::any_of(trained->cues.begin(), trained->cues.end(),
                                  [](const CueDescription& cue) { return cue.stage == "mush"; });
  ASSERT_TRUE(behind) << "no cue is measured behind the tripwire";
  options = Armed(trained, kInfinity);
  options.clip = std::string("wave");
  RigRun cues(before.rig(), options);
  ASSERT_TRUE(cues.ok()) << cues.error;
  EXPECT_EQ(Count(Failures(&cues, true)), 49u);
}

TEST_F(Tripwire, TheProgramReportsItAsNeverEvaluated) {
  const TripwireRig folder("[skin, cage, mush, trip]", "trip");
  const auto run = [&](const std::vector<std::string>& arguments) {
    const ProcessResult result = RunKpsa(arguments, 60, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  run({"train", "hello.yaml", "--force", "-q", "--tolerance",
       "10mm"});  // so much that nothing behind the mush is measured
  const auto never = [&](const std::string& tolerance) {
    const auto bench = nlohmann::json::parse(
        run({"bench", "hello.yaml", "--runs", "1", "--json", "-q", "--tolerance", tolerance}));
    std::vector<std::string> nodes = bench["nodes"]["never_evaluated"];
    std::sort(nodes.begin(), nodes.end());
    return nodes;
  };
  EXPECT_EQ(never("1000"), (std::vector<std::string>{"mush", "trip"})) << "points at the cage are measured";
  EXPECT_EQ(never("0"), std::vector<std::string>());
  // The canary: armed from outside, the rig itself fails
  const ProcessResult armed =
      RunKpsa({"eval", "hello.yaml", "--set", "trip.armed=true", "-o", "x.npz"}, 60, folder.path());
  EXPECT_EQ(armed.exit_code, 4) << armed.err;
  EXPECT_NE(armed.err.find(kArmed), std::string::npos) << armed.err;
}

// Where points behind the mush have to be measured, since the inside of the bend turns over there: clips of
// the rig are hits all the same, and what only passes points through does not run.
TEST_F(Tripwire, StaysAsleepWherePointsBehindTheMushAreMeasured) {
  const TripwireRig folder("[skin, cage, mush, trip]", "trip");
  const auto run = [&](const std::vector<std::string>& arguments) {
    const ProcessResult result = RunKpsa(arguments, 60, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  run({"train", "hello.yaml", "--force", "-q"});
  const auto bench = nlohmann::json::parse(run({"bench", "hello.yaml", "--runs", "1", "--json", "-q"}));
  std::vector<std::string> stages = bench["cue_stages"];
  EXPECT_TRUE(std::any_of(stages.begin(), stages.end(), [](const std::string& s) {
    return s.find("@mush") != std::string::npos;
  })) << bench["cue_stages"];
  EXPECT_GE(bench["hit_rate"], 0.9);
  EXPECT_LE(bench["violation_rate"], 0.05);
  EXPECT_EQ(bench["nodes"]["never_evaluated"], nlohmann::json::array({"trip"}));
  // Armed from outside or in the rig, it makes no subspace stale
  run({"eval", "hello.yaml", "--accelerate", "--tolerance", "1000m", "--set", "trip.armed=true", "-o",
       "armed.npz"});
  const ProcessResult exact = RunKpsa({"eval", "hello.yaml", "--accelerate", "--tolerance", "0", "--set",
                                       "trip.armed=true", "-o", "exact.npz"},
                                      60, folder.path());
  EXPECT_EQ(exact.exit_code, 4) << exact.err;
  EXPECT_NE(exact.err.find(kArmed), std::string::npos) << exact.err;
}

// The whole stack of the face, thirteen deformers deep.
TEST_F(Tripwire, BehindTheFacesWholeStack) {
  const TemporaryFolder folder;
  std::filesystem::copy(KPSA_SCENES_DIR "/face", folder.path(), std::filesystem::copy_options::recursive);
  std::string text = TemporaryFolder::Read(folder / "face.yaml");
  text = Replaced(text, "cheekModL, cheekModR, mush]", "cheekModL, cheekModR, mush, trip]");
  text = Replaced(text, "\nconnections:\n", "\n  trip: {type: tripwire}\n\nconnections:\n");
  text = Replaced(text, "[face_mesh@mush]", "[face_mesh@trip]");
  folder.Write("face.yaml", text);

  // A small training: what is never evaluated does not depend on how good the subspace is
  RigOptions rest;
  rest.rest = true;
  Result<Rig> rig = LoadRig(AcceleratedRegistry(), folder / "face.yaml", rest);
  ASSERT_TRUE(rig.ok()) << rig.status().ToString();
  Result<std::vector<TrainingClip>> clips = ClipFrames(*rig, {"extreme", "talk_train"});
  ASSERT_TRUE(clips.ok());
  for (TrainingClip& clip : *clips) {
    std::vector<double> few;
    for (std::size_t i = 0; i < clip.times.size(); i += 6) few.push_back(clip.times[i]);
    clip.times = few;
  }
  TrainOptions options;
  options.calibration_poses = 60;
  options.max_modes = 60;
  options.rows = 60;
  options.tolerance = 0.05;  // nothing misses, so the least costly place for cues wins, the bare skin
  options.range_ramp = 0.5;
  Result<Subspace> subspace = Train(MakeTrainingRig(&*rig, rig->accelerate[0]), *clips, options);
  ASSERT_TRUE(subspace.ok()) << subspace.status().ToString();
  const auto trained = std::make_shared<const Subspace>(std::move(*subspace));

  RigRunOptions run_options = Armed(trained, kInfinity);
  run_options.clip = std::string("talk");
  RigRun pure(folder / "face.yaml", run_options);
  run_options.accelerate.tolerance = 0;
  RigRun zero(folder / "face.yaml", run_options);
  ASSERT_TRUE(pure.ok() && zero.ok()) << pure.error << zero.error;
  pure.Set("trip.armed", 1), zero.Set("trip.armed", 1);
  std::size_t hits = 0;
  for (int f = 0; f <= 240; f += 3) {
    pure.SetTime(f / 24.0);
    const Status status = pure.evaluator->Evaluate();
    ASSERT_TRUE(status.ok()) << f << ": " << status.ToString();
    hits += pure.Frame(*pure.evaluator).hit;
    if (f % 60 != 0) continue;
    zero.SetTime(f / 24.0);
    const Status refused = zero.evaluator->Evaluate();
    EXPECT_NE(refused.ToString().find(kArmed), std::string::npos) << f;
  }
  EXPECT_EQ(hits, 81u);
  // Neither they nor copies of them near the origin, on which cues are measured
  for (const std::string node : {"mush", "trip", "cheekModR"}) {
    EXPECT_EQ(pure.Computes(node), 0u) << node;
    EXPECT_EQ(pure.Computes(node + "_near"), 0u) << node;
  }
  EXPECT_EQ(pure.Computes("face_mesh_skinCluster"), 0u);
  EXPECT_GT(pure.Computes("face_mesh_skinCluster_near"), 0u);

  // And the program's report of the same
  ASSERT_TRUE(WriteSubspace(*trained, folder / "face.kpsa").ok());
  const ProcessResult bench = RunKpsa({"bench", folder / "face.yaml", "--tolerance", "1000", "--frames",
                                       "0:240:12", "--clip", "talk", "--runs", "1", "--json", "-q"});
  ASSERT_EQ(bench.exit_code, 0) << bench.err;
  std::vector<std::string> never = nlohmann::json::parse(bench.out)["nodes"]["never_evaluated"];
  std::sort(never.begin(), never.end());
  std::string names;
  for (const std::string& node : never) names += node + " ";
  EXPECT_EQ(names,
            "browL browR browWireL browWireR cheekL cheekModL cheekModR cheekR chinMod face_mesh_skinCluster "
            "jawCage lowerLipWire mush noseMod skullCage trip upperLipWire ");
}

}  // namespace
}  // namespace kpsa::engine
