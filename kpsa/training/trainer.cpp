#include "kpsa/training/trainer.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "kpsa/partial_step.h"
#include "kpsa/training/finer_subspaces.h"
#include "kpsa/training/mend_tiles.h"
#include "kpsa/training/some_points.h"
#include "kpsa/training/training_cancel.h"
#include "kpsa/training/whole_subspace.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kJudgeOfLight = 5;  // of so many poses, one
// What a frame costs, in last steps: inner points are tried; and of that, with which they are taken
constexpr double kWorthSplitting = 2, kCheaperInner = 0.95;
constexpr double kToChoose = 0.5;  // of the time, with some of many points: all of them take the rest
// Of many points: all are trained at once, with a step of some tiles, where they are no more than so many times as many
// and a frame is then expected to cost less than that, of a full one
constexpr std::size_t kMostStepped = 2;
constexpr double kWorthStepping = 0.5;

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
  for (const PoseMatrix& learnt : poses.learnt) ranges->Widen(learnt);
  return setup->of_light() ? Status() : ranges->Widen(setup->clips, setup->recorder.get());
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

// A training by itself: of what comes out, or of inner points.
struct Trained {
  Subspace subspace;
  TrainingRecord record;
  double ns = 0;       // what a frame is expected to cost, on the scale of the nodes' costs,
  double full_ns = 0;  // and the whole evaluation
  double seconds = 0;  // that it took
  bool ended = false;  // with its cues, as these lie where the last step is dear: there is no subspace. Or
  std::vector<std::vector<Index>> poor =
      {};  // with these tiles, by mesh: the last step should be of them alone
};

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
  KPSA_RETURN_IF_ERROR(setup->rig.set_clip(std::nullopt));
  Sign(*setup, &subspace);
  record.limited = limit.left_out();
  const Result<double> points = setup->CostOfPoints(candidates.cues.set.cues);
  if (!points.ok()) return points.status();
  const double ns = *points + setup->CostOfSteps() + candidates.cost.ns;
  return Trained{std::move(subspace), std::move(record), ns, setup->full_cost, limit.elapsed(), false};
}

// Tiles of all meshes, by mesh.
std::vector<std::vector<Index>> ByMesh(const TrainingSetup& setup, std::span<const std::size_t> tiles) {
  std::vector<std::vector<Index>> of_meshes;
  std::size_t first = 0;
  for (std::size_t m = 0; m < setup.totals.size(); ++m) {
    const std::size_t count = (setup.rig.rows(m, setup.totals[m]) + kTilePoints - 1) / kTilePoints;
    std::vector<Index>& own = of_meshes.emplace_back();
    for (const std::size_t tile : tiles) {
      if (tile >= first && tile < first + count) own.push_back(static_cast<Index>(tile - first));
    }
    first += count;
  }
  return of_meshes;
}

// Where a training may end without a subspace: with its cues, where these are points that come out, a frame is expected
// to cost more than `enough`, and no cues of tiles serve; or with tiles of meshes with steps, which are to blame for that.
struct Ends {
  double enough = std::numeric_limits<double>::infinity();
  const std::vector<Compiler::SplitPoints>* steps = nullptr;  // by mesh
};
std::vector<char> TilesWithSteps(const TrainingSetup& setup,
                                 const std::vector<Compiler::SplitPoints>& steps) {
  std::vector<char> tiles;
  for (std::size_t m = 0; m < setup.totals.size(); ++m) {
    const std::size_t count = (setup.rig.rows(m, setup.totals[m]) + kTilePoints - 1) / kTilePoints;
    tiles.insert(tiles.end(), count, steps[m].step != nullptr);
  }
  return tiles;
}

