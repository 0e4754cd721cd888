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
constexpr std::size_t kFoldedPoses = 200;  // besides
constexpr std::size_t kMostBytes = std::size_t{320} << 20;      // of these, at a time
constexpr std::size_t kMostMendedPoints = 8, kAPointOf = 2000;  // one of so many, where that is more
// Tolerances: points that are farther off in frames of the clips or in folded poses are mended, or without clips in drawn
// ones; all but clips count half: what they do far out, clips hardly ever do
constexpr double kOff = 0.5, kOfSamples = 0.5;
constexpr double kBetter = 0.7;                   // of what they were off, in poses that were not fitted to
constexpr std::size_t kHeldOut = 4;               // of so many poses, one
constexpr double kRidges[] = {1e-7, 1e-5, 1e-3};  // of the variance of a cue

// Poses that points are judged by, those of the clips first, the folded ones last: evaluated a few at a time.
class MendPoses {
 public:
  explicit MendPoses(TrainingSetup* setup) : setup_(setup) {
    std::size_t frames = 0;
    for (const TrainingClip& clip : setup->clips) frames += clip.times.size();
    const std::size_t every = frames / (kMendPoses / 3) + 1;
    for (const TrainingClip& clip : setup->clips) {
      for (std::size_t f = 0; f < clip.times.size(); f += every)
        poses_.push_back({clip.name, clip.times[f], {}});
    }
    of_clips_ = poses_.size();
    std::vector<SampledPose> sampled =
        setup->sampler->Of(PoseKind::kSampled, kMendPoses - std::min(kMendPoses, of_clips_),
                           setup->options.seed ^ 0x3c6ef372fe94f82bull);
    std::ranges::stable_sort(sampled, {}, &SampledPose::clip);
    for (const SampledPose& pose : sampled) poses_.push_back(RecordedOf(pose, setup->clips));
    folded_begin_ = poses_.size();
    for (const SampledPose& pose :
         setup->sampler->Folded(kFoldedPoses, setup->options.seed ^ 0x9b05688c2b3e6c1full))
      poses_.push_back(RecordedOf(pose, setup->clips));
  }
  std::size_t size() const { return poses_.size(); }
  std::size_t of_clips() const { return of_clips_; }
  std::size_t folded_begin() const { return folded_begin_; }

  // Rows of some recorders, each of the same poses; `use` gets them with the number of their first pose.
  Status Record(std::span<PoseRecorder* const> recorders,
                const std::function<void(std::size_t, std::span<const PoseMatrix>)>& use) const {
    std::size_t bytes = 0;
    for (const PoseRecorder* recorder : recorders) bytes += sizeof(float) * recorder->layout().columns();
    const std::size_t at_once = std::max<std::size_t>(1, kMostBytes / bytes);
    for (std::size_t first = 0; first < size(); first += at_once) {
      std::vector<const RecordedPose*> some;
      for (std::size_t t = first; t < std::min(first + at_once, size()); ++t) some.push_back(&poses_[t]);
      std::vector<PoseMatrix> rows;
      for (PoseRecorder* recorder : recorders) {
        PoseMatrix& to = rows.emplace_back(recorder->layout());
        for (std::size_t t = 0; t < some.size(); ++t) to.AddPose();
        KPSA_RETURN_IF_ERROR(recorder->Replay(some, [&](std::size_t t) { return to.row(t); }));
      }
      use(first, rows);
      KPSA_RETURN_IF_ERROR(setup_->Say("mended points", 0.99));
    }
    return Status();
  }

 private:
  TrainingSetup* setup_;
  std::vector<RecordedPose> poses_;
  std::size_t of_clips_ = 0, folded_begin_ = 0;
};

// Some points in all of these poses.
class SomePoints {
 public:
  // By number, ascending.
  SomePoints(std::vector<std::size_t> points, std::size_t poses)
      : points_(std::move(points)), at_(points_.size() * poses) {}
  void Store(std::size_t first, const PoseMatrix& rows) {
    for (std::size_t t = 0; t < rows.poses(); ++t) {
      for (std::size_t k = 0; k < points_.size(); ++k) {
        const float* from = rows.row(t).data() + 3 * points_[k];
        at_[(first + t) * points_.size() + k] = {static_cast<double>(from[0]), static_cast<double>(from[1]),
                                                 static_cast<double>(from[2])};
      }
    }
  }
  Double3 At(std::size_t pose, std::size_t point) const {
    const auto found = std::ranges::lower_bound(points_, point);
    return at_[pose * points_.size() + static_cast<std::size_t>(found - points_.begin())];
  }

