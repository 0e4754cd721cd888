#include "bench/promise_rig.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <mutex>

#include "base/parallel.h"
#include "cli/interrupt.h"
#include "graph/evaluator.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/accelerate.h"
#include "kpsa/training/control_groups.h"
#include "kpsa/training/mode_choice.h"
#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine {
namespace {

// What training takes of an accelerate entry (cli/cmd_train.cpp does the same).
TrainOptions OptionsOf(const Rig& rig, const AccelerateEntry& entry, double tolerance, std::uint64_t seed) {
  TrainOptions options = TrainOptionsOf(rig, entry);
  options.tolerance = tolerance;
  options.seed = seed;
  options.progress = [](const char*, double) { return !Interrupted(); };
  return options;
}

// Where the points of an entry are in the world: at their stage, or at the end of their mesh's stack.
PlugRef WorldPoints(const Rig& rig, const AcceleratedPoints& points, PlugRef at_stage) {
  const CharacterMesh& mesh = rig.scene.meshes[points.mesh];
  return mesh.stages[points.stage].world ? at_stage : mesh.points;
}

// Puts the subspace in the place of the entry's stack. The request gets the points in the world, one output a
// mesh, and then what VerdictOf reads.
Status RequestAccelerated(Rig* rig, Compiler* compiler, const AccelerateEntry& entry,
                          std::shared_ptr<const Subspace> subspace, Request* request) {
  const Result<Accelerated> accelerated = Accelerate(rig->graph.get(), compiler, MakeTarget(*rig, entry),
                                                     std::move(subspace), "promise_kpsa", {});
  if (!accelerated.ok()) return accelerated.status();
  const NodeDef& def = rig->graph->def(accelerated->node);
  const auto plug = [&](const char* name, int element) {
    return PlugRef{accelerated->node, def.FindAttribute(name), element, -1};
  };
  for (std::size_t p = 0; p < entry.points.size(); ++p)
    request->outputs.push_back(
        {WorldPoints(*rig, entry.points[p], plug("outPoints", static_cast<int>(p))), {}});
  for (const char* name : {"hit", "fullWeight"}) request->outputs.push_back({plug(name, -1), {}});
  return Status();
}

// `first`: the number of the first output after the points.
PromiseVerdict VerdictOf(const Evaluator& accelerated, Index first) {
  if (accelerated.Get<std::int64_t>(first) != 0) return PromiseVerdict::kHit;
  return accelerated.Get<double>(first + 1) < 1 ? PromiseVerdict::kBlend : PromiseVerdict::kMiss;
}

// An evaluator of a plan, and where it takes time and controls.
class Side {
 public:
  Side(const std::shared_ptr<const Plan>& plan, const PlugRef& time,
       const std::vector<ControlRange>& controls)
      : evaluator_(plan), time_(plan->FindVarying(time)) {
    for (const ControlRange& control : controls) slots_.push_back(plan->Handle(control.plug));
  }
  void Set(std::size_t control, double value) {
    const PlugHandle& slot = slots_[control];
    if (!slot) return;  // moves no point, or a clip drives it
    if (slot.IsWholeNumber()) {
      evaluator_.SetInt(slot.varying, std::llround(value));
    } else {
      evaluator_.Set(slot.varying, value, slot.component);
    }
  }
  Status Evaluate(const PromiseRig& rig, const PromisePose& pose) {
    if (time_ != kNoIndex) evaluator_.Set(time_, pose.time);
    for (std::size_t c = 0; c < slots_.size(); ++c) {
      if (rig.IsFree(c, pose.clip)) Set(c, pose.values[c]);
    }
    return evaluator_.Evaluate();
  }
  Evaluator& evaluator() { return evaluator_; }

