#include "kpsa/training/trainer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kpsa/space_frame.h"
#include "kpsa/training/calibrate_subspace.h"
#include "kpsa/training/cue_choice.h"
#include "kpsa/training/cue_description.h"
#include "kpsa/training/cue_places.h"
#include "kpsa/training/frame_cost.h"
#include "kpsa/training/make_subspace.h"
#include "kpsa/training/miss_samples.h"
#include "kpsa/training/mode_choice.h"
#include "kpsa/training/pca.h"
#include "kpsa/training/pose_judge.h"
#include "kpsa/training/pose_recorder.h"
#include "kpsa/training/signal_noise.h"
#include "kpsa/training/tile_budgets.h"
#include "kpsa/training/tile_builder.h"
#include "kpsa/training/tile_candidates.h"
#include "kpsa/training/tile_learning.h"
#include "kpsa/training/tile_subspace.h"
#include "kpsa/training/tilts.h"
#include "kpsa/training/time_limit.h"
#include "kpsa/training/trained_ranges.h"
#include "kpsa/training/training_sampler.h"
#include "kpsa/training/training_signals.h"
#include "kpsa/training/training_trials.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kStillRows = 12;    // that are measured where nothing moves in the space
constexpr std::size_t kBetween = 400;     // poses between the frames of all clips, at most
constexpr std::size_t kJudgeOfLight = 5;  // of so many poses, one
constexpr int kMaxLightModes = 120;       // that are looked at; noise is beyond
constexpr double kManyMisses = 0.05;      // of new poses: cues of each tile are tried
constexpr double kFewMisses = 0.01;       // likewise: finer tiles for these
constexpr double kWorthTrying = 0.35;     // of what a frame costs: what others could save
constexpr double kHopelessTiles = 0.3;    // not for cues of tiles that miss so many
constexpr double kTooManyMisses = 0.15;   // and cues as for half the tolerance
constexpr double kTilesInModes = 3.5;     // how long these take, in the time that modes took
constexpr double kClearly = 0.5;          // of the expected cost of the others: cues of tiles are taken
constexpr double kLess = 0.95;            // likewise, where the others are as fine
constexpr double kTurnReach = 0.03;  // of the diagonal: how far an entry of a rotation moves points, about
constexpr std::size_t kCueProducts = 160;  // cues that are products of others

class Trainer {
 public:
  Trainer(const TrainingRig& rig, const std::vector<TrainingClip>& clips, const TrainOptions& options)
      : rig_(WithTilts(rig)),
        drawn_(rig.controls),
        clips_(clips),
        trained_clips_(clips.begin(), std::ranges::find_if(clips,
                                                           [&](const TrainingClip& clip) {
                                                             return options.by_tile_as_before && clip.learnt;
                                                           })),
        options_(options),
        limit_(options.seconds) {}

