#include "kpsa/training/finer_subspaces.h"

#include <utility>

#include "kpsa/training/training_trials.h"

namespace kpsa::engine {

Status CandidateCalibrator::Calibrate(Subspace* subspace) const {
  TrainingSetup& setup = *candidates->setup;
  RangeFinder own = ranges;
  if (candidates->by_tile) own.Widen(candidates->ranges_of_tiles);
  const Calibrator calibrator{setup.rig,
                              setup.clips,
                              setup.options,
                              setup.guards,
                              setup.layout,
                              candidates->patches,
                              candidates->modes->diagonal,
                              setup.full_cost,
                              setup.inverse_rest_stretch,
                              size};
  const Result<FrameCost> cost = CalibrateSubspace(
      calibrator, {&setup.compiler, setup.recorder.get(), setup.sampler.get(), &own, candidates->record},
      candidates->cues.set, subspace);
  if (!cost.ok()) return cost.status();
  candidates->cost = *cost;
  return Status();
}

Status CandidateCalibrator::TryFiner(Subspace* subspace) const {
  SubspaceCandidates& of = *candidates;
  TrainingSetup& setup = *of.setup;
  TrainingRecord& record = *of.record;
  KPSA_RETURN_IF_ERROR(setup.Say("finer tiles", 0.95));
  TrainingRecord before = record;
  TrainingTrials trials(setup.full_cost, of.alike());
  const auto add = [&](const char* what, Subspace tried) {
    const Result<double> points = setup.CostOfPoints(of.cues.set.cues);
    if (!points.ok()) return points.status();
    trials.Add(what, *points + setup.CostOfSteps(),
               {std::move(tried), of.cues.set, record, of.cost, what != kByTile && what != kForAllPoints},
               what == kByTileFinely ? 1 / kFinelyLess : 1);
    return Status();
  };
  const auto calibrated = [&](const char* what, Subspace now) {
    of.Describe(&now);
    record = before;
    KPSA_RETURN_IF_ERROR(Calibrate(&now));
    return add(what, std::move(now));
  };
  const auto take = [&](TileSubspace tiles) {
    of.cues.set = std::move(tiles.cues);
    return std::move(tiles.subspace);
  };
  const auto again = [&](const char* what, bool finely = true) {
    Subspace now;
    if (of.by_tile) {
      now = take(of.OfTiles(finely));
    } else {
      now = of.ForAllPoints(true);
    }
    return calibrated(what, std::move(now));
  };
  const auto for_all_points = [&] {
    of.cues.set = MakeCueSet(of.modes->pca, of.cues.choice.cues, of.modes->noise);
  };
  const char* const fine = of.by_tile ? kByTileFinely : of.fewer ? kFewerCues : kFinelyStored;
  KPSA_RETURN_IF_ERROR(add(of.fine ? fine : of.by_tile ? kByTile : kForAllPoints, std::move(*subspace)));
  bool may_be_for_all = of.by_tile && !of.knows_tiles_only();
  // Finer tiles with cues of their own come first: they are taken at a higher cost than others
  if (of.by_tile && !of.fine && of.IsWorthTrying(trials.least())) KPSA_RETURN_IF_ERROR(again(fine));
  if (of.others_ns < (of.by_tile ? trials.least_ns() / of.alike() : trials.least_ns())) {
    // Calibration misses more than the judges of both did
    if (of.by_tile) {
      for_all_points(), may_be_for_all = false;
      if (of.others.tiles.empty()) of.others = of.ForAllPoints(true);
      KPSA_RETURN_IF_ERROR(calibrated(kFinelyStored, std::move(of.others)));
    } else {
      of.by_tile = true;
      KPSA_RETURN_IF_ERROR(
          calibrated(of.others_finely ? kByTileFinely : kByTile, take(std::move(of.others_of_tiles))));
      for_all_points(), of.by_tile = false;
    }
  }
  if (!of.by_tile && !of.fine && of.IsWorthTrying(trials.least())) KPSA_RETURN_IF_ERROR(again(fine));
  if (may_be_for_all && trials.least().misses > kTooManyMisses) {
    for_all_points(), of.by_tile = false;
    KPSA_RETURN_IF_ERROR(again(kFinelyStored));
  }
  if (!of.by_tile && trials.least().misses > kTooManyMisses && setup.limit.left() > of.modes_seconds) {
    KPSA_RETURN_IF_ERROR(
        ChooseTrainingCues(setup.options.tolerance / 2, *of.poses, &setup, of.modes, &of.cues));
    KPSA_RETURN_IF_ERROR(again(kForHalf));
  }
  // Cues of tiles, where nothing had said before that so many would miss
  if (!of.tried_tiles && setup.options.may_have_cues_by_tile && of.poses->judges.poses() > 0 &&
      trials.least().misses > kManyMisses && of.HasTimeForTiles()) {
    of.steps = {};  // that would be another training
    const Result<bool> promising = of.ChooseTiles();
    if (!promising.ok()) return promising.status();
    before.sampled_poses = record.sampled_poses;
    of.by_tile = *promising;
    for (const bool finely : {false, true}) {
      if (!of.by_tile || (finely && of.cost.lost() <= kFewMisses)) break;
      KPSA_RETURN_IF_ERROR(again(finely ? kByTileFinely : kByTile, finely));
    }
  }
  CalibratedSubspace best = trials.Take(std::move(before.tried));
  *subspace = std::move(best.subspace), of.cues.set = std::move(best.cues), record = std::move(best.record);
  of.cost = best.cost;
  of.by_tile = subspace->by_tile(), of.fine = best.fine;
  return Status();
}

}  // namespace kpsa::engine
