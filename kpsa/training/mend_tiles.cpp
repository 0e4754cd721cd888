#include "kpsa/training/mend_tiles.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <utility>

#include "base/matrix.h"
#include "base/parallel.h"
#include "kpsa/training/cue_values.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kFewestPoses = 200;  // that points are judged by; a third of them of the clips
constexpr std::size_t kMostBytes = std::size_t{320} << 20;  // of these
constexpr std::size_t kMostMendedPoints = 8;
// Tolerances: points that are farther off in frames of the clips are mended, or without clips in other poses, which count
// half: what these do far out, clips hardly ever do
constexpr double kOff = 0.5, kOfSamples = 0.5;
constexpr double kBetter = 0.7;                   // of what they were off, in poses that were not fitted to
constexpr std::size_t kHeldOut = 4;               // of so many poses, one
constexpr double kRidges[] = {1e-7, 1e-5, 1e-3};  // of the variance of a cue

struct Points {
  PoseMatrix rows, inner;    // as they come out, with what is measured; and before the last steps
  std::size_t of_clips = 0;  // poses, the first ones
};

Status Record(TrainingSetup* setup, const std::vector<Compiler::SplitPoints>& split, Points* to) {
  TrainingRig rig = setup->rig;
  rig.split = split;
  PoseRecorder recorder(rig, &setup->compiler, {}, {}, setup->inverse_rest_stretch, setup->options.tolerance);
  Result<PoseLayout> layout = recorder.Layout();
  if (!layout.ok()) return layout.status();
  to->inner = PoseMatrix(*layout);
  const std::size_t bytes = sizeof(float) * (setup->layout.columns() + layout->columns());
  const std::size_t poses = std::min(kMendPoses, kMostBytes / bytes);
  if (poses < kFewestPoses) return Status();
  std::size_t frames = 0;
  for (const TrainingClip& clip : setup->clips) frames += clip.times.size();
  const std::size_t every = frames / (poses / 3) + 1;
  for (const TrainingClip& clip : setup->clips) {
    TrainingClip some{clip.name, {}, clip.learnt};
    for (std::size_t f = 0; f < clip.times.size(); f += every) some.times.push_back(clip.times[f]);
    if (some.times.empty()) continue;
    KPSA_RETURN_IF_ERROR(setup->recorder->AddClip(some, &to->rows));
    KPSA_RETURN_IF_ERROR(recorder.AddClip(some, &to->inner));
  }
  to->of_clips = to->rows.poses();
  const std::vector<SampledPose> sampled = setup->sampler->Of(PoseKind::kSampled, poses - to->of_clips,
                                                              setup->options.seed ^ 0x3c6ef372fe94f82bull);
  KPSA_RETURN_IF_ERROR(setup->recorder->AddSamples(sampled, setup->clips, &to->rows));
  return recorder.AddSamples(sampled, setup->clips, &to->inner);
}

// How far off each point is, worst pose of the clips first, then of the others.
struct Off {
  std::vector<float> clips, samples;
  bool has_clips = false;
  double of(std::size_t point) const {
    return has_clips ? static_cast<double>(clips[point]) : kOfSamples * static_cast<double>(samples[point]);
  }
};

Double3 At(ConstPointsView points, std::size_t i) {
  return {static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
          static_cast<double>(points.z[i])};
}
Double3 At(std::span<const float> row, std::size_t i) {
  return {static_cast<double>(row[3 * i]), static_cast<double>(row[3 * i + 1]),
          static_cast<double>(row[3 * i + 2])};
}

