#include "kpsa/training/one_training.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "kpsa/training/finer_subspaces.h"
#include "kpsa/training/mend_tiles.h"
#include "kpsa/training/training_signals.h"
#include "kpsa/training/transform_ranges.h"
#include "kpsa/training/untold_controls.h"
#include "kpsa/training/whole_subspace.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kJudgeOfLight = 5;  // of so many poses, one
// Of what a frame is expected to cost otherwise: what steps of some tiles may cost, since tiles have their cost besides
constexpr double kMostInSteps = 0.5;
// Of the points: fewer may be to blame where cues for all points are expected to cost less than that, of a full frame, or
// nobody knows
constexpr double kMostPoorOfCheap = 0.05, kCheapPoints = 0.2;
// Of the time so far, that is left where a training ends for another one: after cues for all points, and after a trial of
// tiles
constexpr double kToEnd = 2, kToEndEarly = 4;
// Of a full frame, that clips are expected to lose: points are looked for that a step should give instead
constexpr double kManyOfClips = 0.05;

// What was asked for.
TrainingRecord RecordOf(const std::vector<TrainingClip>& clips, const TrainOptions& options) {
  TrainingRecord record;
  record.seed = options.seed;
  record.mode = options.mode == EstimatorMode::kMap ? "map" : "paper";
  record.asked = {options.samples,
                  options.calibration_poses,
                  options.rows,
                  static_cast<std::size_t>(options.max_modes),
                  options.mode == EstimatorMode::kPaper ? options.key_points : options.min_points,
                  options.may_have_cues_by_tile};
  for (const TrainingClip& clip : clips) {
    if (clip.learnt) record.learnt.emplace_back(clip.name, clip.times);
    if (!clip.learnt) record.clips.push_back(clip.name);
  }
  record.learnt_poses = options.learnt_poses;
  return record;
}

// Of all poses as they were recorded.
Status FindRanges(TrainingSetup* setup, const TrainingPoses& poses, RangeFinder* ranges) {
  *ranges = RangeFinder(setup->layout);
  ranges->Widen(poses.poses);
  if (poses.spare) ranges->Widen(*poses.spare);
  for (const PoseMatrix& learnt : poses.learnt) ranges->Plays(learnt);
  if (setup->of_light()) return Status();
  KPSA_RETURN_IF_ERROR(
      WidenByTransforms(setup->rig, setup->guards, setup->layout, setup->recorder.get(), ranges));
  return ranges->Widen(setup->clips, setup->recorder.get());
}

// What is keyed to stay where it is moves with no clip.
std::vector<Signal> GuardsThatMove(const TrainingSetup& setup, const RangeFinder& ranges) {
  const std::vector<Index> first = FirstScalars(setup.recorder->signals(), setup.layout);
  std::vector<Signal> moved;
  for (std::size_t g = 0; g < setup.guards.size(); ++g) {
    if (ranges.Moves(first[g], setup.guards[g].entries())) moved.push_back(setup.guards[g]);
  }
  return moved;
}

// Which rig it was trained on.
void Sign(const TrainingSetup& setup, Subspace* subspace) {
  const TrainingRig& rig = setup.rig;
  subspace->rig.signature =
      RigSignature(*rig.graph, rig.target.outputs(), rig.target.space, rig.target.controls);
  subspace->rig_hash = SignatureDigest(subspace->rig.signature);
  std::vector<std::string>& controls = subspace->rig.controls;
  for (const PlugRef& control : rig.target.controls) controls.push_back(rig.graph->PlugName(control));
  for (std::size_t c = setup.drawn.size(); c < rig.controls.size(); ++c)
    controls.push_back(rig.graph->PlugName(rig.controls[c].plug));
}

