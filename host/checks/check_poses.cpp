#include "host/checks/check_poses.h"

#include <algorithm>
#include <cmath>

#include "kpsa/training/control_groups.h"
#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kShown = 3;  // controls of a pose

}  // namespace

Result<std::vector<SampledPose>> DrawNewPoses(const TrainingRig& training, Compiler* compiler,
                                              const std::vector<TrainingClip>& clips, bool groups,
                                              std::size_t count, std::uint64_t seed) {
  PoseRecorder recorder(training, compiler, {}, {});
  const Result<ClipPoses> clip_poses = recorder.ControlsOfClips(clips);
  if (!clip_poses.ok()) return clip_poses.status();
  ControlGroups acting;
  if (groups && !training.controls.empty()) {
    const Result<PoseLayout> layout = recorder.Layout();
    if (!layout.ok()) return layout.status();
    PoseMatrix sweeps(*layout);
    KPSA_RETURN_IF_ERROR(recorder.AddSamples(Sweeps(training.controls), clips, &sweeps));
    acting = FindControlGroups(sweeps, 0, training.controls.size());
  }
  return SamplePoses(training.controls, *clip_poses, acting, clips.size(), count, seed);
}

double TimeOf(const SampledPose& pose, const std::vector<TrainingClip>& clips) {
  if (pose.clip < 0) return 0;
  const std::vector<double>& times = clips[static_cast<std::size_t>(pose.clip)].times;
  return times.empty() ? 0 : times.front() + pose.phase * (times.back() - times.front());
}

std::string PoseText(const Rig& rig, const TrainingRig& training, const std::vector<TrainingClip>& clips,
                     const SampledPose& pose) {
  std::vector<std::pair<double, std::string>> order;  // how far from rest, of its range; text
  for (std::size_t c = 0; c < pose.values.size(); ++c) {
    const ControlRange& range = training.controls[c];
    const auto control = std::find_if(rig.controls.begin(), rig.controls.end(),
                                      [&](const Control& one) { return one.plug == range.plug; });
    const bool driven = pose.clip >= 0 && range.by_clip;  // by the clip that plays
    if (control == rig.controls.end() || driven || !(range.max > range.min)) continue;
    const double far = std::abs(pose.values[c] - range.rest) / (range.max - range.min);
    order.emplace_back(
        std::isfinite(far) ? -far : -HUGE_VAL,
        fmt::format("{} {:.3g}", control->name, pose.values[c] / rig.units.FactorOf(control->unit)));
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string text;
  if (pose.clip >= 0)
    text =
        fmt::format("{} at {:.3g} s", clips[static_cast<std::size_t>(pose.clip)].name, TimeOf(pose, clips));
  for (std::size_t i = 0; i < std::min(kShown, order.size()); ++i) {
    if (pose.clip >= 0 && order[i].first == 0) break;  // at rest: the clip says all
    text += (text.empty() ? "" : ", ") + order[i].second;
  }
  return text;
}

}  // namespace kpsa::engine
