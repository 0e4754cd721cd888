// A rig on which the promise of acceleration is tried: trained as `kpsa train` trains it, then evaluated
// fully and accelerated pose by pose. What this needs of the trainer and of the KPSA node is in
// promise_rig.cpp alone. It looks at points, and at no figure that training or SoftCache have of their
// errors.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "cli/common.h"
#include "graph/plan.h"
#include "kpsa/subspace.h"
#include "kpsa/training/poses.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

struct PromisePose {
  int clip = -1;               // of PromiseRig::clips(); below 0: the rest pose
  double time = 0;             // seconds
  std::vector<double> values;  // by control; one that the clip drives is left to it
};

enum class PromiseVerdict : std::uint8_t { kHit, kBlend, kMiss };

struct PromiseOutcome {
  PromiseVerdict verdict = PromiseVerdict::kMiss;
  double error = 0;  // metres in the world, of the farthest point; infinite where one is not finite
};

// A control that goes from one value to another over a pose that else stays as it is.
struct PromiseWalk {
  PromisePose pose;
  std::size_t control = 0;
  double from = 0, to = 0;
};

struct PromiseJump {
  double excess =
      0;  // metres: the largest step of a point, accelerated, less the largest one fully evaluated
  bool accepted = false;  // at some step: where all are misses, there is nothing to see
};

// A subspace in memory with the plans that it was tried with.
class PromiseTraining {
 public:
  const Subspace& subspace() const { return *subspace_; }

 private:
  friend class PromiseRig;
  std::shared_ptr<const Subspace> subspace_;
  std::map<int, std::shared_ptr<const Plan>> plans_;  // accelerated, by clip
};

class PromiseRig {
 public:
  // Errors: those of reading the rig; no accelerate entry of its own, or one of light; an entry whose points
  // never come to the world.
  static Result<std::unique_ptr<PromiseRig>> Open(const std::string& path);

  double tolerance() const { return entry_.tolerance; }  // metres, as the rig has it
  const std::vector<ControlRange>& controls() const { return training_rig_.controls; }
  const std::string& control_name(std::size_t control) const { return names_[control]; }
  bool continuous(std::size_t control) const { return continuous_[control]; }  // false: whole numbers
  // Those that are trained on, then the test clips; times are those of the frames.
  const std::vector<TrainingClip>& clips() const { return clips_; }
  double fps() const { return open_->rig.fps; }
  // Whether the control is free while the clip plays.
  bool IsFree(std::size_t control, int clip) const {
    return clip < 0 || !training_rig_.controls[control].by_clip;
  }
  PromisePose Rest() const;

  // What the trainer would draw with this seed.
  Result<std::vector<PromisePose>> Sample(std::size_t count, std::uint64_t seed);
  // As `kpsa train` with --tolerance and --seed.
  Result<PromiseTraining> Train(double tolerance, std::uint64_t seed);
  // By training, one outcome a pose. The full evaluation of a pose serves all trainings.
  Result<std::vector<std::vector<PromiseOutcome>>> Try(const std::vector<PromisePose>& poses,
                                                       std::span<PromiseTraining> trainings);
  // By training, the largest jump of each walk over so many steps.
  Result<std::vector<std::vector<PromiseJump>>> Walk(const std::vector<PromiseWalk>& walks, std::size_t steps,
                                                     std::span<PromiseTraining> trainings);

 private:
  PromiseRig() = default;
  Status PrepareSampler();
  Result<std::shared_ptr<const Plan>> FullPlan(int clip);
  Result<std::shared_ptr<const Plan>> AcceleratedPlan(int clip, PromiseTraining* training);
  Status MakePlans(int clip, std::span<PromiseTraining> trainings);

  std::string path_;
  std::unique_ptr<OpenRig> open_;
  AccelerateEntry entry_;
  TrainingRig training_rig_;
  std::vector<std::string> names_;
  std::vector<bool> continuous_;
  std::vector<TrainingClip> clips_;
  std::size_t trained_clips_ = 0;
  bool sampler_ready_ = false;
  ClipPoses clip_poses_;
  ControlGroups groups_;
  std::map<int, std::shared_ptr<const Plan>> full_plans_;  // by clip
};

}  // namespace kpsa::engine