// Mends what is farthest off, signs, and says what a frame costs. steps: as TrainOnce has them; pose_seconds: that a
// training pose took.
Result<Trained> FinishTraining(const std::vector<Compiler::SplitPoints>& steps, const TimeLimit& limit,
                               double pose_seconds, TrainingSetup* setup,
                               const SubspaceCandidates& candidates, TrainingRecord record,
                               Subspace subspace) {
  if (!steps.empty() && limit.left() > 2 * pose_seconds * static_cast<double>(kMendPoses)) {
    // Where a step is not as exact as a small tolerance asks, nothing is mended
    Status mended = MendTiles(setup, steps, candidates.cues.set, &subspace);
    if (mended.kind() == ErrorKind::kInterrupted) return mended;
  }
  Trained trained;
  const TrainOptions& options = setup->options;
  if (setup->of_map() && !setup->of_light() && setup->rig.some.empty() && options.may_leave_at_rest &&
      options.at_rest.empty()) {
    Result<std::vector<std::size_t>> untold = UntoldControls(setup, candidates.cues.set, subspace);
    if (!untold.ok()) return untold.status();
    trained.untold = std::move(*untold);
  }
  KPSA_RETURN_IF_ERROR(setup->rig.set_clip(std::nullopt));
  Sign(*setup, &subspace);
  record.limited = limit.left_out();
  const Result<double> points = setup->CostOfPoints(candidates.cues.set.cues);
  if (!points.ok()) return points.status();
  const double ns = *points + setup->CostOfSteps() + candidates.cost.ns;
  trained.subspace = std::move(subspace), trained.record = std::move(record);
  trained.ns = ns, trained.full_ns = setup->full_cost, trained.seconds = limit.elapsed();
  trained.wrong = candidates.cost.wrong;
  trained.lost = candidates.cost.lost(), trained.lost_of_clips = candidates.cost.lost_of_clips;
  return trained;
}

// The points of these rows, by mesh, as far as they come out.
std::vector<std::vector<Index>> PointsOfRows(const TrainingSetup& setup, std::span<const std::size_t> rows) {
  std::vector<std::vector<Index>> of_meshes(setup.totals.size());
  for (const std::size_t row : rows) {
    if (const auto found = setup.PointThatComesOut(row); found)
      of_meshes[found->first].push_back(found->second);
  }
  for (std::vector<Index>& points : of_meshes) std::ranges::sort(points);
  return of_meshes;
}

// And those that go through a step already.
void TellPoor(const TrainingSetup& setup, const Poor& poor, Trained* trained) {
  trained->poor = PointsOfRows(setup, poor.points);
  for (std::size_t m = 0; m < setup.rig.stepped.size(); ++m) {
    const std::vector<Index>& already = setup.rig.stepped[m].points;
    std::vector<Index>& points = trained->poor[m];
    points.insert(points.end(), already.begin(), already.end());
    std::ranges::sort(points);
  }
  trained->turned = PointsOfRows(setup, poor.turned);
}

// Of all meshes, where these have a step. cost: of a frame without them.
TileSteps StepsOfTiles(const TrainingSetup& setup, const std::vector<Compiler::SplitPoints>& steps,
                       double cost) {
  TileSteps tiles;
  tiles.most = kMostInSteps * cost;
  tiles.most_points = cost > kCheapPoints * setup.full_cost ? kMostPoor : kMostPoorOfCheap;
  for (std::size_t m = 0; m < setup.totals.size(); ++m) {
    const std::size_t count = (setup.rig.rows(m, setup.totals[m]) + kTilePoints - 1) / kTilePoints;
    const double ns = steps[m].step == nullptr ? 0 : static_cast<double>(steps[m].step->cost_ns());
    tiles.ns.insert(tiles.ns.end(), count, ns / static_cast<double>(count));
  }
  return tiles;
}

// It ends with points that are to blame, before anything else was looked for: others are taken that cost less than what is
// cheap.
Trained EndedEarly(const TrainingSetup& setup, const Poor& poor) {
  Trained trained;
  trained.ended = true;
  TellPoor(setup, poor, &trained);
  trained.held = setup.sampler->held();
  trained.ns = kCheapPoints * setup.full_cost / (kOfExpected * kAlikeOfMany);
  trained.full_ns = setup.full_cost, trained.seconds = setup.limit.elapsed();
  return trained;
}

}  // namespace

