// The cues of a subspace: which values are measured, by the training poses.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "kpsa/training/cue_selection.h"
#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine {

using CuePlace = std::vector<CueRef>;  // points that may be measured together

struct CueChoiceOptions {
  std::size_t rows = 300;        // of measurements: a point takes 3, a scalar 1
  bool may_choose_rows = false;  // fewer of them, where judges miss no more
  std::size_t min_points = 16;   // points see what no scalar does: some of them are kept to judge by
  double tolerance = 1e-4;       // scene units
  // Where errors count by their RMS alone (light, with its noise): one round, no worst points.
  bool by_rms = false;
  std::vector<bool> measurable = {};  // by output row: a point that the graph can give; empty: all
  std::size_t max_outputs = 0;        // output points that may become cues, spread; 0: all
  // Where points may be measured, the dearest place first, each seeing more than the next
  // (kpsa/training/cue_places.h); empty: the points of stages, or where there are none, the outputs.
  std::vector<CuePlace> places = {};
  // With what places are compared: poses that were not trained on, centred with pca.mean; what the graph
  // spends until the points among some cues are there, and what it spends on a miss (ns). Null: the first
  // place that has cues is taken.
  const PoseMatrix* judges = nullptr;
  std::vector<int> judge_kinds = {};  // PoseKind of each; empty: all are sampled ones
  std::function<double(std::span<const CueRef>)> points_cost = {};
  double miss_cost = 0;
  double violation_rate = 0.01;
};

// What SoftCache's own score costs, for the square of a row; ns on the scale of the nodes' costs.
inline constexpr double kScoreCost = 0.04;

// The confidence of a calibration where few judges stand for many calibration poses.
inline constexpr double kEvenOdds = 0.5;

struct CueChoice {
  std::vector<CueRef> cues;
  // Where judges compared places, of the one that was taken: its number, the expected time of a frame
  // (points, score, misses), and the share of misses; likewise with half the tolerance.
  std::size_t place = 0;
  double cost = 0, misses = 0, misses_of_stricter = 0;
  // Others that would cost less than half of it if none missed, at most two, those first that are expected to
  // cost least: the score that compared them here is not the one that a subspace gets
  // (kpsa/training/score_choice.h).
  struct Other {
    std::vector<CueRef> cues;
    double cost = 0, cost_of_hits = 0;
  };
  std::vector<Other> cheaper = {};
};

// A-optimal cues (kpsa/training/cue_selection.h): points of one place and scalars, in rounds: after each
// share of the rows, points count by the largest errors that training poses still have there. The least
// expected squared error alone leaves small regions to chance (a tongue behind teeth). The place is the one
// of the least expected cost: of its points, and of the full evaluation where SoftCache would miss.
//
// Where earlier stages do not tell what the last one does in a few places (the inside of a bent elbow, where
// deltaMush's frames turn over), so that the tolerance would hardly ever be kept, the worst output points are
// measured themselves, besides `rows`; not if that does not help, or costs more than it saves.
CueChoice ChooseCues(const Pca& pca, std::span<const Double3> positions, const CueNoise& noise,
                     const PoseMatrix& poses, const CueChoiceOptions& options);

// The paper's: two points for each varimax-rotated mode.
std::vector<CueRef> ChoosePaperCues(const Pca& pca, std::span<const Double3> positions, double diagonal);

}  // namespace kpsa::engine
