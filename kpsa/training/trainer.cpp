#include "kpsa/training/trainer.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/check.h"
#include "kpsa/partial_step.h"
#include "kpsa/training/clip_controls.h"
#include "kpsa/training/frame_cost.h"
#include "kpsa/training/one_training.h"
#include "kpsa/training/some_points.h"
#include "kpsa/training/subspace_candidates.h"
#include "kpsa/training/time_limit.h"
#include "kpsa/training/training_cancel.h"

namespace kpsa::engine {
namespace {

// What a frame costs, in last steps: where cues say so, points that come out need no subspace of their own; where poses
// made of the clips do, inner points are tried; and of that, with which they are taken
constexpr double kDearCues = 2, kWorthSplitting = 1.6, kCheaperInner = 0.95;
// Likewise, where so many poses of the other are accepted and wrong, and half as many of it
constexpr double kManyWrong = 0.005, kTruer = 1.3;
// Of a full frame: what a frame made as the clips are costs, with which controls that clips do not move are tried at rest;
// and of that, what it costs then
constexpr double kDearFollowing = 0.5, kCheaperAtRest = 0.75;
constexpr const char* kNotLeft = "no second training that leaves controls at rest which this one gets wrong";
constexpr double kToChoose = 0.5;  // of the time, with some of many points: all of them take the rest
// Of many points: all are trained at once, with a step of some points, where they are no more than so many times as many
// and a frame is then expected to cost less than that, of a full one
constexpr std::size_t kMostStepped = 2;
constexpr double kWorthStepping = 0.5;

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

// The same, but steps are of these points alone, by mesh; nothing where there are none, or they do not fit.
std::optional<TrainingRig> OfPoints(TrainingRig split, std::vector<SteppedPoints> points) {
  bool any = false;
  points.resize(split.split.size());
  for (std::size_t m = 0; m < points.size(); ++m) {
    std::shared_ptr<const LastStep>& step = split.split[m].step;
    if (points[m].empty()) {
      split.split[m] = {};
      continue;
    }
    if (step == nullptr || !points[m].Fit(step->points())) return std::nullopt;
    step = MakePartialStep(step, points[m]);
    if (step == nullptr) return std::nullopt;
    any = true;
  }
  split.stepped = std::move(points);
  return any ? std::optional(std::move(split)) : std::nullopt;
}

std::optional<TrainingRig> OfPoints(const TrainingRig& split, const std::vector<std::vector<Index>>& points) {
  std::vector<SteppedPoints> stepped(points.size());
  for (std::size_t m = 0; m < points.size(); ++m) {
    if (!points[m].empty() && split.step(m) != nullptr) stepped[m] = LayOut(*split.step(m), points[m]);
  }
  return OfPoints(split, std::move(stepped));
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

std::size_t PointsOf(const TrainingRig& some) {
  std::size_t points = 0;
  for (const std::vector<Index>& of_mesh : some.some) points += of_mesh.size();
  return points;
}
// Of all points these, which are of some of many, and those up to the next ones of them: what lies between is not known.
std::vector<std::vector<Index>> AllAbout(const std::vector<std::vector<Index>>& points,
                                         const TrainingRig& rig, const TrainingRig& some) {
  std::vector<std::vector<Index>> all(points.size());
  for (std::size_t m = 0; m < points.size(); ++m) {
    const std::vector<Index>& of_some = some.some[m];
    for (const Index k : points[m]) {
      const Index begin = k == 0 ? 0 : of_some[k - 1] + 1;
      const Index end = k + 1 < of_some.size() ? of_some[k + 1] : static_cast<Index>(rig.step(m)->points());
      for (Index i = all[m].empty() ? begin : std::max(begin, all[m].back() + 1); i < end; ++i)
        all[m].push_back(i);
    }
  }
  return all;
}

// What a training says that a last step should be of, and about creases what the step of these points reads.
std::vector<std::vector<Index>> WithCreases(const TrainingRig& split, const Trained& told) {
  std::vector<std::vector<Index>> all = told.poor;
  for (std::size_t m = 0; m < told.turned.size(); ++m) {
    const LastStep* const step = split.step(m);
    if (told.turned[m].empty() || step == nullptr) continue;
    for (const Index inner : step->InnerOf(PointSet::Of(told.turned[m], static_cast<Index>(step->points()))))
      all[m].push_back(step->PointOf(inner));
    std::ranges::sort(all[m]);
    all[m].erase(std::unique(all[m].begin(), all[m].end()), all[m].end());
  }
  return all;
}

// With a step of these points alone; where it turns out that a few more need it, with these. Ends as TrainOnce does.
Result<Trained> TrainStepped(const TrainingRig& split, const std::vector<std::vector<Index>>& points,
                             const std::vector<TrainingClip>& clips, TrainOptions options) {
  const TimeLimit limit(options.seconds);
  std::optional<TrainingRig> of_points = OfPoints(split, points);
  if (!of_points) return Status::Invalid("no such points");
  const Ends more;
  Result<Trained> trained = TrainOnce(*of_points, clips, options, {}, &more);
  if (trained.ok() && trained->ended) {
    of_points = OfPoints(split, WithCreases(split, *trained));
    KPSA_CHECK(of_points.has_value());  // they are laid out anew
    options.seconds = limit.left();
    trained = TrainOnce(*of_points, clips, options);
  }
  if (trained.ok()) NameTried(&*trained, kBeforeLastStepOfSome);
  return trained;
}

// What a frame is expected to cost that is made as the clips are (ns).
double CostOfClips(const Trained& trained) {
  if (trained.ended || !trained.lost_of_clips) return trained.ns;
  return trained.ns + (*trained.lost_of_clips - trained.lost) * trained.full_ns;
}

// Of what the other one is expected to cost: one that reconstructs inner points is taken at less.
double AlikeOf(const Trained& inner, const Trained& whole) {
  return whole.wrong > kManyWrong && inner.wrong < whole.wrong / 2 ? kTruer : kCheaperInner;
}

// Of what a training that ended is expected to cost: one with a step of some points is taken at less. The steps of all
// points cost half of that by themselves; with many tiles cues of these are taken at more.
double AlikeOfExpected(const Trained& stepped, const TrainOptions& options) {
  return kOfExpected * (stepped.subspace.tile_count() < options.many_tiles ? kCheaperInner : kAlikeOfMany);
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
    Result<Trained> stepped = TrainStepped(**split, AllAbout(chosen->poor, **split, **of_some), clips, rest);
    if (!stepped.ok() && stepped.status().kind() == ErrorKind::kInterrupted) return stepped;
    if (stepped.ok() && stepped->ns < kWorthStepping * stepped->full_ns &&
        stepped->ns < AlikeOfExpected(*stepped, options) * chosen->ns) {
      AddTried(*chosen, &*stepped);
      return stepped;
    }
    choosing.seconds = limit.left();
    return TrainOnce(**of_some, clips, choosing, mends);
  }
  if (!split->has_value()) return TrainOnce(rig, clips, options);
  if (options.inner == TrainOptions::Inner::kNever) return TrainOnce(rig, clips, options, mends);
  if (options.inner == TrainOptions::Inner::kAlways) {
    const std::optional<TrainingRig> of_points = OfPoints(**split, options.stepped);
    return TrainOnce(of_points ? *of_points : **split, clips, options);
  }
  double steps = 0;
  for (std::size_t m = 0; m < (*split)->split.size(); ++m)
    steps += (*split)->step(m) == nullptr ? 0 : static_cast<double>((*split)->step(m)->cost_ns());
  const double enough = kDearCues * steps;
  const Ends ends{enough, &(*split)->split};
  Result<Trained> whole = TrainOnce(rig, clips, options, mends, &ends);
  if (!whole.ok()) return whole;
  const double of_whole = CostOfClips(*whole);
  if (!whole->ended && options.seconds < 2 * whole->seconds) return whole;
  const bool cheap = !whole->ended && of_whole < kWorthSplitting * steps;
  if (cheap && whole->poor.empty()) return whole;
  TrainOptions rest = options;
  rest.seconds = limit.left();
  std::optional<Trained> some;
  if (!whole->poor.empty()) {
    Result<Trained> made = TrainStepped(**split, WithCreases(**split, *whole), clips, rest);
    if (!made.ok() && made.status().kind() == ErrorKind::kInterrupted) return made;
    if (made.ok()) {
      const double alike = whole->ended ? AlikeOfExpected(*made, options) : AlikeOf(*made, *whole);
      if (made->ns < enough && CostOfClips(*made) < alike * of_whole) {
        if (!whole->ended) NameTried(&*whole, "");
        AddTried(*whole, &*made);
        return made;
      }
      some = std::move(*made);
    }
    if (cheap) {
      if (some) AddTried(*some, &*whole);
      return whole;
    }
    rest.seconds = limit.left();
  }
  // Steps of all points alone may cost more than what they have to be cheaper than
  Result<Trained> inner = whole->ended && steps > of_whole ? Status::Invalid("their steps are dear")
                                                           : TrainOnce(**split, clips, rest);
  if (!inner.ok() && inner.status().kind() == ErrorKind::kInterrupted) return inner;
  if (inner.ok()) NameTried(&*inner, kBeforeLastStep);
  // The cheaper one of the two that reconstruct inner points
  if (some && (!inner.ok() || CostOfClips(*some) < CostOfClips(*inner))) {
    if (inner.ok()) AddTried(*inner, &*some);
    inner = std::move(*some);
  } else if (some) {
    AddTried(*some, &*inner);
  }
  if (whole->ended && !(inner.ok() && CostOfClips(*inner) < kCheaperInner * of_whole)) {
    rest.seconds = limit.left();
    whole = TrainOnce(rig, clips, rest, mends);
    if (!whole.ok()) return whole;
  }
  if (!inner.ok()) return whole;
  if (!whole->ended) NameTried(&*whole, "");
  const bool cheaper = CostOfClips(*inner) < AlikeOf(*inner, *whole) * CostOfClips(*whole);
  AddTried(cheaper ? *whole : *inner, cheaper ? &*inner : &*whole);
  return cheaper ? std::move(inner) : std::move(whole);
}

// Controls of deformers may do what no subspace tells, and spoil it for the clips, which do not move them: where that costs
// much, or goes unnoticed, they are left at rest, and frames that move them miss.
Result<Trained> TrainFollowing(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                               const TrainOptions& options) {
  const TimeLimit limit(options.seconds);
  if (!options.at_rest.empty()) {
    Result<Trained> again = TrainBest(AtRest(rig, options.at_rest), clips, options);
    if (again.ok()) again->record.at_rest = options.at_rest;
    return again;
  }
  Result<Trained> all = TrainBest(rig, clips, options);
  if (!all.ok() || all->held.empty() || options.mode != EstimatorMode::kMap) return all;
  const bool dear = CostOfClips(*all) >= kDearFollowing * all->full_ns;
  if (!options.may_leave_at_rest || (!dear && all->untold.empty())) return all;
  if (limit.left() < 2 * all->seconds) {
    if (!all->untold.empty())
      all->record.limited += all->record.limited.empty() ? kNotLeft : "; " + std::string(kNotLeft);
    return all;
  }
  TrainOptions rest = options;
  rest.seconds = limit.left();
  for (const std::size_t c : dear ? all->held : all->untold)
    rest.at_rest.push_back(rig.graph->AuthoredName(rig.controls[c].plug));
  Result<Trained> at_rest = TrainFollowing(rig, clips, rest);
  if (!at_rest.ok()) return at_rest.status().kind() == ErrorKind::kInterrupted ? std::move(at_rest) : all;
  const bool cheaper = !all->untold.empty() || CostOfClips(*at_rest) < kCheaperAtRest * CostOfClips(*all);
  NameTried(cheaper ? &*all : &*at_rest, cheaper ? kWithHeld : kWithoutHeld);
  AddTried(cheaper ? *all : *at_rest, cheaper ? &*at_rest : &*all);
  return cheaper ? std::move(at_rest) : std::move(all);
}

Result<Subspace> Finish(Result<Trained> trained) {
  if (!trained.ok()) return trained.status();
  trained->subspace.training = TrainingJson(trained->record);
  KPSA_RETURN_IF_ERROR(ValidateSubspace(trained->subspace));
  return std::move(trained->subspace);
}

}  // namespace

TrainingRig AtRest(TrainingRig rig, const std::vector<std::string>& controls) {
  for (ControlRange& control : rig.controls) {
    if (std::ranges::find(controls, rig.graph->AuthoredName(control.plug)) != controls.end())
      control.min = control.max = control.rest;
  }
  return rig;
}

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
    const Result<TrainingRig> all = WithClipControls(rig, clips);
    if (!all.ok()) return all.status();
    Result<Subspace> trained = Finish(TrainFollowing(*all, clips, watched));
    if (!trained.ok() && cancel.asked()) throw Cancelled();  // an evaluation that was ended, say
    if (!trained.ok() || !watched.by_tile_as_before || trained->by_tile()) return trained;
    watched.by_tile_as_before = false;  // with cues for all points, what is learnt changes all of them
    return Finish(TrainFollowing(*all, clips, watched));
  } catch (const Cancelled&) {
    KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
    return Status::Make(ErrorKind::kInterrupted, "interrupted");
  }
}

}  // namespace kpsa::engine
