#include "kpsa/training/pose_judge.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "kpsa/training/cue_values.h"

namespace kpsa::engine {

CalibrationPair PairOf(const JudgedPose& pose, const ScoreMix& mix, const PatchLayout& layout, double guard,
                       int kind, std::span<const float> guards) {
  CalibrationPair pair{mix.Of(pose.measured, pose.doubt), pose.error, guard, kind};
  if (pose.patches.empty()) return pair;
  std::vector<PatchPair> patches;
  std::vector<double> scores;
  double guarded = 0;
  for (std::size_t p = 0; p < pose.patches.size(); ++p) {
    const PatchPair& patch = pose.patches[p];
    const double asked = guards.empty() ? 0 : static_cast<double>(guards[p]);
    guarded += asked / static_cast<double>(pose.patches.size());
    if (asked > 0) pair.guard = std::max(pair.guard, kSomeGuard);
    scores.push_back(asked >= 1 ? std::numeric_limits<double>::infinity()
                     : layout.blends_only
                         ? mix.doubt * patch.score
                         : mix.Of(pose.measured, PatchDoubt(layout, patch.score, pose.doubt)));
    if (asked < 1) patches.push_back({scores.back(), patch.error, asked});
  }
  pair.guard = std::max(pair.guard, WholeWeight(guarded));
  // As many as kWholeAt asks for have at least this one
  const auto half = static_cast<std::size_t>(std::ceil(kWholeAt * static_cast<double>(scores.size())));
  std::nth_element(scores.begin(), scores.begin() + static_cast<std::ptrdiff_t>(half - 1), scores.end(),
                   std::greater<>());
  // Guards that ask for so many ask for all points
  pair.blends_only = layout.blends_only;
  pair.middle = layout.blends_only || std::isinf(scores[half - 1]) ? pair.score : scores[half - 1];
  pair.patches = OutstandingPatches(std::move(patches));
  return pair;
}

namespace {

// Runs a last step on recorded and on reconstructed inner points.
class Finisher {
 public:
  Finisher(const SubspaceOutput& output, const LastStep::Bound& step)
      : step_(step), inner_(output.inner), out_(output.points), scratch_(step.scratch_floats()) {}
  // inner points as a row has them
  ConstPointsView Of(std::span<const float> row) {
    const PointsView to = inner_.view();
    for (std::size_t i = 0; i < to.count; ++i)
      to.x[i] = row[3 * i], to.y[i] = row[3 * i + 1], to.z[i] = row[3 * i + 2];
    return Of(std::as_const(inner_).view());
  }
  ConstPointsView Of(ConstPointsView inner) {
    step_.Run(inner, out_.view(), scratch_.span());
    return std::as_const(out_).view();
  }