// y of each pose, and how far off each point of all outputs is.
Off Judge(const Subspace& subspace, const CueSet& cues, const Points& points, Eigen::MatrixXf* y) {
  const PoseLayout& layout = points.rows.layout();
  y->resize(static_cast<Eigen::Index>(subspace.rows()), static_cast<Eigen::Index>(points.rows.poses()));
  Off off{std::vector<float>(layout.points, 0), std::vector<float>(layout.points, 0), points.of_clips > 0};
  std::mutex mutex;
  ParallelFor(points.rows.poses(), 16, [&](std::size_t begin, std::size_t end) {
    SubspaceScratch scratch(subspace);
    std::vector<double> raw(subspace.rows());
    std::vector<PointBuffer> buffers;
    for (const SubspaceOutput& output : subspace.outputs) buffers.emplace_back(output.points);
    Off own{std::vector<float>(layout.points, 0), std::vector<float>(layout.points, 0)};
    for (std::size_t t = begin; t < end; ++t) {
      const std::span<const float> row = points.rows.row(t);
      CueReader reader(layout, row, nullptr);
      std::size_t r = 0;
      for (const CueRef& cue : cues.cues) {
        reader.Read(cue, raw.data() + r);
        r += CueHeight(layout, cue);
      }
      Measure(subspace, raw, &scratch);
      std::copy_n(scratch.y.data(), subspace.rows(), y->col(static_cast<Eigen::Index>(t)).data());
      std::size_t first = 0;
      for (std::size_t m = 0; m < buffers.size(); ++m) {
        subspace.tiles[m].Reconstruct(scratch.inputs(), buffers[m].view());
        const ConstPointsView made = std::as_const(buffers[m]).view();
        std::vector<float>& worst = t < points.of_clips ? own.clips : own.samples;
        for (std::size_t i = 0; i < made.count; ++i) {
          const auto error = static_cast<float>(Length(At(made, i) - At(row, first + i)));
          worst[first + i] = std::max(worst[first + i], error);
        }
        first += made.count;
      }
    }
    const std::lock_guard lock(mutex);
    for (std::size_t i = 0; i < layout.points; ++i) {
      off.clips[i] = std::max(off.clips[i], own.clips[i]);
      off.samples[i] = std::max(off.samples[i], own.samples[i]);
    }
  });
  return off;
}

// One tile: its poses, as its map sees them.
class Mender {
 public:
  Mender(const Subspace& subspace, const Points& points, const Eigen::MatrixXf& y, const LastStep& step,
         std::size_t first_point, std::size_t first_inner)
      : subspace_(subspace),
        points_(points),
        y_(y),
        step_(step),
        first_point_(first_point),
        first_inner_(first_inner) {}

  // Fits to some poses, or to all of them.
  TileMend Fit(Index output, Index tile, std::vector<Index> of, double ridge, bool all) const {
    const TileMap& tiles = subspace_.tiles[output];
    TileMend mend{output, tile, std::move(of), {}, {}, {}};
    mend.inner = step_.Bind(PointSet::Of(mend.points, static_cast<Index>(step_.points())))->inner();
    const auto cues = tiles.CuesOf(tile);
    const auto n = static_cast<Eigen::Index>(mend.inner.size()), j = static_cast<Eigen::Index>(cues.size());
    std::vector<std::size_t> poses;
    for (std::size_t t = 0; t < points_.rows.poses(); ++t) {
      if (all || t % kHeldOut != kHeldOut - 1) poses.push_back(t);
    }
    Eigen::MatrixXd x(static_cast<Eigen::Index>(poses.size()), j), target(x.rows(), 3 * n);
    for (Eigen::Index k = 0; k < x.rows(); ++k) {
      const std::size_t t = poses[static_cast<std::size_t>(k)];
      const float* y = y_.col(static_cast<Eigen::Index>(t)).data();
      for (Eigen::Index c = 0; c < j; ++c)
        x(k, c) = static_cast<double>(y[cues[static_cast<std::size_t>(c)]]);
      Matrix4 joint;
      const bool moved = tiles.JointOf(tile, y, &joint);
      const Matrix4 back = moved ? InverseOrIdentity(joint) : Matrix4();
      for (Eigen::Index i = 0; i < n; ++i) {
        Double3 at = At(points_.inner.row(t), first_inner_ + mend.inner[static_cast<std::size_t>(i)]);
        if (moved) at = TransformPoint(back, at);
        target(k, i) = at.x, target(k, n + i) = at.y, target(k, 2 * n + i) = at.z;
      }
    }
    const Eigen::RowVectorXd mean_x = x.colwise().mean(), mean = target.colwise().mean();
    x.rowwise() -= mean_x, target.rowwise() -= mean;
    Eigen::MatrixXd gram = x.transpose() * x;
    gram.diagonal().array() += ridge * static_cast<double>(x.rows());
    const Eigen::MatrixXd map = Eigen::LDLT<Eigen::MatrixXd>(gram).solve(x.transpose() * target);  // [j x 3n]
    const Eigen::RowVectorXd start = mean - mean_x * map;
    for (Eigen::Index r = 0; r < 3 * n; ++r) mend.mean.push_back(static_cast<float>(start[r]));
    for (Eigen::Index c = 0; c < j; ++c) {
      for (Eigen::Index r = 0; r < 3 * n; ++r) mend.map.push_back(static_cast<float>(map(c, r)));
    }
    return mend;
  }