// mends: last steps by which points may be mended, by mesh; or none. ends: null where there is to be a subspace.
Result<Trained> TrainOnce(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                          const TrainOptions& options, const std::vector<Compiler::SplitPoints>& mends = {},
                          const Ends* ends = nullptr) {
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
  if (setup.of_light() && setup.of_map()) poses.judges = poses.poses.TakeEvery(kJudgeOfLight);

  // Modes and cues
  TrainingModes modes;
  KPSA_RETURN_IF_ERROR(FindModes(setup, &poses, &modes, &record));
  SubspaceCandidates candidates{&setup, &poses, &modes, &record, setup.limit.elapsed() - before_modes};
  KPSA_RETURN_IF_ERROR(ChooseTrainingCues(options.tolerance, poses, &setup, &modes, &candidates.cues));

  const CueChoice& choice = candidates.cues.choice;
  // Another training has to fit
  if (ends != nullptr && setup.limit.left() > 2 * setup.limit.elapsed())
    candidates.may_step = TilesWithSteps(setup, *ends->steps);
  candidates.dear =
      ends != nullptr && choice.cost > ends->enough && !MissMany(choice) &&
      std::ranges::any_of(choice.cues, [](const CueRef& cue) { return cue.kind == CueKind::kOutput; });

  // Subspaces
  KPSA_RETURN_IF_ERROR(setup.Say("subspace", 0.85));
  const bool of_points = !setup.of_light() && setup.of_map();
  if (of_points && !options.without.patches && rig.split.empty() && rig.some.empty()) {
    KPSA_RETURN_IF_ERROR(setup.rig.set_clip(std::nullopt));
    Result<PatchLayout> patches = PricePatches(setup.rig, &setup.compiler, setup.totals, modes.positions);
    if (!patches.ok()) return patches.status();
    candidates.patches = std::move(*patches);
  }
  Result<std::optional<Subspace>> best = candidates.Best();
  if (!best.ok()) return best.status();
  if (!*best) {
    if (candidates.by_tiles_alone()) return Status::Invalid("no cues of tiles serve");
    record.tried.push_back({kForAllPoints, choice.cues.size(),
                            static_cast<std::size_t>(candidates.cues.set.rows()), choice.misses,
                            choice.cost / setup.full_cost, false});
    return Trained{
        {},
        std::move(record),
        choice.cost,
        setup.full_cost,
        setup.limit.elapsed(),
        true,
        candidates.poor.empty() ? std::vector<std::vector<Index>>() : ByMesh(setup, candidates.poor)};
  }
  Subspace subspace = std::move(**best);
  KPSA_RETURN_IF_ERROR(setup.Say("calibration", 0.95));
  const CandidateCalibrator calibrator{&candidates, ranges,
                                       CalibrationWithin(poses.pose_seconds, options, &setup.limit)};
  KPSA_RETURN_IF_ERROR(calibrator.Calibrate(&subspace));
  const FrameCost& cost = candidates.cost;
  if (of_points && !options.without.miss_costs && calibrator.size.margins && candidates.IsWorthTrying(cost) &&
      (!candidates.fine || cost.lost() > kTooManyMisses) && setup.limit.left() > candidates.modes_seconds)
    KPSA_RETURN_IF_ERROR(calibrator.TryFiner(&subspace));

  if (rig.some.empty())
    return FinishTraining(mends, setup.limit, poses.pose_seconds, &setup, candidates, std::move(record),
                          std::move(subspace));
  TrainingRig all = rig;
  all.some.clear(), all.every = 1;
  WholeSubspace whole(all, options, candidates);
  Result<Subspace> of_all = whole.Make(ranges, calibrator.size);
  if (!of_all.ok()) return of_all.status();
  return FinishTraining(mends, setup.limit, poses.pose_seconds, whole.setup(), whole.candidates(),
                        std::move(record), std::move(*of_all));
}

// The rig with its last steps taken apart, in every clip; nothing where it has none.
Result<std::optional<TrainingRig>> SplitRig(const TrainingRig& rig, const std::vector<TrainingClip>& clips) {
  TrainingRig with = rig;
  Compiler compiler;
  const std::size_t meshes = rig.target.meshes.size();
  for (std::size_t c = 0; c <= clips.size(); ++c) {
    KPSA_RETURN_IF_ERROR(rig.Play(clips, static_cast<int>(c) - 1));
    Result<std::vector<Compiler::SplitPoints>> split = SplitMeshes(*rig.graph, &compiler, rig.target);
    if (!split.ok()) return split.status();
    if (c == 0) with.split = *split;
    for (std::size_t m = 0; m < meshes; ++m) {
      if ((*split)[m].step == nullptr) with.split[m] = {};
    }
  }
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  bool any = false;
  for (std::size_t m = 0; m < meshes; ++m) {
    const std::vector<AccelerationTarget::Stage>& stages = rig.target.meshes[m].stages;
    const bool reached = std::ranges::any_of(rig.controls, [&](const ControlRange& control) {
      return control.plug.node == stages.back().points.node;
    });
    if (reached || stages.size() < 2) with.split[m] = {};
    any = any || with.split[m].step != nullptr;
  }
  if (!any) return std::optional<TrainingRig>();
  return std::optional(std::move(with));
}

// The same, but steps are of these tiles alone, by mesh.
TrainingRig OfTiles(TrainingRig split, std::vector<std::vector<Index>> tiles) {
  for (std::size_t m = 0; m < split.split.size() && m < tiles.size(); ++m) {
    Compiler::SplitPoints& of = split.split[m];
    if (tiles[m].empty()) of = {};
    if (of.step == nullptr) tiles[m].clear();
    if (of.step != nullptr) of.step = MakePartialStep(of.step, tiles[m]);
  }
  tiles.resize(split.split.size());
  split.stepped = std::move(tiles);
  return split;
}

