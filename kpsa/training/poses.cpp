#include "kpsa/training/poses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "kpsa/training/branches.h"
#include "kpsa/training/random.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kClipFrames = 80;  // frames of the clips to mix
constexpr double kMoves = 0.01;          // of its range, that a control moves in the clips: it is not held
constexpr std::size_t kHeldAtOnce = 8;
constexpr std::size_t kLeastOfMany = 8;  // controls that are away from rest where many are
// Of a mesh's weights, in the share of other controls that move together: shapes add up where they overlap
constexpr double kWeightsTogether = 0.25;
constexpr double kOneWay = 0.5;  // of how far a control goes one way, that it goes the other way: it bends
constexpr double kShortOfEnd = 0.15, kLittle = 0.3;

class Sampler {
 public:
  Sampler(const std::vector<ControlRange>& controls, const ClipPoses& clip_poses, std::uint64_t seed)
      : controls_(controls), clip_poses_(clip_poses), random_(seed) {}

  SampledPose Rest() const {
    SampledPose pose;
    for (const ControlRange& control : controls_) pose.values.push_back(control.rest);
    return pose;
  }
  Random& random() { return random_; }

  // Two or three controls of several groups near their ends.
  void MixGroups(const ControlGroups& groups, SampledPose* pose) {
    const std::size_t count = 3 + random_.Below(5);
    for (std::size_t g = 0; g < count; ++g) {
      const std::vector<std::size_t>& group = groups[random_.Below(groups.size())];
      const std::size_t active = 2 + random_.Below(2);
      for (std::size_t k = 0; k < active; ++k)
        Move(group[random_.Below(group.size())], 0.4 + 0.6 * random_.Unit(), pose);
    }
  }

  // Frames of the clips; controls of a node stay together.
  void MixFrames(SampledPose* pose) {
    const std::vector<double>& a = clip_poses_[random_.Below(clip_poses_.size())];
    const std::vector<double>& b = clip_poses_[random_.Below(clip_poses_.size())];
    const double split = random_.Unit() < 0.3 ? 0 : 0.5 * random_.Unit();  // share of b
    const double reach_a = 0.3 + random_.Unit(), reach_b = 0.3 + random_.Unit();
    bool from_b = false;
    for (std::size_t i = 0; i < controls_.size(); ++i) {
      const ControlRange& c = controls_[i];
      if (i == 0 || !OfOneNode(controls_[i - 1], c)) from_b = random_.Unit() < split;
      const double value = c.rest + ((from_b ? b[i] : a[i]) - c.rest) * (from_b ? reach_b : reach_a);
      pose->values[i] = std::clamp(value, c.min, c.max);
    }
    MoveSome(4, 0.6, pose);
  }

  void Mixture(SampledPose* pose) {
    const std::size_t count = std::min(controls_.size(), 3 + random_.Below(4));
    for (const std::size_t i : Some(controls_.size(), count))
      pose->values[i] = controls_[i].min + (controls_[i].max - controls_[i].min) * random_.Unit();
  }

  void Neighbours(const ControlGroups& groups, SampledPose* pose) {
    const std::vector<std::size_t>& group = groups[random_.Below(groups.size())];
    const std::size_t count = std::min(group.size(), 2 + random_.Below(5));
    for (const std::size_t k : Some(group.size(), count)) Move(group[k], 0.5 + 0.5 * random_.Unit(), pose);
  }

  // Most nodes at once, each about all of its axes, as a clip does that nobody trained on.
  void MoveTogether(SampledPose* pose) {
    const double share = 0.3 + 0.7 * random_.Unit(), reach = 0.2 + 0.8 * random_.Unit();
    bool moves = false;
    for (std::size_t i = 0; i < controls_.size(); ++i) {
      const ControlRange& c = controls_[i];
      if (i == 0 || !OfOneNode(controls_[i - 1], c))
        moves = random_.Unit() < (c.plug.element >= 0 ? kWeightsTogether * share : share);
      if (moves) pose->values[i] = c.rest + (c.min + (c.max - c.min) * random_.Unit() - c.rest) * reach;
    }
  }