  Result<Subspace> Run() {
    record_.seed = options_.seed;
    record_.mode = options_.mode == EstimatorMode::kMap ? "map" : "paper";
    record_.asked = {options_.samples,
                     options_.calibration_poses,
                     options_.rows,
                     static_cast<std::size_t>(options_.max_modes),
                     options_.mode == EstimatorMode::kPaper ? options_.key_points : options_.min_points,
                     options_.may_have_cues_by_tile};
    for (const TrainingClip& clip : clips_) {
      if (clip.learnt) record_.learnt.emplace_back(clip.name, clip.times);
      if (!clip.learnt) record_.clips.push_back(clip.name);
    }
    record_.learnt_poses = options_.learnt_poses;
    KPSA_RETURN_IF_ERROR(Prepare());
    PoseMatrix poses(layout_), judges(layout_);
    KPSA_RETURN_IF_ERROR(RecordPoses(&poses, &judges));
    if (!of_light() && FitIntoTime(&poses, &record_.clip_poses, &limit_))
      record_.sampled_poses = poses.poses() - record_.clip_poses;
    KPSA_RETURN_IF_ERROR(Say("modes", 0.45));
    clip_poses_ = record_.clip_poses;
    if (!of_light()) spare_ = SpareForModes(&poses, &clip_poses_);
    const double before_modes = limit_.elapsed();
    if (layout_.products > 0) ChooseProducts(&poses, &judges);
    ranges_ = RangeFinder(layout_);
    ranges_.Widen(poses);
    if (spare_) ranges_.Widen(*spare_);
    for (const PoseMatrix& learnt : learnt_) ranges_.Widen(learnt);
    if (!of_light()) KPSA_RETURN_IF_ERROR(ranges_.Widen(clips_, recorder_.get()));
    if (of_light() && options_.mode == EstimatorMode::kMap) judges = poses.TakeEvery(kJudgeOfLight);
    KPSA_RETURN_IF_ERROR(FindModes(&poses));
    modes_seconds_ = limit_.elapsed() - before_modes;
    KPSA_RETURN_IF_ERROR(CenterAndChooseCues(poses, judges, options_.tolerance));
    KPSA_RETURN_IF_ERROR(Say("subspace", 0.85));
    if (!of_light() && options_.mode == EstimatorMode::kMap && !options_.without.patches) {
      KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
      Result<PatchLayout> patches = PricePatches(rig_, &compiler_, totals_, positions_);
      if (!patches.ok()) return patches.status();
      patches_ = std::move(*patches);
    }
    Result<Subspace> subspace = Assemble(&poses, judges);
    if (!subspace.ok()) return subspace;
    KPSA_RETURN_IF_ERROR(Say("calibration", 0.95));
    calibration_ = CalibrationWithin(pose_seconds_, options_, &limit_);
    KPSA_RETURN_IF_ERROR(Calibrate(&*subspace));
    if (!of_light() && options_.mode == EstimatorMode::kMap && !options_.without.miss_costs &&
        calibration_.margins && IsWorthTrying(cost_) && (!fine_ || cost_.lost() > kTooManyMisses) &&
        limit_.left() > modes_seconds_)
      KPSA_RETURN_IF_ERROR(TryFiner(&poses, judges, &*subspace));
    KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
    record_.signature =
        RigSignature(*rig_.graph, rig_.target.outputs(), rig_.target.space, rig_.target.controls);
    for (const PlugRef& control : rig_.target.controls)
      record_.controls.push_back(rig_.graph->PlugName(control));
    for (std::size_t c = drawn_.size(); c < rig_.controls.size(); ++c)
      record_.controls.push_back(rig_.graph->PlugName(rig_.controls[c].plug));
    record_.limited = limit_.left_out();
    subspace->rig_hash = SignatureDigest(record_.signature);
    subspace->training = TrainingJson(record_);
    KPSA_RETURN_IF_ERROR(ValidateSubspace(*subspace));
    return subspace;
  }

 private:
  Status Say(const char* what, double share) { return SayStage(options_, what, share); }

  Status Prepare() {
    KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
    Result<std::vector<Index>> totals = PointTotals(rig_, &compiler_);
    if (!totals.ok()) return totals.status();
    totals_ = std::move(*totals);
    std::vector<CandidateStage> candidates;
    if (options_.mode == EstimatorMode::kMap) {  // the paper's key points are output points
      Result<CuePlaces> places = FindCuePlaces(rig_, &compiler_, totals_, options_.max_light_candidates);
      if (!places.ok()) return places.status();
      candidates = std::move(places->stages);
      places_ = std::move(places->places);
      of_tiles_ = std::move(places->of_tiles);
      full_cost_ = places->full_cost;
    }

    const bool of_map = !of_light() && options_.mode == EstimatorMode::kMap;
    Result<TrainingSignals> found =
        FindTrainingSignals(rig_, &compiler_, clips_, of_map && !options_.without.relative_matrices);
    if (!found.ok()) return found.status();
    guards_ = std::move(found->watched);
    std::vector<Signal> signals = guards_;
    signals.insert(signals.end(), found->relative.begin(), found->relative.end());
    for (const PlugRef& space : rig_.target.space) {
      const Result<Value> rest = compiler_.Rest(*rig_.graph, space);
      if (!rest.ok()) return rest.status();
      inverse_rest_stretch_ = InverseRestStretch(rest->get<Matrix4>());
    }
    recorder_ = std::make_unique<PoseRecorder>(rig_, &compiler_, std::move(candidates), std::move(signals),
                                               inverse_rest_stretch_);
    Result<PoseLayout> layout =
        recorder_->Layout(of_map && !options_.without.cue_products ? kCueProducts : 0);
    if (!layout.ok()) return layout.status();
    layout_ = *layout;
    sampler_ = std::make_shared<TrainingSampler>(rig_, drawn_, clips_, options_, recorder_.get(), layout_);
    trained_sampler_ = sampler_;
    if (options_.by_tile_as_before)
      trained_sampler_ =
          std::make_shared<TrainingSampler>(rig_, drawn_, trained_clips_, options_, recorder_.get(), layout_);
    return Status();
  }