// What was tried is told apart from that of another training; also where there was no choice.
void NameTried(Trained* trained, const char* suffix) {
  std::vector<TrainingRecord::Tried>& tried = trained->record.tried;
  if (tried.empty())
    tried.push_back({kForAllPoints, trained->subspace.cues.size(), trained->subspace.rows(), 0,
                     trained->ns / trained->full_ns, true});
  for (TrainingRecord::Tried& one : tried) one.what += suffix;
}

// What was tried, of both.
void AddTried(const Trained& other, Trained* taken) {
  std::vector<TrainingRecord::Tried> all = other.record.tried;
  for (TrainingRecord::Tried& one : all) one.taken = false;
  all.insert(all.end(), taken->record.tried.begin(), taken->record.tried.end());
  taken->record.tried = std::move(all);
}

// Where a rig has many points, it with some of them: enough to choose by.
Result<std::optional<TrainingRig>> RigOfSome(const TrainingRig& rig, const TrainOptions& options) {
  if (options.mode != EstimatorMode::kMap || rig.target.colors || options.keep_modes ||
      options.inner == TrainOptions::Inner::kAlways)
    return std::optional<TrainingRig>();
  return SomePointsOf(rig, options.many_points, options.some_points);
}

// Whether there are tiles, all of them of meshes with steps.
bool HasTiles(const TrainingRig& split, const std::vector<std::vector<Index>>& tiles) {
  bool any = false;
  for (std::size_t m = 0; m < tiles.size(); ++m) {
    if (tiles[m].empty()) continue;
    const LastStep* const step = m < split.split.size() ? split.step(m) : nullptr;
    if (step == nullptr || PointsOfTiles({&tiles[m].back(), 1}, step->points()).empty()) return false;
    any = true;
  }
  return any;
}

std::size_t PointsOf(const TrainingRig& some) {
  std::size_t points = 0;
  for (const std::vector<Index>& of_mesh : some.some) points += of_mesh.size();
  return points;
}
// Tiles of all points that tiles of some of them cover.
std::vector<std::vector<Index>> TilesOfAll(const std::vector<std::vector<Index>>& tiles,
                                           const TrainingRig& some) {
  std::vector<std::vector<Index>> all(tiles.size());
  for (std::size_t m = 0; m < tiles.size(); ++m) {
    const Index end = some.some[m].empty() ? 0 : some.some[m].back() / kTilePoints + 1;
    for (const Index tile : tiles[m]) {
      for (Index t = tile * some.every; t < std::min(end, (tile + 1) * some.every); ++t) all[m].push_back(t);
    }
  }
  return all;
}

