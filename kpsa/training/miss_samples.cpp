#include "kpsa/training/miss_samples.h"

#include <algorithm>

#include "kpsa/training/trainer.h"

namespace kpsa::engine {
namespace {

constexpr int kPosesOfMiss = 4;  // from rest to the miss

}  // namespace

Result<std::vector<SampledPose>> SamplesOf(const std::vector<Miss>& misses, const TrainingRig& rig,
                                           const std::vector<TrainingClip>& clips) {
  std::vector<std::string> names;
  for (const ControlRange& control : rig.controls) names.push_back(rig.graph->PlugName(control.plug));
  std::vector<SampledPose> poses;
  for (const Miss& miss : misses) {
    SampledPose pose;
    for (const ControlRange& control : rig.controls) pose.values.push_back(control.rest);
    const auto clip = std::ranges::find(clips, miss.clip, &TrainingClip::name);
    if (clip != clips.end() && !clip->times.empty()) {
      pose.clip = static_cast<int>(clip - clips.begin());
      const double begin = clip->times.front(), length = clip->times.back() - begin;
      pose.phase = length > 0 ? (miss.time - begin) / length : 0;
    }
    std::vector<std::pair<std::size_t, double>> moved;
    for (const auto& [name, value] : miss.controls) {
      const auto found = std::ranges::find(names, name);
      if (found == names.end())
        return Status::Invalid("the rig has no control \"{}\"{}", name, DidYouMean(name, names));
      moved.emplace_back(found - names.begin(), value);
    }
    for (int k = 1; k <= kPosesOfMiss; ++k) {
      for (const auto& [c, value] : moved) {
        const double rest = rig.controls[c].rest;
        pose.values[c] = rest + (value - rest) * k / kPosesOfMiss;
      }
      poses.push_back(pose);
    }
  }
  return poses;
}

}  // namespace kpsa::engine
