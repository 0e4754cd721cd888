#include "host/checks/subspace_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/bench/frame_times.h"
#include "host/checks/check_poses.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/accelerate.h"
#include "kpsa/training/space_points.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kWorst = 5;

// For each point of a mesh, the number of its region; names are added as they come.
std::vector<Index> RegionsOf(const Rig& rig, const CharacterMesh& mesh,
                             std::vector<SubspaceCheck::Region>* regions) {
  const auto number = [&](const std::string& name) {
    for (Index r = 0; r < regions->size(); ++r) {
      if ((*regions)[r].name == name) return r;
    }
    regions->push_back({name, 0, 0});
    return static_cast<Index>(regions->size() - 1);
  };
  std::vector<Index> of_point(mesh.mesh().point_count(), kNoIndex),
      of_joint(mesh.influence_nodes.size(), kNoIndex);
  for (Index p = 0; p < of_point.size(); ++p) {
    Index joint = kNoIndex;
    float most = 0;
    if (mesh.influences != nullptr) {
      for (Index i = mesh.influences->offsets()[p]; i < mesh.influences->offsets()[p + 1]; ++i) {
        if (mesh.influences->weights()[i] > most)
          most = mesh.influences->weights()[i], joint = mesh.influences->joints()[i];
      }
    }
    if (joint >= of_joint.size()) {
      of_point[p] = number(mesh.name);
      continue;
    }
    if (of_joint[joint] == kNoIndex) of_joint[joint] = number(rig.graph->name(mesh.influence_nodes[joint]));
    of_point[p] = of_joint[joint];
  }
  return of_point;
}

void SetPose(const TrainingRig& training, const SampledPose& pose, double time, Evaluator* evaluator) {
  SetPlug(evaluator, training.time, time);
  for (std::size_t c = 0; c < pose.values.size(); ++c)
    SetPlug(evaluator, training.controls[c].plug, pose.values[c]);  // nothing where a clip plays it
}

class Checker {
 public:
  Checker(Rig* rig, const AccelerateEntry& entry, const std::shared_ptr<const Subspace>& subspace,
          const std::vector<TrainingClip>& clips, const SubspaceCheckOptions& options)
      : rig_(*rig),
        entry_(entry),
        subspace_(subspace),
        clips_(clips),
        options_(options),
        training_(AtRest(MakeTrainingRig(rig, entry), ParseTraining(subspace->training).at_rest)) {}

  Result<SubspaceCheck> Run() {
    if (training_.controls.empty() && clips_.empty()) return std::move(check_);
    const Result<std::vector<SampledPose>> drawn =
        DrawNewPoses(training_, &compiler_, clips_, options_.groups, options_.poses, options_.seed);
    if (!drawn.ok()) return drawn.status();
    for (int clip = -1; clip < static_cast<int>(clips_.size()); ++clip) {
      std::vector<const SampledPose*> poses;
      for (const SampledPose& pose : *drawn) {
        if (pose.clip == clip) poses.push_back(&pose);
      }
      if (!poses.empty()) KPSA_RETURN_IF_ERROR(Play(clip, poses));
    }
    KPSA_RETURN_IF_ERROR(SetClip(&rig_, std::nullopt));
    Finish();
    return std::move(check_);
  }