// Of what comes out of the stack, and where that is dear, of the points before its last step: what is expected to cost
// less.
Result<Trained> TrainBest(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                          const TrainOptions& options) {
  const TimeLimit limit(options.seconds);
  const Result<std::optional<TrainingRig>> of_some = RigOfSome(rig, options);
  if (!of_some.ok()) return of_some.status();
  Result<std::optional<TrainingRig>> split = std::optional<TrainingRig>();
  if (options.mode == EstimatorMode::kMap && !rig.target.colors) split = SplitRig(rig, clips);
  if (!split.ok()) return split.status();
  const bool mended = split->has_value() && !options.keep_modes && !options.without.mends;
  const std::vector<Compiler::SplitPoints> mends =
      mended ? (*split)->split : std::vector<Compiler::SplitPoints>();
  if (of_some->has_value()) {
    TrainOptions choosing = options;  // what is learnt changes all tiles
    choosing.by_tile_as_before = false, choosing.seconds *= kToChoose;
    if (!split->has_value() || options.inner != TrainOptions::Inner::kIfCheaper ||
        PointsOf(**of_some) * (*of_some)->every > kMostStepped * options.many_points)
      return TrainOnce(**of_some, clips, choosing, mends);
    const Ends ends{.steps = &(*split)->split};
    Result<Trained> chosen = TrainOnce(**of_some, clips, choosing, mends, &ends);
    if (!chosen.ok() || chosen->poor.empty()) return chosen;
    TrainOptions rest = options;
    rest.seconds = limit.left();
    Result<Trained> stepped = TrainOnce(OfTiles(**split, TilesOfAll(chosen->poor, **of_some)), clips, rest);
    if (!stepped.ok() && stepped.status().kind() == ErrorKind::kInterrupted) return stepped;
    if (stepped.ok() && stepped->ns < kWorthStepping * stepped->full_ns &&
        stepped->ns < kCheaperInner * chosen->ns) {
      NameTried(&*stepped, kBeforeLastStepOfSome);
      AddTried(*chosen, &*stepped);
      return stepped;
    }
    choosing.seconds = limit.left();
    return TrainOnce(**of_some, clips, choosing, mends);
  }
  if (!split->has_value()) return TrainOnce(rig, clips, options);
  if (options.inner == TrainOptions::Inner::kNever) return TrainOnce(rig, clips, options, mends);
  if (options.inner == TrainOptions::Inner::kAlways) {
    return TrainOnce(HasTiles(**split, options.stepped) ? OfTiles(**split, options.stepped) : **split, clips,
                     options);
  }
  double steps = 0;
  for (std::size_t m = 0; m < (*split)->split.size(); ++m)
    steps += (*split)->step(m) == nullptr ? 0 : static_cast<double>((*split)->step(m)->cost_ns());
  const double enough = kWorthSplitting * steps;
  const Ends ends{enough, &(*split)->split};
  Result<Trained> whole = TrainOnce(rig, clips, options, mends, &ends);
  if (!whole.ok() || (!whole->ended && whole->ns < enough)) return whole;
  if (!whole->ended && options.seconds < 2 * whole->seconds) return whole;
  TrainOptions rest = options;
  rest.seconds = limit.left();
  std::optional<Trained> some;
  if (!whole->poor.empty()) {
    Result<Trained> made = TrainOnce(OfTiles(**split, whole->poor), clips, rest);
    if (!made.ok() && made.status().kind() == ErrorKind::kInterrupted) return made;
    if (made.ok()) {
      NameTried(&*made, kBeforeLastStepOfSome);
      // The steps of all tiles cost half of that by themselves
      if (made->ns < enough && made->ns < kCheaperInner * whole->ns) {
        AddTried(*whole, &*made);
        return made;
      }
      some = std::move(*made);
    }
    rest.seconds = limit.left();
  }
  Result<Trained> inner = TrainOnce(**split, clips, rest);
  if (!inner.ok() && inner.status().kind() == ErrorKind::kInterrupted) return inner;
  if (inner.ok()) NameTried(&*inner, kBeforeLastStep);
  // The cheaper one of the two that reconstruct inner points
  if (some && (!inner.ok() || some->ns < inner->ns)) {
    if (inner.ok()) AddTried(*inner, &*some);
    inner = std::move(*some);
  } else if (some) {
    AddTried(*some, &*inner);
  }
  if (whole->ended && !(inner.ok() && inner->ns < kCheaperInner * whole->ns)) {
    rest.seconds = limit.left();
    whole = TrainOnce(rig, clips, rest, mends);
    if (!whole.ok()) return whole;
  }
  if (!inner.ok()) return whole;
  if (!whole->ended) NameTried(&*whole, "");
  const bool cheaper = inner->ns < kCheaperInner * whole->ns;
  AddTried(cheaper ? *whole : *inner, cheaper ? &*inner : &*whole);
  return cheaper ? std::move(inner) : std::move(whole);
}

Result<Subspace> Finish(Result<Trained> trained) {
  if (!trained.ok()) return trained.status();
  trained->subspace.training = TrainingJson(trained->record);
  KPSA_RETURN_IF_ERROR(ValidateSubspace(trained->subspace));
  return std::move(trained->subspace);
}

}  // namespace

Status TrainingRig::Play(const std::vector<TrainingClip>& clips, int clip) const {
  return set_clip(clip < 0 ? std::nullopt
                           : std::optional<std::string_view>(clips[static_cast<std::size_t>(clip)].name));
}

std::vector<std::size_t> TrainingRig::FreeControls(bool playing) const {
  std::vector<std::size_t> free;
  for (std::size_t c = 0; c < controls.size(); ++c) {
    if (!playing || !controls[c].by_clip) free.push_back(c);
  }
  return free;
}

std::vector<PlugRef> TrainingRig::Varying(bool playing) const {
  std::vector<PlugRef> plugs{time};
  for (const std::size_t c : FreeControls(playing)) plugs.push_back(controls[c].plug);
  return plugs;
}

Result<Subspace> Train(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                       const TrainOptions& options) {
  TrainingCancel cancel(options.progress);
  const CancelScope scope(&cancel);
  TrainOptions watched = options;
  if (options.progress)
    watched.progress = [&](const char* what, double share) { return cancel.Say(what, share); };
  try {
    Result<Subspace> trained = Finish(TrainBest(rig, clips, watched));
    if (!trained.ok() && cancel.asked()) throw Cancelled();  // an evaluation that was ended, say
    if (!trained.ok() || !watched.by_tile_as_before || trained->by_tile()) return trained;
    watched.by_tile_as_before = false;  // with cues for all points, what is learnt changes all of them
    return Finish(TrainBest(rig, clips, watched));
  } catch (const Cancelled&) {
    KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
    return Status::Make(ErrorKind::kInterrupted, "interrupted");
  }
}

}  // namespace kpsa::engine