  // To train on, and, where cues have places to choose from, to judge these by.
  Status RecordPoses(PoseMatrix* poses, PoseMatrix* judges) {
    const double before = limit_.elapsed();
    std::size_t frames = 0;
    for (const TrainingClip& clip : trained_clips_) frames += clip.times.size();
    const double between =
        of_light() ? 0 : std::min(1.0, static_cast<double>(kBetween) / static_cast<double>(frames + 1));
    for (std::size_t c = 0; c < trained_clips_.size(); ++c) {
      KPSA_RETURN_IF_ERROR(
          Say("poses", 0.2 * static_cast<double>(c) / static_cast<double>(trained_clips_.size())));
      KPSA_RETURN_IF_ERROR(recorder_->AddClip(WithTimesBetween(trained_clips_[c], between), poses));
    }
    record_.clip_poses = poses->poses();
    KPSA_RETURN_IF_ERROR(Say("poses", 0.2));
    const Result<std::vector<SampledPose>> learnt = SamplesOf(options_.learnt_poses, rig_, clips_);
    if (!learnt.ok()) return learnt.status();
    if (options_.by_tile_as_before) {
      for (std::size_t c = trained_clips_.size(); c < clips_.size(); ++c) {
        learnt_.emplace_back(layout_);
        KPSA_RETURN_IF_ERROR(recorder_->AddClip(WithTimesBetween(clips_[c], 1), &learnt_.back()));
      }
      learnt_.emplace_back(layout_);
      KPSA_RETURN_IF_ERROR(recorder_->AddSamples(*learnt, clips_, &learnt_.back()));
    } else {
      KPSA_RETURN_IF_ERROR(recorder_->AddSamples(*learnt, clips_, poses));
    }
    KPSA_RETURN_IF_ERROR(sampler_->LearnHowControlsMove());
    if (options_.by_tile_as_before) KPSA_RETURN_IF_ERROR(trained_sampler_->LearnHowControlsMove());
    KPSA_RETURN_IF_ERROR(trained_sampler_->AddTraining(poses));
    record_.sampled_poses = poses->poses() - record_.clip_poses;
    if (poses->poses() < 3)
      return Status::Invalid("{} training poses are too few: name clips or samples to train on",
                             poses->poses());
    KPSA_RETURN_IF_ERROR(Say("poses", 0.4));
    const std::size_t sweeps = rig_.controls.empty() ? 0 : sampler_->SweepsWithTilts().size();
    pose_seconds_ = (limit_.elapsed() - before) / static_cast<double>(poses->poses() + sweeps);
    // Light takes some of these away
    const bool compares =
        !of_light() && (places_.size() > 1 || (options_.may_have_cues_by_tile && !places_.empty()));
    return compares ? trained_sampler_->AddJudges(judges, &judge_kinds_) : Status();
  }

  // The largest step, and one that can be done without.
  bool HasTimeForTiles() {
    if (limit_.left() > kTilesInModes * modes_seconds_) return true;
    limit_.LeaveOut("no cues of each tile");
    return false;
  }

