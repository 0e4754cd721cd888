#include "kpsa/training/range_margins.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

#include "kpsa/training/pose_judge.h"
#include "kpsa/training/random.h"

namespace kpsa::engine {
namespace {

constexpr double kMargins[] = {1.0 / 3, 1.0 / 6};  // of the range, the larger one first
constexpr double kClipOvershoot = 1.0 / 12;        // how far clips go beyond, where they do
constexpr std::size_t kOutsidePoses = 4;           // of each joint
constexpr std::size_t kPoses = 12;                 // that try a joint, each at its ends and beyond
constexpr std::size_t kMostPoses = 1600;           // of all joints: where there are many, fewer try each,
constexpr std::size_t kLeastPoses = 4;             // and with fewer than these none does
constexpr std::size_t kTriedAtOnce = 256;          // are held
constexpr double kGrowth = 1.1;                    // of the errors at the ends
constexpr double kMoreMisses = 0.01;               // of the poses, than expected: narrower margins are tried
constexpr double kClearlyCheaper = 0.95;  // of what a frame costs with the best so far: they are taken
constexpr std::uint64_t kSeed = 0x510e527fade682d1ull;

using Joint = std::vector<std::size_t>;  // controls

std::vector<Joint> JointsOf(const std::vector<ControlRange>& controls) {
  std::vector<Joint> joints;
  for (std::size_t c = 0; c < controls.size(); ++c) {
    const PlugRef& plug = controls[c].plug;
    if (!(controls[c].max > controls[c].min)) continue;
    if (joints.empty() || plug.element >= 0 || controls[joints.back()[0]].plug.node != plug.node)
      joints.emplace_back();
    joints.back().push_back(c);
  }
  return joints;
}

// One control at an end and `margin` beyond it; in every second pair of poses the others of the joint are
// anywhere as far.
void GoBeyond(const std::vector<ControlRange>& controls, const Joint& joint, std::size_t number,
              double margin, Random* random, SampledPose* pose) {
  for (std::size_t k = 0; k < joint.size(); ++k) {
    const ControlRange& c = controls[joint[k]];
    const double beyond = margin * (c.max - c.min), share = random->Unit();
    double& value = pose->values[joint[k]];
    if (k == number / 2 % joint.size()) {
      value = c.max > c.rest && (number % 2 == 0 || c.min == c.rest) ? c.max + beyond : c.min - beyond;
    } else if (number % 4 >= 2) {
      value = c.min - beyond + share * (c.max - c.min + 2 * beyond);
    }
    value = std::clamp(value, c.lowest, c.highest);
  }
}

class MarginFinder {
 public:
  MarginFinder(const Calibrator& of, const CalibrationWork& work, const CueSet& cues,
               const Subspace& subspace)
      : of_(of),
        work_(work),
        controls_(work.sampler->drawn()),
        joints_(JointsOf(controls_)),
        judge_(of.rig, subspace, of.layout, cues, !of.options.without.trust) {}

