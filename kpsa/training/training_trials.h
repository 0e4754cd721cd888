// Subspaces that training calibrated one after the other, of which the cheapest stays; those with
// cues of tiles are compared with others as candidates are. Internal to training.
#pragma once

#include "kpsa/subspace.h"
#include "kpsa/training/cue_selection.h"
#include "kpsa/training/frame_cost.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {

struct CalibratedSubspace {
  Subspace subspace;
  CueSet cues;
  TrainingRecord record;  // with the calibration of this one
  FrameCost cost;         // but its points
  bool fine = false;      // its tiles
};

class TrainingTrials {
 public:
  // full: what the whole evaluation costs (ns, on the scale of the nodes' costs).
  // alike: of the cost with cues for all points, at which those of tiles are taken.
  TrainingTrials(double full, double alike) : full_(full), alike_(alike) {}

  // points: what the graph spends until the points among the cues are there (ns). what: as
  // TrainingRecord::Tried says it. weight: of what it costs, in the comparison.
  void Add(const char* what, double points, CalibratedSubspace tried, double weight = 1);

  const FrameCost& least() const { return best_.cost; }
  double least_ns() const { return best_ns_; }  // with its points
  // The cheapest; its record tells of all, after those that were tried `earlier` by other names.
  CalibratedSubspace Take(std::vector<TrainingRecord::Tried> earlier);

 private:
  double full_, alike_;
  std::vector<TrainingRecord::Tried> tried_;
  CalibratedSubspace best_;
  double best_ns_ = 0, least_weighed_ = 0;
  std::size_t best_of_ = 0;
};

}  // namespace kpsa::engine