 private:
  std::vector<std::size_t> points_;
  std::vector<Double3> at_;
};

struct Points {
  const MendPoses* poses;
  SomePoints out, inner;  // as they come out, and before the last steps; of all meshes
};

// How far off each point is, in the worst pose of the clips, of the drawn ones, and of the folded ones.
struct Off {
  std::vector<float> clips, samples, folded;
  bool has_clips = false;
  Off(std::size_t points, bool of_clips)
      : clips(points, 0), samples(points, 0), folded(points, 0), has_clips(of_clips) {}
  double InClips(std::size_t point) const {
    return has_clips ? static_cast<double>(clips[point]) : kOfSamples * static_cast<double>(samples[point]);
  }
  double Folded(std::size_t point) const { return kOfSamples * static_cast<double>(folded[point]); }
};

// Points [first, first + count) that are beyond `bound`, the farthest off first; numbers from `first` on.
std::vector<Index> FarthestOff(const Off& off, double (Off::*far)(std::size_t) const, std::size_t first,
                               std::size_t count, double bound) {
  std::vector<Index> worst;
  for (Index p = 0; p < count; ++p) {
    if ((off.*far)(first + p) > bound) worst.push_back(p);
  }
  std::ranges::stable_sort(worst, std::greater<>(), [&](Index p) { return (off.*far)(first + p); });
  return worst;
}

// Which of them are to be mended, ascending: of clips and of folded poses half each, where both have so many.
std::vector<Index> ToMend(const Off& off, std::size_t first, std::size_t count, double bound) {
  const std::size_t most = std::max(kMostMendedPoints, count / kAPointOf);
  std::vector<Index> points = FarthestOff(off, &Off::InClips, first, count, bound);
  const std::vector<Index> folded = FarthestOff(off, &Off::Folded, first, count, bound);
  points.resize(std::min(points.size(), most - std::min(folded.size(), most / 2)));
  for (const Index p : folded) {
    if (points.size() < most && std::ranges::find(points, p) == points.end()) points.push_back(p);
  }
  std::ranges::sort(points);
  return points;
}

Double3 At(ConstPointsView points, std::size_t i) {
  return {static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
          static_cast<double>(points.z[i])};
}
Double3 At(std::span<const float> row, std::size_t i) {
  return {static_cast<double>(row[3 * i]), static_cast<double>(row[3 * i + 1]),
          static_cast<double>(row[3 * i + 2])};
}