  Result<FoundMargins> Run() {
    careful_.of_controls.assign(controls_.size(), 0);
    told_ = careful_;
    told_.told_by_doubts = true;
    each_ = std::min(kPoses, kMostPoses / std::max<std::size_t>(joints_.size(), 1));
    FoundMargins found{{careful_}, {}, {}};
    if (each_ < kLeastPoses) return found;
    drawn_ = work_.sampler->Of(PoseKind::kSampled, each_ * joints_.size(), of_.options.seed ^ kSeed);
    std::vector<std::size_t> all(joints_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    std::vector<std::size_t> left = all;
    std::vector<char> is_told(joints_.size(), 0);
    const Result<std::vector<Tried>> ends = Try(left, 0, each_);
    if (!ends.ok()) return ends.status();
    for (const double margin : kMargins) {
      const Result<std::vector<Tried>> tried = Try(left, margin, each_);
      if (!tried.ok()) return tried.status();
      std::vector<std::size_t> too_far;
      for (std::size_t k = 0; k < left.size(); ++k) {
        const std::size_t j = left[k];
        const Tried &beyond = (*tried)[k], &end = (*ends)[j];
        const double least = std::max(of_.options.tolerance, kGrowth * end.error);
        if (!is_told[j] && beyond.ErrorUpTo(kGrowth * end.doubt) <= least) {
          is_told[j] = 1;
          Take(beyond, j, margin, &told_);
        }
        if (beyond.error <= least) {
          Take(beyond, j, margin, &careful_);
        } else {
          too_far.push_back(j);
        }
      }
      left = std::move(too_far);
    }
    for (RangeMargins* wider : {&careful_, &told_}) {
      if (wider->of_controls != found.sets.back().of_controls) found.sets.push_back(std::move(*wider));
    }
    if (found.sets.size() == 1) return found;
    Result<std::vector<Tried>> outside = Try(all, kClipOvershoot, std::min(kOutsidePoses, each_));
    if (!outside.ok()) return outside.status();
    for (Tried& of_joint : *outside) {
      for (JudgedPose& pose : of_joint.poses)
        found.outside.push_back({std::move(pose), 0, static_cast<int>(PoseKind::kBeyond)});
      std::ranges::move(of_joint.entries, std::back_inserter(found.entries));
    }
    return found;
  }

 private:
  struct Tried {
    double error = 0, doubt = 0;  // the largest
    std::vector<JudgedPose> poses;
    std::vector<std::vector<float>> entries;  // of the signals, by pose

    double ErrorUpTo(double most_doubt) const {
      double largest = 0;
      for (const JudgedPose& pose : poses)
        largest = std::max(largest, pose.doubt <= most_doubt ? pose.error : 0);
      return largest;
    }
  };
  void Take(const Tried& beyond, std::size_t joint, double margin, RangeMargins* margins) const {
    margins->entries.insert(margins->entries.end(), beyond.entries.begin(), beyond.entries.end());
    for (const std::size_t c : joints_[joint]) margins->of_controls[c] = margin;
  }
  Result<std::vector<Tried>> Try(const std::vector<std::size_t>& joints, double margin, std::size_t each) {
    std::vector<SampledPose> poses;
    for (const std::size_t j : joints) {
      Random random(kSeed ^ j);
      for (std::size_t k = 0; k < each; ++k) {
        SampledPose& pose = poses.emplace_back(drawn_[j * each_ + k]);
        pose.clip = -1;  // which would have its way
        GoBeyond(controls_, joints_[j], k, margin, &random, &pose);
      }
    }
    std::vector<Tried> tried(joints.size());
    for (std::size_t first = 0; first < poses.size(); first += kTriedAtOnce) {
      const auto begin = poses.begin() + static_cast<std::ptrdiff_t>(first);
      const std::size_t count = std::min(kTriedAtOnce, poses.size() - first);
      PoseMatrix recorded(of_.layout);
      KPSA_RETURN_IF_ERROR(work_.recorder->AddSamples({begin, begin + static_cast<std::ptrdiff_t>(count)},
                                                      of_.clips, &recorded));
      const std::vector<JudgedPose> judged = judge_.Judge(recorded);
      for (std::size_t t = 0; t < count; ++t) {
        Tried& of = tried[(first + t) / each];
        of.error = std::max(of.error, judged[t].error);
        of.doubt = std::max(of.doubt, judged[t].doubt);
        of.poses.push_back(judged[t]);
        const std::span<const float> row = std::as_const(recorded).row(t).subspan(of_.layout.scalar_begin());
        of.entries.emplace_back(row.begin(), row.end());
      }
    }
    return tried;
  }

  const Calibrator& of_;
  const CalibrationWork& work_;
  const std::vector<ControlRange>& controls_;
  const std::vector<Joint> joints_;
  PoseJudge judge_;
  std::size_t each_ = 0;
  std::vector<SampledPose> drawn_;  // so many a joint
  RangeMargins careful_, told_;
};

}  // namespace

Result<FoundMargins> FindMargins(const Calibrator& of, const CalibrationWork& work, const CueSet& cues,
                                 const Subspace& subspace) {
  return MarginFinder(of, work, cues, subspace).Run();
}

Result<std::size_t> NarrowByCalibration(std::size_t chosen, std::span<const ExpectedOfMargins> expected,
                                        const std::function<Result<double>(std::size_t)>& missed) {
  std::size_t best = chosen;
  double least = 0, more = 0;  // cost, and how many more miss than expected
  for (std::size_t set = chosen;; --set) {
    const Result<double> share = missed(set);
    if (!share.ok()) return share.status();
    const double of_set = *share - expected[set].misses, cost = expected[set].cost + of_set;
    if (set == chosen || cost <= kClearlyCheaper * least) best = set, least = cost, more = of_set;
    if (more <= kMoreMisses || set == 0) return best;
  }
}

}  // namespace kpsa::engine
