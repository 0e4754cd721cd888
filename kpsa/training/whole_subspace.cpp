#include "kpsa/training/whole_subspace.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/make_subspace.h"
#include "kpsa/training/tile_budgets.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kPartBytes = 700'000'000;  // of poses, of a part of the mesh

// The cues in terms of the layout of all points.
CueSet OfAllPoints(const TrainingRig& some, const TrainingSetup& whole, CueSet cues) {
  for (CueRef& cue : cues.cues) {
    if (cue.kind != CueKind::kOutput) continue;
    Index row = cue.index, first = 0;
    std::size_t mesh = 0;
    for (; row >= some.rows(mesh, whole.totals[mesh]); ++mesh) {
      row -= some.rows(mesh, whole.totals[mesh]);
      first += whole.totals[mesh];
    }
    cue.index = first + some.PointOf(mesh, row);
  }
  return cues;
}

// Training poses of some points of one mesh, with the scalars that they have anyway.
class Part {
 public:
  // The poses are those of `all`, recorded there by `recorder`; the first `of_mean` of them are centred by the mean.
  Part(const PoseMatrix& all, const Eigen::VectorXd& mean, std::size_t of_mean)
      : all_(all), mean_of_all_(mean), of_mean_(of_mean) {}

  Status Record(const TrainingRig& mesh, Compiler* compiler, const PointSet& points,
                const Matrix4& inverse_rest_stretch, const PoseRecorder& recorder) {
    PoseLayout layout = all_.layout();
    layout.points = points.size(), layout.stage_points = 0;
    poses_.emplace(layout);
    for (std::size_t t = 0; t < all_.poses(); ++t) poses_->AddPose();
    PoseRecorder of_points(mesh, compiler, {}, {}, inverse_rest_stretch);
    of_points.Only({points});
    const Result<PoseLayout> only_points = of_points.Layout();
    if (!only_points.ok()) return only_points.status();
    std::vector<const RecordedPose*> recorded;
    for (std::size_t t = 0; t < all_.poses(); ++t) recorded.push_back(&recorder.recorded(all_.origin(t)));
    KPSA_RETURN_IF_ERROR(
        of_points.Replay(recorded, [&](std::size_t t) { return poses_->row(t).first(layout.outputs()); }));
    FindMean();
    const std::size_t rest = layout.scalar_begin();
    for (std::size_t t = 0; t < all_.poses(); ++t)
      std::ranges::copy(all_.row(t).subspan(all_.layout().scalar_begin()),
                        poses_->row(t).begin() + static_cast<std::ptrdiff_t>(rest));
    Eigen::VectorXd of_points_alone = mean_;  // the scalars are centred
    of_points_alone.tail(static_cast<Eigen::Index>(layout.scalars)).setZero();
    poses_->Subtract(of_points_alone);
    return Status();
  }
  const PoseMatrix& poses() const { return *poses_; }
  const Eigen::VectorXd& mean() const { return mean_; }  // of all columns
  std::size_t outputs() const { return poses_->layout().outputs(); }

 private:
  void FindMean() {
    const PoseLayout& layout = poses_->layout();
    mean_.setZero(static_cast<Eigen::Index>(layout.columns()));
    ParallelFor(layout.outputs(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = 0; t < of_mean_; ++t) {
        const std::span<const float> row = std::as_const(*poses_).row(t);
        for (std::size_t i = begin; i < end; ++i)
          mean_[static_cast<Eigen::Index>(i)] += static_cast<double>(row[i]);
      }
    });
    mean_ /= static_cast<double>(of_mean_);
    const auto scalars = static_cast<Eigen::Index>(layout.scalars);
    mean_.tail(scalars) = mean_of_all_.tail(scalars);
  }

  const PoseMatrix& all_;
  const Eigen::VectorXd& mean_of_all_;
  const std::size_t of_mean_;
  std::optional<PoseMatrix> poses_;
  Eigen::VectorXd mean_;
};