  // As PosesFolded says; curls: the same axis and end of all nodes.
  void Fold(std::span<const Branch> branches, bool curls, SampledPose* pose) {
    const double share = 0.5 + 0.5 * random_.Unit(), reach = std::min(1.0, 0.4 + 1.2 * random_.Unit());
    const auto axis = static_cast<int>(random_.Below(3));
    const bool up = random_.Unit() < 0.5;
    const std::vector<bool> still = StillBranches(branches, &random_);
    for (std::size_t b = 0; b < branches.size(); ++b) {
      const auto [begin, end, above] = branches[b];
      const bool weight = controls_[begin].plug.element >= 0;
      if (still[b] || !(random_.Unit() < (weight ? kWeightsTogether * share : share))) continue;
      const std::size_t any = begin + random_.Below(end - begin);
      for (std::size_t i = begin; i < end; ++i) {
        const ControlRange& c = controls_[i];
        const bool turned = curls ? c.plug.component == axis : i == any;
        pose->values[i] =
            c.rest + (Folded(c, turned, curls ? std::optional(up) : std::nullopt) - c.rest) * reach;
      }
    }
  }

  // From eight up to all of them; the ends are where most of them add up.
  void MoveManyAnywhere(bool to_ends, SampledPose* pose) {
    const std::size_t n = controls_.size(), least = std::min(n, kLeastOfMany);
    const auto more = static_cast<std::size_t>(random_.Unit() * static_cast<double>(n - least) + 0.5);
    for (const std::size_t i : Some(n, least + more)) {
      const ControlRange& c = controls_[i];
      const double at = random_.Unit();
      pose->values[i] = !to_ends ? c.min + (c.max - c.min) * at : at < 0.5 ? c.min : c.max;
    }
  }

  // Controls of a clip that plays say nothing; whole numbers have no margin.
  void Beyond(SampledPose* pose) {
    const std::size_t count = std::min<std::size_t>(controls_.size(), 1 + random_.Below(3));
    for (const std::size_t i : Some(controls_.size(), count)) {
      const ControlRange& c = controls_[i];
      const double beyond = (kBeyondShare + c.margin) * (c.max - c.min) * random_.Unit();
      const bool up = random_.Unit() < 0.5 || c.min == c.rest;
      pose->values[i] = std::clamp(up ? c.max + beyond : c.min - beyond, c.lowest, c.highest);
    }
  }

  // One control far out, each in its turn, or some of them anywhere, over a clip.
  void Hold(const std::vector<std::size_t>& held, std::size_t number, std::size_t clips, SampledPose* pose) {
    pose->clip = static_cast<int>(random_.Below(clips));
    pose->phase = random_.Unit();
    if (number % 2 == 0) return Move(held[number / 2 % held.size()], 0.5 + 0.5 * random_.Unit(), pose);
    const std::size_t count = 1 + random_.Below(std::min(held.size(), kHeldAtOnce));
    for (const std::size_t k : Some(held.size(), count)) {
      const ControlRange& c = controls_[held[k]];
      pose->values[held[k]] = c.min + (c.max - c.min) * random_.Unit();
    }
  }

  // Few controls or many: real poses are both. What is laid over a clip stays smaller, the clip's own motion
  // is there already.
  void MoveMany(SampledPose* pose) {
    const std::size_t n = controls_.size();
    const double share = random_.Unit();
    const std::size_t most = pose->clip >= 0 ? 4 : std::max<std::size_t>(4, n / 4);
    const std::size_t active = 1 + static_cast<std::size_t>(share * share * static_cast<double>(most));
    const double reach = pose->clip >= 0 ? 0.5 : 1.0;
    for (std::size_t k = 0; k < active; ++k) Move(random_.Below(n), reach * random_.Unit(), pose);
    if (random_.Unit() < 0.5) return;
    for (std::size_t i = 0; i < n; ++i) {
      if (controls_[i].often) Move(i, random_.Unit(), pose);
    }
  }