 private:
  Evaluator evaluator_;
  Index time_;
  std::vector<PlugHandle> slots_;
};

// Infinite where a point is not finite.
double LargestDistance(const ConstPointsView& a, const ConstPointsView& b) {
  double largest = 0;  // squared
  for (std::size_t i = 0; i < a.count; ++i) {
    const double dx = double{a.x[i]} - b.x[i], dy = double{a.y[i]} - b.y[i], dz = double{a.z[i]} - b.z[i];
    const double squared = dx * dx + dy * dy + dz * dz;
    if (!(squared <= largest))
      largest = std::isfinite(squared) ? squared : std::numeric_limits<double>::infinity();
  }
  return std::sqrt(largest);
}

// The points of a frame, kept while the next one is evaluated.
class KeptPoints {
 public:
  // The largest distance of a point to where it was when this was last called; 0 at first.
  double Step(const Evaluator& evaluator, Index outputs) {
    double largest = 0;
    for (Index o = 0; o < outputs; ++o) {
      const ConstPointsView now = evaluator.Points(o);
      if (kept_.size() <= o) {
        kept_.emplace_back(now.count);
      } else {
        largest = std::max(largest, LargestDistance(now, std::as_const(kept_[o]).view()));
      }
      const PointsView to = kept_[o].view();
      std::copy_n(now.x, now.count, to.x);
      std::copy_n(now.y, now.count, to.y);
      std::copy_n(now.z, now.count, to.z);
    }
    return largest;
  }

 private:
  std::vector<PointBuffer> kept_;
};

// Keeps the first failure of several threads' (by number, so that it does not depend on them).
class FirstFailure {
 public:
  void Add(std::size_t number, Status status) {
    if (status.ok()) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (number < number_) number_ = number, status_ = std::move(status);
  }
  const Status& status() const { return status_; }

 private:
  std::mutex mutex_;
  std::size_t number_ = std::numeric_limits<std::size_t>::max();
  Status status_;
};

}  // namespace

Result<std::unique_ptr<PromiseRig>> PromiseRig::Open(const std::string& path) {
  std::unique_ptr<PromiseRig> self(new PromiseRig);
  self->path_ = path;
  Flags flags;
  flags.file = path;
  flags.rest = true;
  Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  self->open_ = std::move(*open);
  Rig& rig = self->open_->rig;
  const auto own = std::find_if(rig.accelerate.begin(), rig.accelerate.end(),
                                [](const AccelerateEntry& entry) { return entry.reference < 0; });
  if (own == rig.accelerate.end()) return Status::Invalid("has no accelerate entry of its own").At({path});
  self->entry_ = *own;
  for (const AcceleratedPoints& points : own->points) {
    if (points.colors) return Status::Invalid("accelerates light; expected points").At({path});
    const CharacterMesh& mesh = rig.scene.meshes[points.mesh];
    if (!mesh.stages[points.stage].world && !mesh.world)
      return Status::Invalid("the points of {} never come to the world", mesh.name).At({path});
  }
  self->training_rig_ = MakeTrainingRig(&rig, *own);
  for (const ControlRange& range : self->training_rig_.controls) {
    const auto control = std::find_if(rig.controls.begin(), rig.controls.end(),
                                      [&](const Control& c) { return c.plug == range.plug; });
    self->names_.push_back(control->name);
    const Type type = rig.graph->PlugType(range.plug);
    self->continuous_.push_back(type != Type::kInt && type != Type::kBool && type != Type::kEnum);
  }
  self->trained_clips_ = own->train_clips.size();
  std::vector<std::string> names = own->train_clips;
  names.insert(names.end(), own->test_clips.begin(), own->test_clips.end());
  Result<std::vector<TrainingClip>> clips = ClipFrames(rig, names);
  if (!clips.ok()) return Status(clips.status()).At({path});
  self->clips_ = std::move(*clips);
  return self;
}

PromisePose PromiseRig::Rest() const {
  PromisePose pose;
  for (const ControlRange& control : controls()) pose.values.push_back(control.rest);
  return pose;
}

Status PromiseRig::PrepareSampler() {
  if (sampler_ready_) return Status();
  KPSA_RETURN_IF_ERROR(training_rig_.set_clip(std::nullopt));
  Compiler compiler;
  PoseRecorder recorder(training_rig_, &compiler, {}, {});
  const Result<PoseLayout> layout = recorder.Layout();
  if (!layout.ok()) return layout.status();
  const std::vector<TrainingClip> trained(clips_.begin(),
                                          clips_.begin() + static_cast<std::ptrdiff_t>(trained_clips_));
  Result<ClipPoses> clip_poses = recorder.ControlsOfClips(trained);
  if (!clip_poses.ok()) return clip_poses.status();
  clip_poses_ = std::move(*clip_poses);
  if (TrainOptionsOf(open_->rig, entry_).samples > 0 && !controls().empty()) {
    PoseMatrix sweeps(*layout);
    KPSA_RETURN_IF_ERROR(recorder.AddSamples(Sweeps(controls()), trained, &sweeps));
    groups_ = FindControlGroups(sweeps, 0, controls().size());
  }
  sampler_ready_ = true;
  return Status();
}