  // Products of scalars, which are cues as others are from here on.
  void ChooseProducts(PoseMatrix* poses, PoseMatrix* judges) {
    CueProductOptions options = ProductOptionsOf(recorder_->signals(), layout_, options_.tolerance);
    options.hinges = !options_.without.hinges;
    recorder_->SetProducts(ChooseCueProducts(*poses, options));
    for (PoseMatrix* matrix : {poses, judges}) {
      for (std::size_t t = 0; t < matrix->poses(); ++t)
        StoreProducts(recorder_->products(), layout_, matrix->row(t));
    }
  }

  bool of_light() const { return rig_.target.colors; }

  // As many modes as new poses confirm, and noise as new poses have it.
  void TruncateModes(const PoseMatrix& judges) {
    std::vector<CueRef> cues;
    const bool apart = layout_.stage_points > 0;  // from the pictures
    for (const Index point : GoldenSpread(apart ? layout_.stage_points : layout_.points,
                                          std::max<std::size_t>(options_.min_points, 100)))
      cues.push_back({apart ? CueKind::kStage : CueKind::kOutput, point});
    for (Index s = 0; s < layout_.scalars; ++s) cues.push_back({CueKind::kScalar, s});
    pca_ = TruncatedPca(pca_, ChooseModeCount(pca_, cues, noise_, judges));
    for (double& residual : pca_.row_residual)
      residual = HonestResidual(residual, pca_.poses, pca_.mode_count());
  }

  Status FindModes(PoseMatrix* poses) {
    const Eigen::VectorXd mean = poses->Mean();
    MeanShape shape = MeanShapeOf(layout_, mean);
    positions_ = std::move(shape.positions);
    diagonal_ = shape.diagonal;
    poses->Subtract(mean);
    for (PoseMatrix& learnt : learnt_) learnt.Subtract(mean);
    PcaOptions pca_options;
    pca_options.seed = options_.seed;
    pca_options.max_modes = options_.mode == EstimatorMode::kPaper ? static_cast<int>(options_.key_points / 2)
                                                                   : options_.max_modes;
    if (of_light()) pca_options.max_modes = std::min(pca_options.max_modes, kMaxLightModes);
    Result<Pca> pca = ComputePca(*poses, mean, pca_options);
    if (!pca.ok()) return pca.status();
    pca_ = std::move(*pca);
    still_ = !of_light() && options_.mode == EstimatorMode::kMap && IsStill(pca_, options_.tolerance);
    if (still_) pca_ = TruncatedPca(pca_, 1);
    noise_ = NoiseOf(recorder_->signals(), layout_, diagonal_, options_.tolerance, of_light());
    record_.diagonal = diagonal_;
    record_.motion_rms = std::sqrt(pca_.total_energy / static_cast<double>(poses->poses() * layout_.points));
    return Status();
  }

  Status CenterAndChooseCues(const PoseMatrix& poses, const PoseMatrix& judges, double tolerance) {
    PoseMatrix centered(layout_);
    centered.Append(judges);
    if (judges.poses() > 0) centered.Subtract(pca_.mean);
    if (of_light() && judges.poses() > 0) TruncateModes(centered);
    KPSA_RETURN_IF_ERROR(Say("cues", 0.7));
    return ChooseCues(poses, centered, tolerance);
  }

  Status ChooseCues(const PoseMatrix& poses, const PoseMatrix& judges, double tolerance) {
    CueChoiceOptions choice;
    choice.rows = still_ ? std::min<std::size_t>(kStillRows, options_.rows) : options_.rows;
    choice.min_points = still_ ? 1 : options_.min_points;
    choice.tolerance = tolerance;
    choice.by_rms = of_light();
    choice.places = places_;
    choice.judges = judges.poses() > 0 && !options_.without.miss_costs ? &judges : nullptr;
    choice.judge_kinds = judge_kinds_;
    KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
    Status priced;
    choice.points_cost = [&](std::span<const CueRef> cues) {
      const Result<double> cost = CostOfPoints(rig_, &compiler_, totals_, recorder_->candidates(), cues);
      if (!cost.ok()) priced = cost.status();
      return cost.ok() ? *cost : 0;
    };
    choice.miss_cost = full_cost_;
    choice.violation_rate = options_.violation_rate;
    if (of_light()) choice.max_outputs = options_.max_light_candidates;
    CueChoice chosen = options_.mode == EstimatorMode::kPaper
                           ? CueChoice{ChoosePaperCues(pca_, positions_, diagonal_)}
                           : kpsa::engine::ChooseCues(pca_, positions_, noise_, poses, choice);
    KPSA_RETURN_IF_ERROR(std::move(priced));
    if (chosen.cues.empty())
      return Status::Invalid("nothing moves in the training poses: no cue can be chosen");
    cues_ = MakeCueSet(pca_, chosen.cues, noise_);
    chosen_ = std::move(chosen);
    return Status();
  }

