#include "bench/promise_poses.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace kpsa::engine {
namespace {

// Away from the trainer's own: it takes its seed, and that seed with constants over it.
constexpr std::uint64_t kSampleSeeds = 0x70726f6d00000000, kMarginSeeds = 0x6d61726700000000,
                        kWalkSeeds = 0x77616c6b00000000;
constexpr double kMargin = 0.1;                          // of a control's range
constexpr double kWalkInside = 0.05, kWalkBeyond = 0.2;  // likewise
constexpr double kSpeeds[] = {0.37, 0.73, 1.73};         // frames a frame
constexpr double kOffset = 0.313;  // of a frame: with it, no step of those speeds meets one

// The engine is the same everywhere, unlike the standard's distributions.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double Unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double Between(double a, double b) { return a + (b - a) * Unit(); }
  std::size_t Below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }
  // So many different ones of the list.
  std::vector<std::size_t> Choose(std::vector<std::size_t> from, std::size_t count) {
    count = std::min(count, from.size());
    for (std::size_t i = 0; i < count; ++i) std::swap(from[i], from[i + Below(from.size() - i)]);
    from.resize(count);
    return from;
  }

 private:
  std::mt19937_64 engine_;
};

std::vector<std::size_t> FreeControls(const PromiseRig& rig, int clip, bool continuous_only) {
  std::vector<std::size_t> free;
  for (std::size_t c = 0; c < rig.controls().size(); ++c) {
    if (rig.IsFree(c, clip) && (!continuous_only || rig.continuous(c))) free.push_back(c);
  }
  return free;
}

std::vector<PromisePose> Mixtures(const PromiseRig& rig, std::size_t count, std::uint64_t seed) {
  Dice random(seed);
  std::vector<PromisePose> poses;
  const std::vector<std::size_t> free = FreeControls(rig, -1, false);
  for (std::size_t p = 0; p < count && !free.empty(); ++p) {
    PromisePose& pose = poses.emplace_back(rig.Rest());
    for (const std::size_t c : random.Choose(free, 3 + random.Below(4)))
      pose.values[c] = random.Between(rig.controls()[c].min, rig.controls()[c].max);
  }
  return poses;
}

Result<std::vector<PromisePose>> Margin(PromiseRig* rig, std::size_t count, std::uint64_t seed) {
  Result<std::vector<PromisePose>> poses = rig->Sample(count, kMarginSeeds + seed);
  if (!poses.ok()) return poses;
  Dice random(seed);
  for (PromisePose& pose : *poses) {
    const std::vector<std::size_t> free = FreeControls(*rig, pose.clip, true);
    if (free.empty()) return std::vector<PromisePose>();
    for (const std::size_t c : random.Choose(free, 1 + random.Below(3))) {
      const ControlRange& control = rig->controls()[c];
      const double beyond = random.Between(0, kMargin) * (control.max - control.min);
      pose.values[c] = random.Below(2) == 0 ? control.min - beyond : control.max + beyond;
    }
  }
  return poses;
}

// Half frames, and the frames of playback at odd speeds.
std::vector<PromisePose> BetweenFrames(const PromiseRig& rig, std::size_t count, std::uint64_t seed) {
  Dice random(seed);
  std::vector<PromisePose> poses;
  const std::size_t clips = rig.clips().size();
  for (std::size_t p = 0; p < count && clips > 0; ++p) {
    PromisePose& pose = poses.emplace_back(rig.Rest());
    pose.clip = static_cast<int>(p % clips);
    const std::vector<double>& times = rig.clips()[p % clips].times;
    const std::size_t frames = times.size() - 1;
    double frame = 0;
    if (frames > 0 && p / clips % 2 == 0) {
      frame = static_cast<double>(random.Below(frames)) + 0.5;
    } else if (frames > 0) {
      const double speed = kSpeeds[random.Below(std::size(kSpeeds))];
      const auto played = static_cast<std::size_t>((static_cast<double>(frames) - kOffset) / speed) + 1;
      frame = kOffset + speed * static_cast<double>(random.Below(played));
    }
    pose.time = times.front() + frame / rig.fps();
  }
  return poses;
}

}  // namespace

const char* TrialKindName(TrialKind kind) {
  switch (kind) {
    case TrialKind::kSampler:
      return "sampler";
    case TrialKind::kMixtures:
      return "mixtures";
    case TrialKind::kMargin:
      return "margin";
    case TrialKind::kClips:
      return "clips";
  }
  return "";
}

Result<std::vector<PromisePose>> DrawPoses(PromiseRig* rig, TrialKind kind, std::size_t count,
                                           std::uint64_t seed) {
  switch (kind) {
    case TrialKind::kSampler:
      return rig->Sample(count, kSampleSeeds + seed);
    case TrialKind::kMixtures:
      return Mixtures(*rig, count, seed);
    case TrialKind::kMargin:
      return Margin(rig, count, seed);
    case TrialKind::kClips:
      return BetweenFrames(*rig, count, seed);
  }
  return std::vector<PromisePose>();
}

Result<std::vector<PromiseWalk>> DrawWalks(PromiseRig* rig, std::size_t most, std::uint64_t seed) {
  std::vector<std::size_t> chosen = FreeControls(*rig, -1, true);
  if (chosen.size() > most) {
    const std::vector<std::size_t> all = chosen;
    chosen.clear();
    for (std::size_t i = 0; i < most; ++i)
      chosen.push_back(all[(2 * i + seed % 2) * all.size() / (2 * most)]);
  }
  // Sampled poses that no clip is under
  std::vector<PromisePose> poses;
  if (!chosen.empty()) {
    const Result<std::vector<PromisePose>> sampled = rig->Sample(4 * chosen.size() + 40, kWalkSeeds + seed);
    if (!sampled.ok()) return sampled.status();
    for (const PromisePose& pose : *sampled) {
      if (pose.clip < 0) poses.push_back(pose);
    }
    if (poses.empty()) poses.push_back(rig->Rest());
  }
  Dice random(seed);
  std::vector<PromiseWalk> walks;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const ControlRange& control = rig->controls()[chosen[i]];
    const double range = control.max - control.min;
    if (!(range > 0)) continue;
    // Few controls are ever moved beyond an end that is their rest
    const bool up = control.min == control.rest || (control.max != control.rest && (i + seed) % 2 == 0);
    const double end = up ? control.max : control.min, out = up ? range : -range;
    walks.push_back(
        {poses[random.Below(poses.size())], chosen[i], end - kWalkInside * out, end + kWalkBeyond * out});
  }
  return walks;
}

}  // namespace kpsa::engine