Result<std::vector<PromisePose>> PromiseRig::Sample(std::size_t count, std::uint64_t seed) {
  KPSA_RETURN_IF_ERROR(PrepareSampler());
  std::vector<PromisePose> poses;
  for (SampledPose& sample : SamplePoses(controls(), clip_poses_, groups_, trained_clips_, count, seed)) {
    PromisePose& pose = poses.emplace_back();
    pose.values = std::move(sample.values);
    pose.clip = sample.clip;
    if (pose.clip < 0) continue;
    const std::vector<double>& times = clips_[static_cast<std::size_t>(pose.clip)].times;
    if (!times.empty()) pose.time = times.front() + sample.phase * (times.back() - times.front());
  }
  return poses;
}

Result<PromiseTraining> PromiseRig::Train(double tolerance, std::uint64_t seed) {
  const std::vector<TrainingClip> trained(clips_.begin(),
                                          clips_.begin() + static_cast<std::ptrdiff_t>(trained_clips_));
  Result<Subspace> subspace =
      kpsa::engine::Train(training_rig_, trained, OptionsOf(open_->rig, entry_, tolerance, seed));
  if (!subspace.ok()) return Status(subspace.status()).At({path_});
  PromiseTraining training;
  training.subspace_ = std::make_shared<const Subspace>(std::move(*subspace));
  return training;
}

Result<std::shared_ptr<const Plan>> PromiseRig::FullPlan(int clip) {
  std::shared_ptr<const Plan>& kept = full_plans_[clip];
  if (kept != nullptr) return kept;
  Rig& rig = open_->rig;
  KPSA_RETURN_IF_ERROR(training_rig_.set_clip(
      clip < 0 ? std::nullopt
               : std::optional<std::string_view>(clips_[static_cast<std::size_t>(clip)].name)));
  Request request;
  request.varying = VaryingPlugs(rig);
  for (const AcceleratedPoints& points : entry_.points)
    request.outputs.push_back({WorldPoints(rig, points, points.points), {}});
  Compiler compiler;
  Result<std::shared_ptr<const Plan>> plan = CompileFor(rig, &compiler, request);
  KPSA_RETURN_IF_ERROR(training_rig_.set_clip(std::nullopt));
  if (plan.ok() && !(*plan)->stateful_node().empty())
    return Status::Invalid("{} needs its previous frame: no pose stands alone", (*plan)->stateful_node())
        .At({path_});
  if (plan.ok()) kept = *plan;
  return plan;
}

Result<std::shared_ptr<const Plan>> PromiseRig::AcceleratedPlan(int clip, PromiseTraining* training) {
  std::shared_ptr<const Plan>& kept = training->plans_[clip];
  if (kept != nullptr) return kept;
  // A rig of its own: its graph is rewritten
  Flags flags;
  flags.file = path_;
  flags.rest = true;
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  Rig& rig = (*open)->rig;
  if (clip >= 0) KPSA_RETURN_IF_ERROR(SetClip(&rig, clips_[static_cast<std::size_t>(clip)].name));
  Compiler compiler;
  Request request;
  request.varying = VaryingPlugs(rig);
  KPSA_RETURN_IF_ERROR(
      RequestAccelerated(&rig, &compiler, entry_, training->subspace_, &request).At({path_}));
  Result<std::shared_ptr<const Plan>> plan = CompileFor(rig, &compiler, request);
  if (plan.ok()) kept = *plan;
  return plan;
}

Status PromiseRig::MakePlans(int clip, std::span<PromiseTraining> trainings) {
  if (const auto plan = FullPlan(clip); !plan.ok()) return plan.status();
  for (PromiseTraining& training : trainings) {
    if (const auto plan = AcceleratedPlan(clip, &training); !plan.ok()) return plan.status();
  }
  return Status();
}

