// What each cue costs: its part of the time that measuring all of them takes (BenchResult::cues_ms).
//
// Cues are measured together, so a cue alone would cost more than its part: neighbours share what they need. The time of a
// deformer goes to the stages whose cues it serves, by the points that each of them makes it compute, and within a stage in equal
// parts; what the KPSA node takes to gather numbers goes to all cues by their numbers. The transforms and drivers that move
// cues are in none of them: guards watch these in any case, and a bench counts them as graph.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host/acceleration.h"
#include "host/bench/side.h"

namespace kpsa::engine {

class CueCosts {
 public:
  // Of the plan of a clip, with the subspaces in place in its rig. Costs nothing where the cues of a stage do not compile by
  // themselves.
  void Load(const Rig& rig, const Plan& plan, const std::vector<AppliedSubspace>& applied,
            Compiler* compiler);
  // All frames of the clip; nanoseconds are scaled.
  void Add(const RecordedSteps& recorded, double scale);
  // [subspaces][cues] of Subspace::cues, microseconds a frame. They sum up to all that was added.
  std::vector<std::vector<double>> Finish(double frames) const;

 private:
  struct Stage {  // the cues of one input of a node
    std::size_t subspace = 0;
    std::vector<std::size_t> cues;         // of its cues
    std::map<std::string, double> points;  // by step: that are computed for them
  };
  struct Step {
    Index index = 0;
    std::string name;
    double points = 0;  // of all stages together
  };
  std::vector<Stage> stages_;  // of the present clip, as are the steps
  std::vector<Step> steps_;
  std::vector<std::vector<double>> numbers_;  // [subspaces][cues] that are gathered
  std::vector<std::vector<double>> ns_;       // likewise
};

}  // namespace kpsa::engine