// With cues for all points: the modes of any points are what the poses' coordinates say of them.
class ModesOfParts {
 public:
  ModesOfParts(const Pca& pca, const PoseMatrix& poses, const Estimator& estimator)
      : pca_(pca), estimator_(estimator) {
    const Eigen::MatrixXd coordinates =
        Multiply(GemmOperand::Poses(poses, 0, pca.poses, 0, pca.layout.outputs()),
                 GemmOperand::Dense(pca.output_modes()));  // U S [T x M]
    factor_ = coordinates * pca.singular.array().square().inverse().matrix().asDiagonal();
  }
  void Set(const PoseMatrix& part) {
    const std::size_t outputs = part.layout().outputs();
    const Eigen::MatrixXd modes = Multiply(GemmOperand::Poses(part, 0, pca_.poses, 0, outputs).Transposed(),
                                           GemmOperand::Dense(factor_));
    gain_ = Multiply(modes, estimator_.coordinates);
    left_out_ = -(modes.array().square().matrix() * pca_.mode_variance());
    for (std::size_t t = 0; t < pca_.poses; ++t)
      left_out_ += Eigen::Map<const Eigen::VectorXf>(part.row(t).data(), static_cast<Eigen::Index>(outputs))
                       .cast<double>()
                       .array()
                       .square()
                       .matrix() /
                   static_cast<double>(pca_.poses - 1);
    left_out_ = left_out_.cwiseMax(0.0);
  }
  TileModel Of(std::size_t first, std::size_t height) const {
    const auto begin = static_cast<Eigen::Index>(first), rows = static_cast<Eigen::Index>(height);
    TileModel model;
    model.columns.resize(static_cast<std::size_t>(gain_.cols()));
    std::iota(model.columns.begin(), model.columns.end(), 0u);
    model.gain = gain_.middleRows(begin, rows);
    model.covariance = estimator_.covariance;
    model.left_out = left_out_.segment(begin, rows).sum() / static_cast<double>(rows / 3);
    return model;
  }

 private:
  const Pca& pca_;
  const Estimator& estimator_;
  Eigen::MatrixXd factor_, gain_;  // [T x M], [3n x r]
  Eigen::VectorXd left_out_;
};

}  // namespace

WholeSubspace::WholeSubspace(const TrainingRig& rig, const TrainOptions& options,
                             const SubspaceCandidates& some)
    : some_(some),
      setup_(rig, some.setup->clips, options),
      candidates_(&setup_, some.poses, some.modes, some.record) {}

Result<Subspace> WholeSubspace::Make(const RangeFinder& ranges, CalibrationSize size) {
  KPSA_RETURN_IF_ERROR(setup_.Prepare());
  setup_.sampler = some_.setup->sampler, setup_.trained_sampler = some_.setup->trained_sampler;
  setup_.recorder->SetProducts(some_.setup->recorder->products());
  candidates_.by_tile = some_.by_tile, candidates_.fine = some_.fine;
  candidates_.ranges_of_tiles = some_.ranges_of_tiles;
  KPSA_RETURN_IF_ERROR(setup_.Say("all points", 0.96));
  Subspace subspace;
  KPSA_RETURN_IF_ERROR(MakeTiles(&subspace));
  for (PoseMatrix* poses : {&some_.poses->poses, &some_.poses->judges}) poses->Truncate(0);
  candidates_.Describe(&subspace);
  if (!setup_.options.without.patches) {
    KPSA_RETURN_IF_ERROR(setup_.rig.set_clip(std::nullopt));
    Result<PatchLayout> patches = PricePatches(setup_.rig, &setup_.compiler, setup_.totals);
    if (!patches.ok()) return patches.status();
    candidates_.patches = std::move(*patches);
  }
  const CandidateCalibrator calibrator{&candidates_, ranges, size};
  KPSA_RETURN_IF_ERROR(calibrator.Calibrate(&subspace));
  return subspace;
}