// y of the poses from `first_pose` on, and how far off each point of all outputs is.
void Judge(const Subspace& subspace, const CueSet& cues, const MendPoses& poses, const PoseMatrix& rows,
           std::size_t first_pose, Eigen::MatrixXf* y, Off* off) {
  const PoseLayout& layout = rows.layout();
  std::mutex mutex;
  ParallelFor(rows.poses(), 16, [&](std::size_t begin, std::size_t end) {
    SubspaceScratch scratch(subspace);
    std::vector<double> raw(subspace.rows());
    std::vector<PointBuffer> buffers;
    for (const SubspaceOutput& output : subspace.outputs) buffers.emplace_back(output.points);
    Off own(layout.points, off->has_clips);
    for (std::size_t t = begin; t < end; ++t) {
      const std::span<const float> row = rows.row(t);
      CueReader reader(layout, row, nullptr);
      std::size_t r = 0;
      for (const CueRef& cue : cues.cues) {
        reader.Read(cue, raw.data() + r);
        r += CueHeight(layout, cue);
      }
      Measure(subspace, raw, &scratch);
      std::copy_n(scratch.y.data(), subspace.rows(),
                  y->col(static_cast<Eigen::Index>(first_pose + t)).data());
      std::size_t first = 0;
      for (std::size_t m = 0; m < buffers.size(); ++m) {
        subspace.tiles[m].Reconstruct(scratch.inputs(), buffers[m].view());
        const ConstPointsView made = std::as_const(buffers[m]).view();
        const std::size_t pose = first_pose + t;
        std::vector<float>& worst = pose < poses.of_clips()       ? own.clips
                                    : pose < poses.folded_begin() ? own.samples
                                                                  : own.folded;
        for (std::size_t i = 0; i < made.count; ++i) {
          const auto error = static_cast<float>(Length(At(made, i) - At(row, first + i)));
          worst[first + i] = std::max(worst[first + i], error);
        }
        first += made.count;
      }
    }
    const std::lock_guard lock(mutex);
    for (std::size_t i = 0; i < layout.points; ++i) {
      off->clips[i] = std::max(off->clips[i], own.clips[i]);
      off->samples[i] = std::max(off->samples[i], own.samples[i]);
      off->folded[i] = std::max(off->folded[i], own.folded[i]);
    }
  });
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
    mend.inner = step_.InnerOf(PointSet::Of(mend.points, static_cast<Index>(step_.points())));
    const auto cues = tiles.CuesOf(tile);
    const auto n = static_cast<Eigen::Index>(mend.inner.size()), j = static_cast<Eigen::Index>(cues.size());
    std::vector<std::size_t> poses;
    for (std::size_t t = 0; t < points_.poses->size(); ++t) {
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
        Double3 at = points_.inner.At(t, first_inner_ + mend.inner[static_cast<std::size_t>(i)]);
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
    for (std::size_t t = kHeldOut - 1; t < points_.poses->size(); t += kHeldOut) {
      const auto y = y_.col(static_cast<Eigen::Index>(t));
      bound.Run(tiles, y.data(), nullptr, made.view(), scratch.span());
      const Index only[] = {mend.tile};
      const PointsView all = whole.view();
      tiles.ReconstructBlock({y.data(), static_cast<std::size_t>(y.size())}, {&all, 1}, only);
      const double weight = t < points_.poses->of_clips() ? 1 : kOfSamples;
      for (std::size_t k = 0; k < mend.points.size(); ++k) {
        const Double3 exact = points_.out.At(t, first_point_ + mend.points[k]);
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
  const MendPoses poses(setup);
  if (poses.size() < kFewestPoses) return Status();
  TrainingRig rig = setup->rig;
  rig.split = split;
  PoseRecorder of_inner(rig, &setup->compiler, {}, {}, setup->inverse_rest_stretch, setup->options.tolerance);
  KPSA_RETURN_IF_ERROR(of_inner.Layout().status());
  Eigen::MatrixXf y(static_cast<Eigen::Index>(subspace->rows()), static_cast<Eigen::Index>(poses.size()));
  Off off(setup->layout.points, poses.of_clips() > 0);
  PoseRecorder* const of_all[] = {setup->recorder.get()};
  KPSA_RETURN_IF_ERROR(poses.Record(of_all, [&](std::size_t first, std::span<const PoseMatrix> rows) {
    Judge(*subspace, cues, poses, rows[0], first, &y, &off);
  }));

  // What is farthest off, by tile, and what that takes
  std::vector<TileMend> wanted;
  std::vector<std::size_t> out, inner, first_points, first_inners;
  std::size_t first_point = 0, first_inner = 0;
  for (std::size_t m = 0; m < subspace->outputs.size(); ++m) {
    const std::size_t count = subspace->outputs[m].points;
    const LastStep* const step = split[m].step.get();
    const std::vector<Index> worst = step == nullptr
                                         ? std::vector<Index>()
                                         : ToMend(off, first_point, count, kOff * setup->options.tolerance);
    for (const Index point : worst) {
      const auto tile = static_cast<Index>(point / kTilePoints);
      if (wanted.empty() || wanted.back().output != m || wanted.back().tile != tile)
        wanted.push_back({static_cast<Index>(m), tile, {}, {}, {}, {}});
      wanted.back().points.push_back(point);
      out.push_back(first_point + point);
    }
    if (!worst.empty()) {
      const std::shared_ptr<const LastStep::Bound> bound =
          step->Bind(PointSet::Of(worst, static_cast<Index>(count)));
      for (const Index i : bound->inner()) inner.push_back(first_inner + i);
    }
    first_points.push_back(first_point), first_inners.push_back(first_inner);
    first_point += count, first_inner += step == nullptr ? count : step->inner_points();
  }
  if (wanted.empty()) return setup->rig.set_clip(std::nullopt);
  Points points{&poses, {std::move(out), poses.size()}, {std::move(inner), poses.size()}};
  PoseRecorder* const of_both[] = {setup->recorder.get(), &of_inner};
  KPSA_RETURN_IF_ERROR(poses.Record(of_both, [&](std::size_t first, std::span<const PoseMatrix> rows) {
    points.out.Store(first, rows[0]);
    points.inner.Store(first, rows[1]);
  }));
  for (TileMend& one : wanted) {
    const Mender mender(*subspace, points, y, *split[one.output].step, first_points[one.output],
                        first_inners[one.output]);
    std::optional<TileMend> mend = mender.Mend(one.output, one.tile, std::move(one.points));
    if (mend) subspace->mends.push_back(std::move(*mend));
  }
  return setup->rig.set_clip(std::nullopt);
}

}  // namespace kpsa::engine