  std::vector<SubspaceOutput> Outputs() const {
    std::vector<SubspaceOutput> outputs;
    for (std::size_t m = 0; m < rig_.target.meshes.size(); ++m) {
      const AccelerationTarget::MeshPoints& mesh = rig_.target.meshes[m];
      outputs.push_back({mesh.name, totals_[m], of_light() ? "" : mesh.stages.back().name});
    }
    return outputs;
  }

  Subspace ForAllPoints(PoseMatrix* poses, bool fine) {
    const bool paper = options_.mode == EstimatorMode::kPaper;
    const Estimator estimator =
        paper ? LeastSquaresEstimator(pca_, cues_) : MapEstimator(pca_, cues_, !of_light());
    record_.warning = estimator.warning;
    const TileStorage coarse = of_light() ? TileStorage::kLight : TileStorage::kForAllPoints;
    return MakeSubspace(pca_, cues_, estimator, MeasuredPoses(layout_, cues_, *poses), Outputs(),
                        TileBudget(fine ? TileStorage::kFinely : coarse, options_.tolerance),
                        of_light() || paper || options_.without.tile_products ? nullptr : poses, clip_poses_);
  }

  Result<Subspace> Assemble(PoseMatrix* poses, const PoseMatrix& judges) {
    // Where few of the judges miss, but narrowly, a clip that nobody trained on may miss more
    const bool misses = options_.may_have_cues_by_tile && judges.poses() > 0 && !of_light() &&
                        std::max(chosen_.misses, chosen_.misses_of_stricter) > kManyMisses;
    Subspace subspace;
    if (misses && HasTimeForTiles()) {
      KPSA_RETURN_IF_ERROR(CompareWithTiles(poses, judges, &subspace));
    } else {
      fine_ = misses;
      subspace = ForAllPoints(poses, fine_);
    }
    Describe(&subspace);
    return subspace;
  }

  bool IsWorthTrying(const FrameCost& cost) const {
    return cost.lost() > kFewMisses && cost.lost() * full_cost_ > kWorthTrying * cost.ns;
  }