 private:
  const LastStep::Bound& step_;
  PointBuffer inner_, out_;
  AlignedFloats scratch_;
};

}  // namespace

PoseJudge::PoseJudge(const TrainingRig& rig, const Subspace& subspace, const PoseLayout& layout,
                     const CueSet& cues, bool of_tiles)
    : subspace_(subspace), layout_(layout), cues_(cues), of_tiles_(of_tiles && subspace.doubt_inputs() > 0) {
  for (std::size_t m = 0; m < subspace.outputs.size(); ++m)
    steps_.push_back(subspace.outputs[m].inner == 0
                         ? nullptr
                         : rig.step(m)->Bind(PointSet::All(static_cast<Index>(subspace.outputs[m].points))));
  for (const SubspaceOutput& output : subspace.outputs) {
    std::vector<Index>& tile_of = tile_of_point_.emplace_back();
    for (Index i = 0; i < output.points; ++i) tile_of.push_back(static_cast<Index>(output.stepped.TileOf(i)));
  }
}

std::vector<JudgedPose> PoseJudge::Judge(const PoseMatrix& poses) {
  struct Errors {
    double largest = 0, largest_mean = 0, sum = 0;  // squared
  };
  std::vector<JudgedPose> pairs(poses.poses());
  std::vector<Errors> errors(poses.poses());
  SoftCacheThreshold always;
  always.tau = std::numeric_limits<double>::infinity();
  ParallelFor(poses.poses(), 16, [&](std::size_t begin, std::size_t end) {
    SubspaceScratch scratch(subspace_);
    std::vector<double> raw(subspace_.rows());
    std::vector<PointBuffer> buffers;
    for (const SubspaceOutput& output : subspace_.outputs) buffers.emplace_back(output.reconstructed());
    std::vector<Finisher> recorded, made;  // of outputs with last steps
    for (std::size_t m = 0; m < steps_.size(); ++m) {
      if (steps_[m] == nullptr) continue;
      recorded.emplace_back(subspace_.outputs[m], *steps_[m]);
      made.emplace_back(subspace_.outputs[m], *steps_[m]);
    }
    std::vector<float> doubts(subspace_.doubt_inputs() == 0 ? 0 : subspace_.tile_count()),
        of_tiles(subspace_.tile_count());
    std::vector<double> of_patches(subspace_.patches.patches);
    for (std::size_t t = begin; t < end; ++t) {
      const std::span<const float> row = poses.row(t);
      std::size_t r = 0;
      CueReader reader(layout_, row, nullptr);
      for (const CueRef& cue : cues_.cues) {
        reader.Read(cue, raw.data() + r);
        r += CueHeight(layout_, cue);
      }
      Measure(subspace_, raw, &scratch);
      if (subspace_.soft_cache.factor.size() > 0)
        pairs[t].measured =
            kpsa::engine::Judge(subspace_.soft_cache, always, scratch.y.span(), scratch.g.span()).score;
      if (scratch.t.size() > 0)
        pairs[t].doubt =
            static_cast<double>(LargestDoubt(subspace_, scratch.inputs(), scratch.t.span(), doubts).largest);
      std::ranges::fill(of_tiles, 0.0f);
      std::size_t column = 0, step = 0;
      float* of_tile = of_tiles.data();
      for (std::size_t m = 0; m < buffers.size(); ++m) {
        double output_sum = 0;
        subspace_.tiles[m].Reconstruct(scratch.inputs(), buffers[m].view());
        ConstPointsView p = std::as_const(buffers[m]).view();
        const std::span<const float> of_output = row.subspan(column, 3 * p.count);
        column += of_output.size();
        ConstPointsView exact;  // where it is not the row
        if (steps_[m] != nullptr) {
          exact = recorded[step].Of(of_output);
          p = made[step++].Of(p);
        }
        const std::vector<Index>& tile_of = tile_of_point_[m];
        for (std::size_t i = 0; i < p.count; ++i) {
          const Double3 at = steps_[m] != nullptr
                                 ? Double3{exact.x[i], exact.y[i], exact.z[i]}
                                 : Double3{of_output[3 * i], of_output[3 * i + 1], of_output[3 * i + 2]};
          const Double3 d = Double3{p.x[i], p.y[i], p.z[i]} - at;
          const double squared = Dot(d, d);
          output_sum += squared;
          errors[t].largest = std::max(errors[t].largest, squared);
          of_tile[tile_of[i]] = std::max(of_tile[tile_of[i]], static_cast<float>(squared));
        }
        of_tile += subspace_.tiles[m].tiles();
        errors[t].sum += output_sum;
        errors[t].largest_mean = std::max(
            errors[t].largest_mean, output_sum / static_cast<double>(std::max<std::size_t>(1, p.count)));
      }
      for (float& error : of_tiles) error = std::sqrt(error);
      if (!of_patches.empty()) {
        LargestOfPatches(subspace_, doubts, of_patches);
        for (const double doubt : of_patches) pairs[t].patches.push_back({doubt, 0});
        LargestOfPatches(subspace_, of_tiles, of_patches);
        for (std::size_t p = 0; p < of_patches.size(); ++p) pairs[t].patches[p].error = of_patches[p];
      }
      if (of_tiles_) pairs[t].tile_doubts = doubts, pairs[t].tile_errors = of_tiles;
      pairs[t].error = std::sqrt(subspace_.of_light() ? errors[t].largest_mean : errors[t].largest);
    }
  });
  for (const Errors& e : errors) {
    sum_ += e.sum;
    max_ = std::max(max_, std::sqrt(e.largest));
  }
  poses_ += poses.poses();
  return pairs;
}

double PoseJudge::rms() const {
  std::size_t points = 0;
  for (const SubspaceOutput& output : subspace_.outputs) points += output.points;
  return poses_ == 0 ? 0 : std::sqrt(sum_ / static_cast<double>(poses_ * points));
}

}  // namespace kpsa::engine
