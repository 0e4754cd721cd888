// Where points may be measured: at the outputs, or at earlier stages of the deformer stack, which cost less.
// A point before a deltaMush needs no neighbours; one before a wrap needs no driver. What points cost is what
// the compiler keeps for them, by the costs that the nodes declare (NodeBuilder::cost), with all controls
// varying; no clip may play, since it would drive some of them.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "kpsa/patches.h"
#include "kpsa/training/cue_choice.h"
#include "kpsa/training/pose_recorder.h"

namespace kpsa::engine {

// The number of points of each mesh of the target.
Result<std::vector<Index>> PointTotals(const TrainingRig& rig, Compiler* compiler);

struct CuePlaces {
  std::vector<CandidateStage> stages;  // whose points are recorded besides the outputs
  std::vector<CuePlace> places;        // the dearest first
  CuePlace of_tiles;                   // the dearest with more points, where each tile has cues of its own
  double full_cost = 0;                // of all outputs (ns)
};

// The dearest place is, for each mesh, the latest stage at which a point costs little more than itself; the
// others cost less and less. totals: points of each mesh. Light that has an earlier stage is measured there,
// at max_light_points of its points at most.
Result<CuePlaces> FindCuePlaces(const TrainingRig& rig, Compiler* compiler, std::span<const Index> totals,
                                std::size_t max_light_points = std::numeric_limits<std::size_t>::max());

// What the points among the cues cost together (ns); stages: as FindCuePlaces gave them.
Result<double> CostOfPoints(const TrainingRig& rig, Compiler* compiler, std::span<const Index> totals,
                            std::span<const CandidateStage> stages, std::span<const CueRef> cues);

// Patches that could miss by themselves, whatever the cues, and what each region of them costs of the full
// evaluation: with the points that deformers ask for about it, and since what it reads was seldom read
// lately. tiles 0 where nothing would be local, or what a tile holds comes out elsewhere.
Result<PatchLayout> PricePatches(const TrainingRig& rig, Compiler* compiler, std::span<const Index> totals);

}  // namespace kpsa::engine