  // What misses is known from here on, and counts more than bytes: tiles stored finely, then cues as for half
  // the tolerance, which measure more of the points that are farthest off. The cheapest stays.
  Status TryFiner(PoseMatrix* poses, const PoseMatrix& judges, Subspace* subspace) {
    KPSA_RETURN_IF_ERROR(Say("finer tiles", 0.95));
    TrainingRecord before = record_;
    TrainingTrials trials(full_cost_);
    const auto add = [&](const char* what, Subspace tried) {
      const Result<double> points =
          CostOfPoints(rig_, &compiler_, totals_, recorder_->candidates(), cues_.cues);
      if (!points.ok()) return points.status();
      trials.Add(what, *points, {std::move(tried), cues_, record_, cost_});
      return Status();
    };
    const auto calibrated = [&](const char* what, Subspace now) {
      Describe(&now);
      record_ = before;
      KPSA_RETURN_IF_ERROR(Calibrate(&now));
      return add(what, std::move(now));
    };
    const auto again = [&](const char* what, bool finely = true) {
      Subspace now;
      if (by_tile_) {
        TileSubspace tiles = OfTiles(poses, finely);
        now = std::move(tiles.subspace), cues_ = std::move(tiles.cues);
      } else {
        now = ForAllPoints(poses, true);
      }
      return calibrated(what, std::move(now));
    };
    const char* const fine = by_tile_ ? kByTileFinely : kFinelyStored;
    KPSA_RETURN_IF_ERROR(add(fine_ ? fine : by_tile_ ? kByTile : kForAllPoints, std::move(*subspace)));
    bool may_be_for_all = by_tile_;
    if (by_tile_ && others_ns_ < trials.least_ns()) {  // calibration misses more than the judges of both did
      cues_ = MakeCueSet(pca_, chosen_.cues, noise_), may_be_for_all = false;
      KPSA_RETURN_IF_ERROR(calibrated(kFinelyStored, std::move(others_)));
    }
    if (!fine_ && IsWorthTrying(trials.least())) KPSA_RETURN_IF_ERROR(again(fine));
    if (may_be_for_all && trials.least().misses > kTooManyMisses) {
      cues_ = MakeCueSet(pca_, chosen_.cues, noise_), by_tile_ = false;
      KPSA_RETURN_IF_ERROR(again(kFinelyStored));
    }
    if (!by_tile_ && trials.least().misses > kTooManyMisses && limit_.left() > modes_seconds_) {
      KPSA_RETURN_IF_ERROR(CenterAndChooseCues(*poses, judges, options_.tolerance / 2));
      KPSA_RETURN_IF_ERROR(again(kForHalf));
    }
    // Cues of tiles, where nothing had said before that so many would miss
    if (!tried_tiles_ && options_.may_have_cues_by_tile && judges.poses() > 0 &&
        trials.least().misses > kManyMisses && HasTimeForTiles()) {
      const Result<bool> promising = ChooseTiles(poses);
      if (!promising.ok()) return promising.status();
      before.sampled_poses = record_.sampled_poses;
      by_tile_ = *promising;
      for (const bool finely : {false, true}) {
        if (!by_tile_ || (finely && cost_.lost() <= kFewMisses)) break;
        KPSA_RETURN_IF_ERROR(again(finely ? kByTileFinely : kByTile, finely));
      }
    }
    CalibratedSubspace best = trials.Take(std::move(before.tried));
    *subspace = std::move(best.subspace), cues_ = std::move(best.cues), record_ = std::move(best.record);
    cost_ = best.cost;
    return Status();
  }

  // What does not depend on how its cues were found.
  void Describe(Subspace* described) const {
    Subspace& subspace = *described;
    if (options_.keep_modes) subspace.kept_modes = KeptModesOf(pca_);
    if (options_.keep_modes)
      subspace.modes = subspace.soft_cache.modes = static_cast<std::size_t>(pca_.mode_count());
    subspace.mode = subspace.soft_cache.mode;  // paper mode may have fallen back
    subspace.space = rig_.target.space_name;
    subspace.inverse_rest_stretch = inverse_rest_stretch_;
    subspace.extent = of_light() ? 0 : diagonal_;
    if (of_light()) subspace.units = kLightUnits;
    subspace.tolerance = options_.tolerance;
    subspace.violation_rate = options_.violation_rate;
    subspace.cues.clear();
    for (const CueRef& cue : cues_.cues) subspace.cues.push_back(DescribeCue(rig_, *recorder_, totals_, cue));
  }

