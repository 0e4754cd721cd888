#include "kpsa/training/trained_ranges.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kpsa/training/signal_noise.h"
#include "kpsa/training/signal_reach.h"

namespace kpsa::engine {
namespace {

// Of the tolerance, as displacements of points: what an entry may do unnoticed; an entry that moved less than
// `kHardlyMoved` in training has its guard fully there after `kStillRamp`, others after `kLeastRamp` at
// least.
constexpr double kSlackShare = 0.05, kHardlyMoved = 2, kStillRamp = 1, kLeastRamp = 0.25;
constexpr double kNoise = 1e-5;      // of an entry, and of 1
constexpr double kStillTurn = 5e-4;  // of light: a turn (radians) of a joint that is none
constexpr std::array<double, 4> kParts = {0.0, 0.25, 0.5, 0.75};  // of a frame: clips are looked at there
constexpr std::size_t kMostPlayed = 4096;
constexpr double kTrainedBeyond = 0.5;  // of kBeyondShare: the rest of the way the guards come in

}  // namespace

void RangeFinder::Widen(const PoseMatrix& poses) {
  for (std::size_t t = 0; t < poses.poses(); ++t) Widen(poses.row(t).subspan(layout_.scalar_begin()));
}

void RangeFinder::Widen(std::span<const float> scalars) {
  if (lo_.empty()) {
    lo_.assign(scalars.begin(), scalars.end());
    hi_ = lo_;
  }
  Widen(0, scalars);
}

void RangeFinder::Widen(const RangeFinder& others) {
  if (others.lo_.empty()) return;
  for (const std::vector<double>* end : {&others.lo_, &others.hi_}) {
    const std::vector<float> scalars(end->begin(), end->end());
    Widen(scalars);
  }
}

void RangeFinder::Widen(Index first, std::span<const float> scalars) {
  for (std::size_t e = 0; e < scalars.size(); ++e) {
    const std::size_t i = static_cast<std::size_t>(first) + e;
    lo_[i] = std::min<double>(lo_[i], scalars[e]);
    hi_[i] = std::max<double>(hi_[i], scalars[e]);
  }
}

void RangeFinder::Plays(const PoseMatrix& poses) {
  Widen(poses);
  for (std::size_t t = 0; t < poses.poses(); ++t) {
    const std::span<const float> scalars = poses.row(t).subspan(layout_.scalar_begin());
    played_->emplace_back(scalars.begin(), scalars.end());
  }
}

Status RangeFinder::Widen(const std::vector<TrainingClip>& clips, PoseRecorder* recorder) {
  std::size_t frames = 0, frame = 0;
  for (const TrainingClip& clip : clips) frames += clip.times.size();
  const std::size_t apart = 1 + frames / kMostPlayed;
  for (const TrainingClip& clip : clips) {
    TrainingClip fine{clip.name, {}};
    for (std::size_t i = 0; i < clip.times.size(); ++i) {
      const double next = clip.times[std::min(i + 1, clip.times.size() - 1)];
      for (const double part : kParts) fine.times.push_back(clip.times[i] + part * (next - clip.times[i]));
    }
    std::size_t time = 0;
    KPSA_RETURN_IF_ERROR(recorder->VisitSignals(fine, [&](std::span<const float> entries) {
      Widen(entries);
      if (time++ % kParts.size() == 0 && frame++ % apart == 0)
        played_->emplace_back(entries.begin(), entries.end());
    }));
  }
  return Status();
}

bool RangeFinder::Moves(Index first, std::size_t count) const {
  const std::size_t begin = static_cast<std::size_t>(first);
  for (std::size_t e = begin; e < begin + count; ++e) {
    if (hi_[e] - lo_[e] > kNoise * std::max({1.0, std::fabs(lo_[e]), std::fabs(hi_[e])})) return true;
  }
  return false;
}

Result<std::vector<TrainedRange>> RangeFinder::Make(const TrainingRig& rig, Compiler* compiler,
                                                    const std::vector<Signal>& guards,
                                                    const Options& options) const {
  const bool of_light = rig.target.colors;
  std::vector<double> reach(lo_.size(), 0);
  if (!of_light) {
    Result<std::vector<double>> found =
        FindReach(rig, compiler, guards, options.inverse_rest_stretch, options.diagonal);
    if (!found.ok()) return found.status();
    reach = std::move(*found);
  }
  std::vector<TrainedRange> ranges;
  for (const Signal& signal : guards) {
    for (std::size_t e = 0; e < signal.entries(); ++e) {
      const std::size_t i = ranges.size();
      const double extent = hi_[i] - lo_[i], noticed = options.tolerance / reach[i];
      double slack = kSlackShare * noticed;
      // What hardly moved comes in slowly enough to be no jump; what did, within what calibration looks at
      double ramp = std::max(options.range_ramp * extent,
                             (extent < kHardlyMoved * noticed ? kStillRamp : kLeastRamp) * noticed);
      if (of_light) {
        slack = !signal.matrix ? 0 : e < 9 ? kStillTurn : kLightShift;
        ramp = std::max(options.range_ramp * extent, slack);
      }
      TrainedRange range = MakeTrainedRange(EntryName(signal, e), lo_[i], hi_[i], slack, ramp);
      if (!options.rest.empty()) {
        range.rest = options.rest[i];
        const double went = std::max({hi_[i] - range.rest, range.rest - lo_[i], 0.0});
        range.reach = went >= noticed ? went : 0;
      }
      ranges.push_back(std::move(range));
    }
  }
  return ranges;
}

void HalfAsFarBeyond(const std::vector<ControlRange>& controls, std::vector<SampledPose>* poses) {
  for (SampledPose& pose : *poses) {
    for (std::size_t c = 0; c < controls.size(); ++c) {
      double& value = pose.values[c];
      const double inside = std::clamp(value, controls[c].min, controls[c].max);
      value = inside + kTrainedBeyond * (value - inside);
    }
  }
}

TrainingClip WithTimesBetween(const TrainingClip& clip, double share) {
  TrainingClip dense{clip.name, {}};
  double due = 0, place = 0.5;
  for (std::size_t i = 0; i < clip.times.size(); ++i) {
    dense.times.push_back(clip.times[i]);
    due += share;
    if (i + 1 == clip.times.size() || due < 1) continue;
    due -= 1;
    dense.times.push_back(clip.times[i] + place * (clip.times[i + 1] - clip.times[i]));
    place = std::fmod(place + 0.6180339887498949, 1.0);
  }
  return dense;
}

}  // namespace kpsa::engine