 private:
  // The poses of a clip (-1: of none).
  Status Play(int clip, const std::vector<const SampledPose*>& poses) {
    KPSA_RETURN_IF_ERROR(SetClip(
        &rig_, clip < 0 ? std::nullopt
                        : std::optional<std::string_view>(clips_[static_cast<std::size_t>(clip)].name)));
    Request request;
    request.varying = VaryingPlugs(rig_);
    for (const AcceleratedPoints& points : entry_.points) request.outputs.push_back({points.points, {}});
    const auto full_plan = CompileFor(rig_, &compiler_, request);
    if (!full_plan.ok()) return full_plan.status();
    AccelerateOptions accelerate;
    accelerate.tolerance = kAnyError;
    // What must be guarded depends on the clip, so each has a node of its own
    const Result<Accelerated> accelerated =
        Accelerate(rig_.graph.get(), &compiler_, MakeTarget(rig_, entry_), subspace_,
                   rig_.graph->FreeNodeName("check_kpsa"), accelerate);
    if (!accelerated.ok()) return accelerated.status();
    const NodeDef& def = rig_.graph->def(accelerated->node);
    for (std::size_t p = 0; p < request.outputs.size(); ++p)
      request.outputs[p].plug = {accelerated->node, def.FindAttribute("outPoints"), static_cast<int>(p), -1};
    request.outputs.push_back({{accelerated->node, def.FindAttribute("fullWeight"), -1, -1}, {}});
    const auto fast_plan = CompileFor(rig_, &compiler_, request);
    if (!fast_plan.ok()) return fast_plan.status();
    if (regions_.empty()) FindRegions(**full_plan);

    Evaluator full(*full_plan), fast(*fast_plan);
    FrameTimes full_times(poses.size(), !subspace_->of_light()),
        fast_times(poses.size(), !subspace_->of_light());
    const auto evaluate = [&](const SampledPose& pose, Evaluator* evaluator, FrameTimes* times) {
      SetPose(training_, pose, TimeOf(pose, clips_), evaluator);
      const std::uint64_t begin = ProfileClock();
      Status status = evaluator->Evaluate();
      if (times != nullptr) times->Add(ProfileClock() - begin);
      return status.ok() ? status
                         : Status::Evaluation("at {}: {}", PoseText(rig_, training_, clips_, pose),
                                              status.errors().front().message);
    };
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (options_.watch.cancelled()) return CancelledStatus();
      options_.watch.Done(done_++, options_.poses);
      KPSA_RETURN_IF_ERROR(evaluate(*poses[i], &full, nullptr));
      KPSA_RETURN_IF_ERROR(evaluate(*poses[i], &fast, nullptr));
      KPSA_RETURN_IF_ERROR(Compare(*poses[i], full, fast));
    }
    if (options_.played.hits > 0) return Status();
    // Each side by itself, so that none finds the other's data in the caches; light takes too long to do so
    // again, and is beyond caches
    const std::size_t timed = subspace_->of_light() ? 1 : poses.size();
    for (const auto& [evaluator, times] : {std::pair{&full, &full_times}, {&fast, &fast_times}}) {
      evaluator->Invalidate();
      times->BeginTurn(0);
      for (std::size_t i = 0; i < timed; ++i) {
        if (options_.watch.cancelled()) return CancelledStatus();
        KPSA_RETURN_IF_ERROR(evaluate(*poses[i], evaluator, times));
      }
      times->EndTurn();
      for (const std::vector<double>& runs : times->Finish())
        (evaluator == &full ? full_ns_ : fast_ns_)
            .insert((evaluator == &full ? full_ns_ : fast_ns_).end(), runs.begin(), runs.end());
    }
    return Status();
  }

  void FindRegions(const Plan& full_plan) {
    for (std::size_t p = 0; p < entry_.points.size(); ++p) {
      const AcceleratedPoints& points = entry_.points[p];
      if (points.colors) {
        const Index total = full_plan.outputs()[p].points.total();
        regions_.emplace_back(total, static_cast<Index>(check_.worst_regions.size()));
        check_.worst_regions.push_back({rig_.graph->PlugName(points.points), 0, 0});
      } else {
        regions_.push_back(RegionsOf(rig_, rig_.scene.meshes[points.mesh], &check_.worst_regions));
      }
    }
    region_counts_.resize(check_.worst_regions.size(), 0);
  }

  Status Compare(const SampledPose& pose, const Evaluator& full, const Evaluator& fast) {
    SubspaceCheck::Pose result;
    result.controls = PoseText(rig_, training_, clips_, pose);
    double squares = 0;
    std::size_t count = 0;
    for (Index p = 0; p < entry_.points.size(); ++p) {
      const ConstPointsView a = full.Points(p), b = fast.Points(p);
      for (std::size_t i = 0; i < a.count; ++i) {
        const Double3 d{double{a.x[i]} - b.x[i], double{a.y[i]} - b.y[i], double{a.z[i]} - b.z[i]};
        const double square = Dot(d, d);
        SubspaceCheck::Region& region = check_.worst_regions[regions_[p][i]];
        region.rms += square;
        region.max = std::max(region.max, std::sqrt(square));
        ++region_counts_[regions_[p][i]];
        squares += square;
        if (std::sqrt(square) > result.max) result.max = std::sqrt(square), result.region = region.name;
      }
      count += a.count;
    }
    if (!std::isfinite(squares))
      return Status::Evaluation("at {}: the points are not all numbers, so nothing can be learnt there",
                                result.controls);
    not_reconstructed_ += fast.Get<double>(static_cast<Index>(entry_.points.size())) > 0;
    result.rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, count)));
    squares_ += squares, count_ += count;
    check_.max = std::max(check_.max, result.max);
    check_.worst_poses.push_back(std::move(result));
    return Status();
  }

  void Finish() {
    check_.poses = check_.worst_poses.size();
    check_.reconstructed = check_.poses - not_reconstructed_;
    check_.rms = std::sqrt(squares_ / static_cast<double>(std::max<std::size_t>(1, count_)));
    if (const PlaybackTimes& played = options_.played; played.hits > 0) {
      check_.clip_frames = played.frames;
      check_.full_ms = played.full_ms, check_.accelerated_ms = played.hit_ms;
    } else {
      check_.full_ms = Median(full_ns_) / 1e6, check_.accelerated_ms = Median(fast_ns_) / 1e6;
    }
    for (std::size_t r = 0; r < region_counts_.size(); ++r) {
      check_.worst_regions[r].rms = std::sqrt(
          check_.worst_regions[r].rms / static_cast<double>(std::max<std::size_t>(1, region_counts_[r])));
    }
    std::stable_sort(check_.worst_poses.begin(), check_.worst_poses.end(),
                     [](const auto& a, const auto& b) { return a.max > b.max; });
    std::stable_sort(check_.worst_regions.begin(), check_.worst_regions.end(),
                     [](const auto& a, const auto& b) { return a.rms > b.rms; });
    check_.worst_poses.resize(std::min(kWorst, check_.worst_poses.size()));
    check_.worst_regions.resize(std::min(kWorst, check_.worst_regions.size()));
  }

  Rig& rig_;
  const AccelerateEntry& entry_;
  std::shared_ptr<const Subspace> subspace_;
  const std::vector<TrainingClip>& clips_;
  const SubspaceCheckOptions& options_;
  TrainingRig training_;
  Compiler compiler_;
  SubspaceCheck check_;
  std::vector<std::vector<Index>> regions_;  // of each output's points, in check_.worst_regions
  std::vector<std::size_t> region_counts_;
  std::vector<double> full_ns_, fast_ns_;
  double squares_ = 0;
  std::size_t count_ = 0, done_ = 0, not_reconstructed_ = 0;
};

}  // namespace

Result<SubspaceCheck> CheckSubspace(Rig* rig, const AccelerateEntry& entry,
                                    const std::shared_ptr<const Subspace>& subspace,
                                    const std::vector<TrainingClip>& clips,
                                    const SubspaceCheckOptions& options) {
  return Checker(rig, entry, subspace, clips, options).Run();
}

}  // namespace kpsa::engine