Result<std::vector<std::vector<PromiseOutcome>>> PromiseRig::Try(const std::vector<PromisePose>& poses,
                                                                 std::span<PromiseTraining> trainings) {
  const PlugRef time = training_rig_.time;
  const auto outputs = static_cast<Index>(entry_.points.size());
  std::vector<std::vector<PromiseOutcome>> outcomes(trainings.size(),
                                                    std::vector<PromiseOutcome>(poses.size()));
  for (int clip = -1; clip < static_cast<int>(clips_.size()); ++clip) {
    std::vector<std::size_t> mine;
    for (std::size_t p = 0; p < poses.size(); ++p) {
      if (poses[p].clip == clip) mine.push_back(p);
    }
    if (mine.empty()) continue;
    KPSA_RETURN_IF_ERROR(MakePlans(clip, trainings));
    FirstFailure failure;
    const std::size_t grain = mine.size() / static_cast<std::size_t>(4 * AllowedThreads()) + 1;
    ParallelFor(mine.size(), grain, [&](std::size_t begin, std::size_t end) {
      Side full(full_plans_.at(clip), time, controls());
      std::deque<Side> fast;
      for (const PromiseTraining& training : trainings)
        fast.emplace_back(training.plans_.at(clip), time, controls());
      for (std::size_t i = begin; i < end; ++i) {
        const PromisePose& pose = poses[mine[i]];
        failure.Add(mine[i], full.Evaluate(*this, pose));
        for (std::size_t t = 0; t < fast.size(); ++t) {
          failure.Add(mine[i], fast[t].Evaluate(*this, pose));
          PromiseOutcome& outcome = outcomes[t][mine[i]];
          outcome.verdict = VerdictOf(fast[t].evaluator(), outputs);
          for (Index o = 0; o < outputs; ++o) {
            outcome.error = std::max(
                outcome.error, LargestDistance(full.evaluator().Points(o), fast[t].evaluator().Points(o)));
          }
        }
      }
    });
    if (!failure.status().ok()) return Status(failure.status()).At({path_});
  }
  return outcomes;
}

Result<std::vector<std::vector<PromiseJump>>> PromiseRig::Walk(const std::vector<PromiseWalk>& walks,
                                                               std::size_t steps,
                                                               std::span<PromiseTraining> trainings) {
  const PlugRef time = training_rig_.time;
  const auto outputs = static_cast<Index>(entry_.points.size());
  for (const PromiseWalk& walk : walks) KPSA_RETURN_IF_ERROR(MakePlans(walk.pose.clip, trainings));
  std::vector<std::vector<PromiseJump>> jumps(trainings.size(), std::vector<PromiseJump>(walks.size()));
  FirstFailure failure;
  ParallelFor(walks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t w = begin; w < end; ++w) {
      PromisePose pose = walks[w].pose;
      Side full(full_plans_.at(pose.clip), time, controls());
      std::deque<Side> fast;
      for (const PromiseTraining& training : trainings)
        fast.emplace_back(training.plans_.at(pose.clip), time, controls());
      KeptPoints full_points;
      std::vector<KeptPoints> fast_points(trainings.size());
      for (std::size_t s = 0; s <= steps; ++s) {
        const double share = static_cast<double>(s) / static_cast<double>(steps);
        pose.values[walks[w].control] = walks[w].from + share * (walks[w].to - walks[w].from);
        failure.Add(w, full.Evaluate(*this, pose));
        const double full_step = full_points.Step(full.evaluator(), outputs);
        for (std::size_t t = 0; t < fast.size(); ++t) {
          failure.Add(w, fast[t].Evaluate(*this, pose));
          const double excess = fast_points[t].Step(fast[t].evaluator(), outputs) - full_step;
          PromiseJump& jump = jumps[t][w];
          jump.excess = std::max(jump.excess, excess);
          jump.accepted = jump.accepted || VerdictOf(fast[t].evaluator(), outputs) != PromiseVerdict::kMiss;
        }
      }
    }
  });
  if (!failure.status().ok()) return Status(failure.status()).At({path_});
  return jumps;
}

}  // namespace kpsa::engine