Result<Trained> TrainOnce(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                          const TrainOptions& options, const std::vector<Compiler::SplitPoints>& mends,
                          const Ends* ends) {
  TrainingSetup setup(rig, clips, options);
  TrainingRecord record = RecordOf(clips, options);
  KPSA_RETURN_IF_ERROR(setup.Prepare());

  // Poses
  TrainingPoses poses(setup.layout);
  KPSA_RETURN_IF_ERROR(RecordPoses(&setup, &poses, &record));
  FitPoses(&setup, &poses, &record);
  KPSA_RETURN_IF_ERROR(setup.Say("modes", 0.45));
  poses.clip_poses = record.clip_poses;
  if (!setup.of_light()) poses.spare = SpareForModes(&poses.poses, &poses.clip_poses);
  const double before_modes = setup.limit.elapsed();
  if (setup.layout.products > 0) ChooseProducts(&setup, &poses);
  RangeFinder ranges(setup.layout);
  KPSA_RETURN_IF_ERROR(FindRanges(&setup, poses, &ranges));
  if (!rig.controls.empty() && !setup.of_light()) {
    Result<std::vector<std::string>> alone =
        MovedByClipsAlone(setup.rig, &setup.compiler, clips, GuardsThatMove(setup, ranges));
    if (!alone.ok()) return alone.status();
    record.by_clips_alone = std::move(*alone);
  }
  if (setup.of_light() && setup.of_map()) poses.judges = poses.poses.TakeEvery(kJudgeOfLight);

  TrainingModes modes;
  CentrePoses(setup, &poses, &modes, &record);
  SubspaceCandidates candidates{&setup, &poses, &modes, &record};
  const bool of_points = !setup.of_light() && setup.of_map();
  if (of_points && !options.without.patches && rig.some.empty()) {
    KPSA_RETURN_IF_ERROR(setup.rig.set_clip(std::nullopt));
    Result<PatchLayout> patches = PricePatches(setup.rig, &setup.compiler, setup.totals);
    if (!patches.ok()) return patches.status();
    candidates.patches = std::move(*patches);
  }
  CandidateCalibrator calibrator{&candidates, ranges, {}};
  const auto calibrate = [&](Subspace* subspace) -> Status {
    KPSA_RETURN_IF_ERROR(setup.Say("calibration", 0.95));
    calibrator.size = CalibrationWithin(poses.pose_seconds, options, &setup.limit);
    KPSA_RETURN_IF_ERROR(calibrator.Calibrate(subspace));
    const FrameCost& cost = candidates.cost;
    if (of_points && !options.without.miss_costs && calibrator.size.margins &&
        candidates.IsWorthTrying(cost) &&
        (!candidates.fine || cost.lost() > kTooManyMisses || candidates.others_ns < cost.ns) &&
        setup.limit.left() > candidates.modes_seconds)
      return calibrator.TryFiner(subspace);
    return Status();
  };

  // Another training has to fit
  const auto may_end = [&](double times) {
    return ends != nullptr && setup.limit.left() > times * setup.limit.elapsed();
  };

  // Tiles alone
  std::optional<Subspace> made;
  if (candidates.MayBeginWithTiles()) {
    KPSA_RETURN_IF_ERROR(FindModes(setup, poses, true, &modes, &record));
    if (may_end(kToEndEarly) && ends->steps != nullptr)
      candidates.steps = StepsOfTiles(setup, *ends->steps, kCheapPoints * setup.full_cost);
    Result<std::optional<Subspace>> of_tiles = candidates.OfTilesAlone();
    if (!of_tiles.ok()) return of_tiles.status();
    if (!candidates.poor.empty()) return EndedEarly(setup, candidates.poor);
    candidates.steps = {};
    made = std::move(*of_tiles);
    candidates.modes_seconds = setup.limit.elapsed() - before_modes;
    if (made) KPSA_RETURN_IF_ERROR(calibrate(&*made));
    if (made && candidates.cost.lost() > kTooManyMisses) {
      candidates.LeaveTilesAlone();
      made.reset();
    }
  }
  // And cues for all points
  if (!made) {
    KPSA_RETURN_IF_ERROR(FindModes(setup, poses, candidates.by_tiles_alone(), &modes, &record));
    candidates.modes_seconds = setup.limit.elapsed() - before_modes;
    if (!candidates.by_tiles_alone())  // else nobody asks what all points would measure
      KPSA_RETURN_IF_ERROR(ChooseTrainingCues(options.tolerance, poses, &setup, &modes, &candidates.cues));
    const CueChoice& choice = candidates.cues.choice;
    const bool has_time = may_end(kToEnd);
    candidates.may_find_more = has_time && candidates.by_tiles_alone();
    if (has_time && ends->steps != nullptr) candidates.steps = StepsOfTiles(setup, *ends->steps, choice.cost);
    candidates.dear =
        ends != nullptr && choice.cost > ends->enough && !MissMany(choice) &&
        std::ranges::any_of(choice.cues, [](const CueRef& cue) { return cue.kind == CueKind::kOutput; });
    KPSA_RETURN_IF_ERROR(setup.Say("subspace", 0.85));
    Result<std::optional<Subspace>> best = candidates.Best();
    if (!best.ok()) return best.status();
    if (!*best) {
      if (candidates.by_tiles_alone() && !candidates.poor.empty()) {
        Trained trained;
        trained.ended = true;
        TellPoor(setup, candidates.poor, &trained);
        return trained;
      }
      if (candidates.by_tiles_alone()) return Status::Invalid("no cues of tiles serve");
      record.tried.push_back({kForAllPoints, choice.cues.size(),
                              static_cast<std::size_t>(candidates.cues.set.rows()), choice.misses,
                              choice.cost / setup.full_cost, false});
      Trained trained;
      trained.record = std::move(record), trained.ended = true, trained.held = setup.sampler->held();
      const Result<double> least = candidates.LeastForAllPoints();
      if (!least.ok()) return least.status();
      trained.ns = std::max(choice.cost, *least + choice.misses * setup.full_cost);
      trained.full_ns = setup.full_cost, trained.seconds = setup.limit.elapsed();
      if (!candidates.poor.empty()) TellPoor(setup, candidates.poor, &trained);
      return trained;
    }
    made = std::move(*best);
    KPSA_RETURN_IF_ERROR(calibrate(&*made));
  }
  Subspace subspace = std::move(*made);

  // What clips lose, another training with a step of some points may win
  Poor poor;
  if (may_end(1) && ends->steps != nullptr && rig.some.empty() && candidates.by_tile &&
      candidates.cost.lost_of_clips.value_or(0) > kManyOfClips) {
    TileSteps of_steps = StepsOfTiles(setup, *ends->steps, kCheapPoints * setup.full_cost);
    of_steps.most_points = kMostPoor;
    poor = candidates.PoorOf(of_steps);
  }
  const auto with_held = [&](Result<Trained> trained) {
    if (trained.ok()) trained->held = setup.sampler->held();
    if (trained.ok() && !poor.empty()) TellPoor(setup, poor, &*trained);
    return trained;
  };
  if (rig.some.empty())
    return with_held(FinishTraining(mends, setup.limit, poses.pose_seconds, &setup, candidates,
                                    std::move(record), std::move(subspace)));
  TrainingRig all = rig;
  all.some.clear(), all.every = 1;
  WholeSubspace whole(all, options, candidates);
  Result<Subspace> of_all = whole.Make(ranges, calibrator.size);
  if (!of_all.ok()) return of_all.status();
  return with_held(FinishTraining(mends, setup.limit, poses.pose_seconds, whole.setup(), whole.candidates(),
                                  std::move(record), std::move(*of_all)));
}

}  // namespace kpsa::engine
