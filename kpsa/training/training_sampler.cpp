#include "kpsa/training/training_sampler.h"

#include <algorithm>
#include <utility>

#include "kpsa/training/tilts.h"
#include "kpsa/training/trained_ranges.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostPoseBytes = 1'500'000'000;  // of training poses, and
constexpr std::size_t kMostJudgeBytes = 400'000'000;   // of those that judge: huge meshes have fewer, but
constexpr std::size_t kLeastSamples = 200;
constexpr std::size_t kJudges = 300;  // sampled ones; a third as many of each other kind
constexpr double kTogether = 0.3;     // of the samples, besides: poses that move most controls at once
constexpr double kFolded = 0.2;       // likewise, in which what bends one way is bent
constexpr std::pair<PoseKind, double> kOtherKinds[] = {{PoseKind::kBeyond, 0.08},
                                                       {PoseKind::kMixture, 0.06},
                                                       {PoseKind::kNeighbours, 0.06},
                                                       {PoseKind::kHeld, 0.06}};
// Of poses with held controls, for each of these: half of them hold it far out. And at most this share of the samples
constexpr std::size_t kOfHeld = 24;
constexpr double kMostOfSamples = 0.3;

}  // namespace

TrainingSampler::TrainingSampler(const TrainingRig& rig, std::vector<ControlRange> drawn,
                                 const std::vector<TrainingClip>& clips, const TrainOptions& options,
                                 PoseRecorder* recorder, const PoseLayout& layout)
    : rig_(rig),
      drawn_(std::move(drawn)),
      branches_(BranchesOf(*rig.graph, drawn_)),
      clips_(clips),
      options_(options),
      recorder_(recorder),
      layout_(layout) {}

Status TrainingSampler::LearnHowControlsMove() {
  Result<ClipPoses> clip_poses = recorder_->ControlsOfClips(clips_);
  if (!clip_poses.ok()) return clip_poses.status();
  clip_poses_ = std::move(*clip_poses);
  if (rig_.controls.empty() || of_light()) return Status();
  PoseMatrix sweeps(layout_);
  KPSA_RETURN_IF_ERROR(recorder_->AddSamples(SweepsWithTilts(), clips_, &sweeps));
  groups_ = FindControlGroups(sweeps, 0, drawn_.size());
  return Status();
}

std::vector<SampledPose> TrainingSampler::Of(PoseKind kind, std::size_t count, std::uint64_t seed,
                                             std::span<const double> margins) const {
  std::vector<ControlRange> controls = drawn_;
  for (std::size_t c = 0; c < margins.size(); ++c) controls[c].margin = margins[c];
  // Over the clips of the rig: what was learnt is a few frames about misses
  const auto own = static_cast<std::size_t>(std::ranges::count(clips_, false, &TrainingClip::learnt));
  std::vector<SampledPose> poses = PosesOfKind(kind, controls, clip_poses_, groups_,
                                               kind == PoseKind::kHeld ? own : clips_.size(), count, seed);
  AddTilts(rig_.controls, drawn_.size(), seed, &poses);
  return poses;
}

std::vector<SampledPose> TrainingSampler::Alone(std::span<const std::size_t> held, std::size_t each,
                                                std::uint64_t seed) const {
  std::vector<SampledPose> poses = PosesAlone(drawn_, held, each, clips_.size(), seed);
  AddTilts(rig_.controls, drawn_.size(), seed, &poses);
  return poses;
}

std::vector<SampledPose> TrainingSampler::SweepsWithTilts() const {
  std::vector<SampledPose> sweeps = Sweeps(drawn_);
  AddTilts(rig_.controls, drawn_.size(), options_.seed ^ 0xbb67ae8584caa73bull, &sweeps);
  return sweeps;
}

Result<std::size_t> TrainingSampler::AddTraining(std::size_t most, PoseMatrix* poses) const {
  if (options_.samples > 0) KPSA_RETURN_IF_ERROR(recorder_->AddSamples(SweepsWithTilts(), clips_, poses));
  const std::size_t count =
      std::min({options_.samples, most, std::max(RoomBeside(poses->poses()), kLeastSamples)});
  KPSA_RETURN_IF_ERROR(AddSampled(count, options_.seed, poses));
  return count;
}