  // The subspace with which a frame is expected to cost less: with cues for all points, or of each tile.
  Status CompareWithTiles(PoseMatrix* poses, const PoseMatrix& judges, Subspace* subspace) {
    KPSA_RETURN_IF_ERROR(Say("cues of tiles", 0.8));
    const Result<bool> promising = ChooseTiles(poses);
    if (!promising.ok()) return promising.status();
    // Their doubts alone judge them; stored finely where poses miss
    TileSubspace tiles;
    FrameCost cost{.misses = 1, .ns = std::numeric_limits<double>::infinity()};
    std::size_t best = 0;
    for (const bool fine : {false, true}) {
      if (!*promising) break;
      TileSubspace made = OfTiles(poses, fine);
      if (made.subspace.doubt_inputs() == 0) break;
      const Result<FrameCost> priced = Price(&made.subspace, made.cues, judges);
      if (!priced.ok()) return priced.status();
      Tried(fine ? kByTileFinely : kByTile, made.cues, priced->misses, priced->ns);
      if (priced->ns < cost.ns) {
        cost = *priced, tiles = std::move(made), fine_ = fine;
        best = record_.tried.size() - 1;
      }
      if (!IsWorthTrying(cost) || cost.misses > kHopelessTiles) break;
    }
    // As chosen, without products of tiles: others with these would hardly do better, and take their time
    by_tile_ = cost.misses < kManyMisses && cost.ns < kClearly * chosen_.cost;
    if (by_tile_) {
      Tried(kForAllPoints, cues_, chosen_.misses, chosen_.cost);
    } else {
      KPSA_RETURN_IF_ERROR(Say("subspace", 0.87));
      *subspace = ForAllPoints(poses, true);
      const Result<FrameCost> others = Price(subspace, cues_, judges);
      if (!others.ok()) return others.status();
      by_tile_ = cost.ns < kLess * others->ns;
      Tried(kFinelyStored, cues_, others->misses, others->ns);
      if (!by_tile_) best = record_.tried.size() - 1, fine_ = true;
      if (by_tile_) others_ = std::move(*subspace), others_ns_ = others->ns;
    }
    record_.tried[best].taken = true;
    if (by_tile_) *subspace = std::move(tiles.subspace), cues_ = std::move(tiles.cues);
    return Status();
  }
  void Tried(const char* what, const CueSet& cues, double misses, double ns) {
    record_.tried.push_back(
        {what, cues.cues.size(), static_cast<std::size_t>(cues.rows()), misses, ns / full_cost_, false});
  }

  // With more poses, which regressions on few cues are glad of. Whether they may hit often enough.
  Result<bool> ChooseTiles(PoseMatrix* poses) {
    tried_tiles_ = true;
    PoseMatrix more(layout_);
    KPSA_RETURN_IF_ERROR(trained_sampler_->AddMore(*poses, &more));
    record_.sampled_poses += more.poses();
    if (more.poses() > 0) more.Subtract(pca_.mean);
    poses->Append(more);
    if (spare_) {
      spare_->Subtract(pca_.mean);
      poses->Append(*std::exchange(spare_, std::nullopt));
    }
    TileCandidateOptions of;
    of.layout = layout_, of.totals = totals_, of.signals = recorder_->signals();
    of.points = of_tiles_, of.positions = positions_, of.stages = recorder_->candidates();
    Result<std::vector<TileCandidates>> candidates = FindTileCandidates(rig_, &compiler_, trained_clips_, of);
    if (!candidates.ok()) return candidates.status();
    if (!learnt_.empty()) {
      Result<std::vector<TileCandidates>> learning = FindTileCandidates(rig_, &compiler_, clips_, of);
      if (!learning.ok()) return learning.status();
      learning_tiles_ = std::move(*learning);
    }
    TileCueOptions choice;
    choice.tolerance = options_.tolerance;
    choice.mean = &pca_.mean;
    choice.turn_reach = kTurnReach * diagonal_;
    const auto add = [&](Index scalar) {
      const CueRef cue{CueKind::kScalar, scalar};
      if (pca_.row_variance[static_cast<Eigen::Index>(CueColumn(layout_, cue))] > noise_.scalars[scalar])
        choice.values.push_back(cue);
    };
    const std::vector<Index> first = FirstScalars(recorder_->signals(), layout_);
    for (std::size_t s = 0; s < first.size(); ++s) {
      if (!recorder_->signals()[s].matrix) add(first[s]);
    }
    std::optional<TileChoice> chosen =
        ChoosePromisingTiles(pca_.mean, *poses, std::move(*candidates), choice);
    if (!chosen) return false;
    tiles_ = std::move(*chosen);
    return true;
  }
  TileSubspace OfTiles(PoseMatrix* poses, bool fine) const {
    const TileOptions storage =
        TileBudget(fine ? TileStorage::kFinely : TileStorage::kOwnCues, options_.tolerance);
    TileSubspace made = MakeTileSubspace(pca_.mean, *poses, clip_poses_, tiles_, Outputs(), storage);
    TeachClips(learnt_, learning_tiles_, {&pca_.mean, clip_poses_, tiles_.options, storage},
               options_.tolerance, poses, &made);
    return made;
  }