 private:
  // side: the end that it turns to, or either end or anywhere.
  double Folded(const ControlRange& c, bool turned, std::optional<bool> side) {
    const double up = c.max - c.rest, down = c.rest - c.min;
    const bool one_way = std::min(up, down) <= kOneWay * std::max(up, down);
    if (!one_way && (!turned || (!side && random_.Unit() < 0.5)))
      return c.rest + (c.min + (c.max - c.min) * random_.Unit() - c.rest) * (turned ? 1 : kLittle);
    const double end = (one_way ? up > down : side ? *side : random_.Unit() < 0.5) ? c.max : c.min;
    return c.rest + (end - c.rest) * (1 - kShortOfEnd * random_.Unit());
  }
  // `count` different numbers below n.
  std::vector<std::size_t> Some(std::size_t n, std::size_t count) {
    std::vector<std::size_t> all(n);
    std::iota(all.begin(), all.end(), std::size_t{0});
    for (std::size_t k = 0; k < count; ++k) std::swap(all[k], all[k + random_.Below(n - k)]);
    all.resize(count);
    return all;
  }
  void Move(std::size_t i, double amount, SampledPose* pose) {
    const ControlRange& c = controls_[i];
    const double end = random_.Unit() < (c.max - c.rest) / std::max(c.max - c.min, 1e-300) ? c.max : c.min;
    pose->values[i] = c.rest + (end - c.rest) * amount;
  }
  void MoveSome(std::size_t most, double reach, SampledPose* pose) {
    const std::size_t active = random_.Below(most + 1);
    for (std::size_t k = 0; k < active; ++k)
      Move(random_.Below(controls_.size()), reach * random_.Unit(), pose);
  }

  const std::vector<ControlRange>& controls_;
  const ClipPoses& clip_poses_;
  Random random_;
};

// `count` poses; none without controls. draw: takes one away from rest, and knows whether its number is odd.
template <typename Draw>
std::vector<SampledPose> FromRest(const std::vector<ControlRange>& controls, std::size_t count,
                                  std::uint64_t seed, const Draw& draw) {
  Sampler sampler(controls, {}, seed);
  std::vector<SampledPose> poses(controls.empty() ? 0 : count, sampler.Rest());
  for (std::size_t p = 0; p < poses.size(); ++p) draw(&sampler, p % 2 == 1, &poses[p]);
  return poses;
}

// At most `count` of the poses, each as far as possible from those before it: what is rare in a clip (a
// blink) is not rare among them. Distances in shares of the controls' ranges.
ClipPoses Different(const ClipPoses& poses, const std::vector<ControlRange>& controls, std::size_t count) {
  ClipPoses chosen;
  std::vector<double> distance(poses.size(), std::numeric_limits<double>::max());
  const std::vector<double>* last = nullptr;
  std::vector<double> rest;
  for (const ControlRange& c : controls) rest.push_back(c.rest);
  while (chosen.size() < std::min(count, poses.size())) {
    const std::vector<double>& from = last == nullptr ? rest : *last;
    std::size_t best = 0;
    for (std::size_t p = 0; p < poses.size(); ++p) {
      double squared = 0;
      for (std::size_t i = 0; i < controls.size(); ++i) {
        const double d = (poses[p][i] - from[i]) / std::max(controls[i].max - controls[i].min, 1e-300);
        squared += d * d;
      }
      distance[p] = std::min(distance[p], squared);
      if (distance[p] > distance[best]) best = p;
    }
    if (!(distance[best] > 0)) break;
    last = &poses[best];
    chosen.push_back(poses[best]);
  }
  return chosen;
}

}  // namespace

std::vector<SampledPose> Sweeps(const std::vector<ControlRange>& controls) {
  std::vector<SampledPose> poses;
  for (std::size_t i = 0; i < controls.size(); ++i) {
    for (const double end : {controls[i].min, controls[i].max}) {
      SampledPose& pose = poses.emplace_back();
      for (const ControlRange& control : controls) pose.values.push_back(control.rest);
      pose.values[i] = end;
    }
  }
  return poses;
}

std::vector<SampledPose> SamplePoses(const std::vector<ControlRange>& controls, const ClipPoses& clip_poses,
                                     const ControlGroups& groups, std::size_t clips, std::size_t count,
                                     std::uint64_t seed) {
  const ClipPoses frames = Different(clip_poses, controls, kClipFrames);
  Sampler sampler(controls, frames, seed);
  std::vector<SampledPose> poses;
  for (std::size_t p = 0; p < count; ++p) {
    SampledPose pose = sampler.Rest();
    if (!frames.empty() && p % 20 < 9) {
      sampler.MixFrames(&pose);
      pose.near_clips = true;
    } else if (!groups.empty() && p % 20 < 13) {
      sampler.MixGroups(groups, &pose);
    } else {
      if (clips > 0 && (p % 2 == 0 || controls.empty())) {
        pose.clip = static_cast<int>(sampler.random().Below(clips));
        pose.phase = sampler.random().Unit();
        pose.near_clips = true;
      }
      if (!controls.empty()) sampler.MoveMany(&pose);
    }
    poses.push_back(std::move(pose));
  }
  return poses;
}