std::size_t TrainingSampler::SamplesOf(double share) const {
  return static_cast<std::size_t>(share * static_cast<double>(options_.samples));
}

std::size_t TrainingSampler::MoreForTiles() const {
  return options_.samples + SamplesOf(kTogether) + SamplesOf(kFolded);
}

Status TrainingSampler::AddMore(const PoseMatrix& beside, double share, PoseMatrix* poses) const {
  const std::uint64_t seed = options_.seed ^ 0xa54ff53a5f1d36f1ull;
  const std::size_t room = RoomBeside(beside.poses()), count = std::min(SamplesOf(share), room);
  KPSA_RETURN_IF_ERROR(AddSampled(count, seed, poses));
  const std::size_t together = SamplesOf(kTogether * share);
  std::vector<SampledPose> at_once = PosesTogether(drawn_, std::min(together, room - count), ~seed);
  AddTilts(rig_.controls, drawn_.size(), ~seed, &at_once);
  return recorder_->AddSamples(at_once, clips_, poses);
}

std::vector<SampledPose> TrainingSampler::Folded(std::size_t count, std::uint64_t seed) const {
  std::vector<SampledPose> folded = PosesFolded(drawn_, branches_, count, seed);
  AddTilts(rig_.controls, drawn_.size(), seed, &folded);
  return folded;
}

Status TrainingSampler::AddFolded(std::size_t beside, double share, PoseMatrix* poses) const {
  const std::size_t count = std::min(SamplesOf(kFolded * share), RoomBeside(beside));
  return recorder_->AddSamples(Folded(count, options_.seed ^ 0x510e527fade682d1ull), clips_, poses);
}

std::size_t TrainingSampler::RoomBeside(std::size_t poses) const {
  const std::size_t fit = kMostPoseBytes / PoseBytes();
  return fit - std::min(fit, poses);
}

Status TrainingSampler::AddSampled(std::size_t count, std::uint64_t seed, PoseMatrix* poses) const {
  std::size_t rest = count;
  if (!of_light()) {
    for (const auto& [kind, share] : kOtherKinds) {
      auto of_kind = static_cast<std::size_t>(share * static_cast<double>(count));
      if (kind == PoseKind::kHeld) {
        const auto most = static_cast<std::size_t>(kMostOfSamples * static_cast<double>(count));
        of_kind = std::max(of_kind, std::min(most, kOfHeld * HeldControls(drawn_, clip_poses_).size()));
      }
      std::vector<SampledPose> some = Of(kind, of_kind, seed + static_cast<std::uint64_t>(kind));
      if (kind == PoseKind::kBeyond) HalfAsFarBeyond(rig_.controls, &some);
      rest -= some.size();
      KPSA_RETURN_IF_ERROR(recorder_->AddSamples(some, clips_, poses));
    }
  }
  return recorder_->AddSamples(Of(PoseKind::kSampled, rest, seed), clips_, poses);
}

Status TrainingSampler::AddJudges(PoseMatrix* judges, std::vector<int>* kinds) const {
  const std::size_t most = std::min(kJudges, kMostJudgeBytes / PoseBytes());
  for (const auto& [kind, count] :
       {std::pair{PoseKind::kSampled, most}, std::pair{PoseKind::kMixture, most / 3},
        std::pair{PoseKind::kNeighbours, most / 3}, std::pair{PoseKind::kHeld, most / 3}}) {
    const std::size_t before = judges->poses();
    KPSA_RETURN_IF_ERROR(
        recorder_->AddSamples(Of(kind, count, options_.seed ^ 0x2545f4914f6cdd1dull), clips_, judges));
    kinds->insert(kinds->end(), judges->poses() - before, static_cast<int>(kind));
  }
  return Status();
}

}  // namespace kpsa::engine