  // How far off its points are in the poses that Fit leaves out, mended and as they were.
  void Compare(const TileMend& mend, std::vector<double>* mended, std::vector<double>* before) const {
    const TileMap& tiles = subspace_.tiles[mend.output];
    const PointSet of = PointSet::Of(mend.points, static_cast<Index>(step_.points()));
    const BoundMends bound({&mend, 1}, tiles, mend.output, of, step_);
    AlignedFloats scratch(bound.scratch_floats());
    PointBuffer made(mend.points.size()), whole(tiles.points());
    mended->assign(mend.points.size(), 0), before->assign(mend.points.size(), 0);
    for (std::size_t t = kHeldOut - 1; t < points_.rows.poses(); t += kHeldOut) {
      const auto y = y_.col(static_cast<Eigen::Index>(t));
      bound.Run(tiles, y.data(), nullptr, made.view(), scratch.span());
      const Index only[] = {mend.tile};
      const PointsView all = whole.view();
      tiles.ReconstructBlock({y.data(), static_cast<std::size_t>(y.size())}, {&all, 1}, only);
      const double weight = t < points_.of_clips ? 1 : kOfSamples;
      for (std::size_t k = 0; k < mend.points.size(); ++k) {
        const Double3 exact = At(points_.rows.row(t), first_point_ + mend.points[k]);
        (*mended)[k] = std::max((*mended)[k], weight * Length(At(std::as_const(made).view(), k) - exact));
        (*before)[k] =
            std::max((*before)[k], weight * Length(At(std::as_const(whole).view(), mend.points[k]) - exact));
      }
    }
  }

  // Those of the points that it makes better; none: nothing.
  std::optional<TileMend> Mend(Index output, Index tile, std::vector<Index> points) const {
    while (!points.empty()) {
      double least = std::numeric_limits<double>::infinity(), ridge = 0;
      std::vector<Index> better;
      for (const double tried : kRidges) {
        const TileMend mend = Fit(output, tile, points, tried, false);
        std::vector<double> mended, before;
        Compare(mend, &mended, &before);
        const double worst = *std::ranges::max_element(mended);
        if (worst >= least) continue;
        least = worst, ridge = tried;
        better.clear();
        for (std::size_t k = 0; k < points.size(); ++k) {
          if (mended[k] < kBetter * before[k]) better.push_back(points[k]);
        }
      }
      if (better.size() == points.size()) return Fit(output, tile, std::move(points), ridge, true);
      points = std::move(better);
    }
    return std::nullopt;
  }

 private:
  const Subspace& subspace_;
  const Points& points_;
  const Eigen::MatrixXf& y_;
  const LastStep& step_;
  std::size_t first_point_, first_inner_;
};

}  // namespace

Status MendTiles(TrainingSetup* setup, const std::vector<Compiler::SplitPoints>& split, const CueSet& cues,
                 Subspace* subspace) {
  Points points{PoseMatrix(setup->layout), PoseMatrix(setup->layout)};
  KPSA_RETURN_IF_ERROR(Record(setup, split, &points));
  if (points.rows.poses() == 0) return Status();
  Eigen::MatrixXf y;
  const Off off = Judge(*subspace, cues, points, &y);
  std::size_t first_point = 0, first_inner = 0;
  for (std::size_t m = 0; m < subspace->outputs.size(); ++m) {
    const std::size_t count = subspace->outputs[m].points;
    const LastStep* const step = split[m].step.get();
    std::vector<Index> worst;
    for (Index p = 0; step != nullptr && p < count; ++p) {
      if (off.of(first_point + p) > kOff * setup->options.tolerance) worst.push_back(p);
    }
    std::ranges::stable_sort(worst, std::greater<>(), [&](Index p) { return off.of(first_point + p); });
    worst.resize(std::min(worst.size(), kMostMendedPoints));
    std::ranges::sort(worst);
    for (std::size_t k = 0; k < worst.size();) {
      const auto tile = static_cast<Index>(worst[k] / kTilePoints);
      std::vector<Index> of_tile;
      for (; k < worst.size() && worst[k] / kTilePoints == tile; ++k) of_tile.push_back(worst[k]);
      const Mender mender(*subspace, points, y, *step, first_point, first_inner);
      std::optional<TileMend> mend = mender.Mend(static_cast<Index>(m), tile, std::move(of_tile));
      if (mend) subspace->mends.push_back(std::move(*mend));
    }
    first_point += count, first_inner += step == nullptr ? count : step->inner_points();
  }
  return setup->rig.set_clip(std::nullopt);
}

}  // namespace kpsa::engine