  // The subspace is given its best score by the judges, and is then priced.
  Result<FrameCost> Price(Subspace* subspace, const CueSet& cues, const PoseMatrix& judges) {
    const Result<double> points = CostOfPoints(rig_, &compiler_, totals_, recorder_->candidates(), cues.cues);
    if (!points.ok()) return points.status();
    GivePatches(patches_, subspace);
    std::vector<ScoreJudge> judged;
    for (const JudgedPose& pose : PoseJudge(*subspace, layout_, cues, !options_.without.trust).Judge(judges))
      judged.push_back({pose, 0, judge_kinds_[judged.size()]});
    subspace->tolerance = options_.tolerance;
    subspace->violation_rate = options_.violation_rate;
    return ChooseMisses(subspace, judged, *points, full_cost_, kCautious * options_.tolerance, kEvenOdds)
        .cost;
  }

  // Also says what a frame is expected to cost, but points.
  Status Calibrate(Subspace* subspace) {
    RangeFinder ranges = ranges_;  // its own margins beyond
    const Calibrator calibrator{rig_,        clips_,     options_,
                                guards_,     layout_,    patches_,
                                diagonal_,   full_cost_, inverse_rest_stretch_,
                                calibration_};
    const Result<FrameCost> cost = CalibrateSubspace(
        calibrator, {&compiler_, recorder_.get(), sampler_.get(), &ranges, &record_}, cues_, subspace);
    if (!cost.ok()) return cost.status();
    cost_ = *cost;
    return Status();
  }

  const TrainingRig rig_;                  // its controls are the rig's, then tilts
  const std::vector<ControlRange> drawn_;  // the rig's
  const std::vector<TrainingClip>& clips_;
  // Of these, what modes and tiles are made of: all, or those before the learnt ones
  const std::vector<TrainingClip> trained_clips_;
  const TrainOptions& options_;
  Compiler compiler_;
  std::unique_ptr<PoseRecorder> recorder_;
  std::shared_ptr<TrainingSampler> sampler_, trained_sampler_;  // the latter without what was learnt
  PoseLayout layout_;
  std::vector<Index> totals_;
  std::vector<CuePlace> places_;
  CuePlace of_tiles_;
  CueChoice chosen_;      // the cues for all points
  bool fine_ = false;     // tiles
  bool by_tile_ = false;  // its cues
  bool tried_tiles_ = false;
  bool still_ = false;  // nothing moves in the space
  Subspace others_;     // with cues for all points, where those of tiles were taken: not calibrated,
  double others_ns_ = std::numeric_limits<double>::infinity();  // and what it was expected to cost
  TileChoice tiles_;                                            // where they were tried
  std::vector<PoseMatrix> learnt_;  // TrainOptions::by_tile_as_before: of each clip, then posed
  std::vector<TileCandidates> learning_tiles_;
  PatchLayout patches_;  // what may miss by itself
  FrameCost cost_;       // by the last calibration, but points
  double full_cost_ = 0;
  TimeLimit limit_;
  double modes_seconds_ = 0, pose_seconds_ = 0;
  CalibrationSize calibration_;
  std::vector<Double3> positions_;
  std::vector<Signal> guards_;  // the recorder's first signals: relative matrices follow, which only measure
  RangeFinder ranges_;
  Matrix4 inverse_rest_stretch_;
  std::vector<int> judge_kinds_;
  std::optional<PoseMatrix> spare_;  // not for modes
  std::size_t clip_poses_ = 0;       // of those for modes, the first ones
  Pca pca_;
  CueSet cues_;
  double diagonal_ = 0;
  CueNoise noise_{0};
  TrainingRecord record_;
};

}  // namespace

Result<Subspace> Train(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                       const TrainOptions& options) {
  Result<Subspace> trained = Trainer(rig, clips, options).Run();
  if (!trained.ok() || !options.by_tile_as_before || trained->by_tile()) return trained;
  TrainOptions together = options;  // with cues for all points, what is learnt changes all of them
  together.by_tile_as_before = false;
  return Trainer(rig, clips, together).Run();
}

}  // namespace kpsa::engine