std::vector<SampledPose> PosesTogether(const std::vector<ControlRange>& controls, std::size_t count,
                                       std::uint64_t seed) {
  return FromRest(controls, count, seed,
                  [](Sampler* of, bool, SampledPose* pose) { of->MoveTogether(pose); });
}
std::vector<SampledPose> PosesFolded(const std::vector<ControlRange>& controls,
                                     std::span<const Branch> branches, std::size_t count,
                                     std::uint64_t seed) {
  return FromRest(controls, count, seed,
                  [&](Sampler* of, bool odd, SampledPose* pose) { of->Fold(branches, odd, pose); });
}
std::vector<SampledPose> PosesWithMany(const std::vector<ControlRange>& controls, std::size_t count,
                                       std::uint64_t seed) {
  return FromRest(controls, count, seed,
                  [](Sampler* of, bool odd, SampledPose* pose) { of->MoveManyAnywhere(odd, pose); });
}

std::vector<std::size_t> HeldControls(const std::vector<ControlRange>& controls,
                                      const ClipPoses& clip_poses) {
  std::vector<std::size_t> held;
  if (clip_poses.empty()) return held;
  for (std::size_t c = 0; c < controls.size(); ++c) {
    const ControlRange& control = controls[c];
    const double moves = kMoves * (control.max - control.min);
    const auto stands = [&](const std::vector<double>& pose) {
      return std::abs(pose[c] - control.rest) <= moves;
    };
    if (control.max > control.min && !control.by_clip && std::ranges::all_of(clip_poses, stands))
      held.push_back(c);
  }
  return held;
}

std::vector<SampledPose> PosesAlone(const std::vector<ControlRange>& controls,
                                    std::span<const std::size_t> held, std::size_t each, std::size_t clips,
                                    std::uint64_t seed) {
  Sampler sampler(controls, {}, seed);
  std::vector<SampledPose> poses;
  for (const std::size_t c : held) {
    const ControlRange& control = controls[c];
    for (std::size_t k = 0; k < each; ++k) {
      SampledPose& pose = poses.emplace_back(sampler.Rest());
      pose.kind = PoseKind::kHeld;
      pose.clip = static_cast<int>(sampler.random().Below(clips));
      pose.phase = sampler.random().Unit();
      const bool up = control.min == control.rest || (control.max != control.rest && k % 2 == 0);
      const double reach = k % 4 < 2 ? 1 : 0.7 + 0.3 * sampler.random().Unit();
      pose.values[c] = control.rest + ((up ? control.max : control.min) - control.rest) * reach;
    }
  }
  return poses;
}

std::vector<SampledPose> PosesOfKind(PoseKind kind, const std::vector<ControlRange>& controls,
                                     const ClipPoses& clip_poses, const ControlGroups& groups,
                                     std::size_t clips, std::size_t count, std::uint64_t seed) {
  if (kind == PoseKind::kSampled) return SamplePoses(controls, clip_poses, groups, clips, count, seed);
  std::vector<SampledPose> poses;
  if (controls.empty() || (kind == PoseKind::kNeighbours && groups.empty())) return poses;
  const std::vector<std::size_t> held =
      kind == PoseKind::kHeld ? HeldControls(controls, clip_poses) : std::vector<std::size_t>();
  if (kind == PoseKind::kHeld && (held.empty() || clips == 0)) return poses;
  if (kind == PoseKind::kBeyond) poses = SamplePoses(controls, clip_poses, groups, clips, count, seed);
  Sampler sampler(controls, clip_poses, ~seed);
  poses.resize(count, sampler.Rest());
  for (std::size_t p = 0; p < poses.size(); ++p) {
    SampledPose& pose = poses[p];
    pose.kind = kind;
    switch (kind) {
      case PoseKind::kMixture:
        sampler.Mixture(&pose);
        break;
      case PoseKind::kNeighbours:
        sampler.Neighbours(groups, &pose);
        break;
      case PoseKind::kHeld:
        sampler.Hold(held, p, clips, &pose);
        break;
      default:
        sampler.Beyond(&pose);
    }
  }
  return poses;
}

}  // namespace kpsa::engine