Status WholeSubspace::MakeTiles(Subspace* subspace) {
  const TrainingSetup& some = *some_.setup;
  const PoseMatrix& poses = some_.poses->poses;
  const TileStorage storage = some_.fine      ? TileStorage::kFinely
                              : some_.by_tile ? TileStorage::kOwnCues
                                              : TileStorage::kForAllPoints;
  const TileOptions budget = TileBudget(storage, setup_.options.tolerance);
  TileSubspace made;
  Estimator estimator;
  Eigen::MatrixXd measured;
  std::optional<ModesOfParts> modes;
  TileInputs inputs;
  if (some_.by_tile) {
    made.subspace.components = 3;
    made.subspace.score = {0, 1};
    made.cues = some_.tiles.cues;
    inputs = InputsOf(some_.tiles, poses, some_.poses->clip_poses);
  } else {
    estimator = MapEstimator(some_.modes->pca, some_.cues.set);
    measured = MeasuredPoses(some.layout, some_.cues.set, poses);
    made.subspace =
        MakeSubspace(some_.modes->pca, some_.cues.set, estimator, measured, some.Outputs(), budget);
    made.subspace.tiles.clear();
    made.cues = some_.cues.set;
    inputs.samples = SampledColumns(measured);
    if (!setup_.options.without.tile_products)
      inputs.poses = &poses, inputs.measured = &measured, inputs.clip_poses = some_.poses->clip_poses;
    modes.emplace(some_.modes->pca, poses, estimator);
  }
  const bool with_products = inputs.poses != nullptr;
  made.subspace.outputs = setup_.Outputs();

  const std::size_t tile_bytes = sizeof(float) * 3 * kTilePoints * poses.poses(),
                    at_once = std::max<std::size_t>(1, kPartBytes / tile_bytes);
  std::size_t first_some = 0;  // tile of some points
  for (std::size_t m = 0; m < setup_.totals.size(); ++m) {
    const std::size_t points = setup_.totals[m], tiles = (points + kTilePoints - 1) / kTilePoints;
    TrainingRig mesh = setup_.rig;
    mesh.target.meshes = {setup_.rig.target.meshes[m]};
    TileBuilder builder(3, static_cast<std::size_t>(made.cues.rows()));
    Eigen::VectorXd mean(static_cast<Eigen::Index>(3 * points));
    for (std::size_t first = 0; first < tiles; first += at_once) {
      const std::size_t begin = first * kTilePoints, end = std::min(begin + at_once * kTilePoints, points);
      std::vector<Index> members(end - begin);
      std::iota(members.begin(), members.end(), static_cast<Index>(begin));
      Part part(poses, some_.modes->pca.mean, some_.modes->pca.poses);
      KPSA_RETURN_IF_ERROR(part.Record(mesh, &setup_.compiler,
                                       PointSet::Of(members, static_cast<Index>(points)),
                                       setup_.inverse_rest_stretch, *some.recorder));
      mean.segment(static_cast<Eigen::Index>(3 * begin), static_cast<Eigen::Index>(part.outputs())) =
          part.mean().head(static_cast<Eigen::Index>(part.outputs()));
      if (modes) modes->Set(part.poses());
      TileCueOptions cue_options = some_.tiles.options;
      cue_options.mean = &part.mean();
      if (with_products) inputs.poses = &part.poses();
      const auto model = [&](std::size_t t) {
        TileCandidates of;
        of.first_column = 3 * kTilePoints * t;
        of.height = std::min(3 * kTilePoints, part.outputs() - of.first_column);
        if (modes) return modes->Of(of.first_column, of.height);
        return ModelOf(some_.tiles, first_some + (first + t) / some.rig.every, part.poses(), of, cue_options);
      };
      builder.Add((members.size() + kTilePoints - 1) / kTilePoints, model, inputs, budget);
      KPSA_RETURN_IF_ERROR(setup_.Say("all points", 0.96));
    }
    made.subspace.tiles.push_back(builder.Finish(mean, inputs));
    first_some += (some.rig.rows(m, setup_.totals[m]) + kTilePoints - 1) / kTilePoints;
  }
  if (some_.by_tile) FinishTiles(&made);
  *subspace = std::move(made.subspace);
  candidates_.cues.set = OfAllPoints(some.rig, setup_, std::move(made.cues));
  return setup_.rig.set_clip(std::nullopt);
}

}  // namespace kpsa::engine
