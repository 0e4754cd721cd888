// Which values of the graph to measure. Glossary: K cues, r rows (a point has 3, a scalar 1), M modes, L
// their variances, C_i the rows of candidate i in mode space [h x M], s^2 its noise.
//
// SelectKeyPoints is the rule of the paper: for each varimax-rotated mode the point or the two points that
// move most. SelectCues is Bayesian A-optimal design (Chaloner, Verdinelli 1995), greedy: Sigma starts as L;
// the gain of a candidate is the fall of the expected squared error of the outputs,
//   T = C_i Sigma,  G = T C_i^T + noise,  gain = tr(G^-1 T W T^T),  W = A_out^T A_out;
// the largest gain per marginal cost is taken and Sigma -= T^T G^-1 T. Swaps finish. All gains are exact in
// every step: H_i = C_i Sigma F^T (W = F^T F) and G_i are kept per candidate and corrected by the rank of the
// cue just taken (6hM flops a candidate), and refreshed from Sigma in float64 before float32 rounding shows.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "base/types.h"
#include "kpsa/training/pca.h"

namespace kpsa::engine {

enum class CueKind : std::uint8_t { kOutput, kStage, kScalar };

// A value that can be measured: an output point, a point of an earlier stage, or a scalar; `index` counts
// within its kind as the layout of the poses does (kpsa/training/pose_matrix.h).
struct CueRef {
  CueKind kind = CueKind::kOutput;
  Index index = 0;
  // A point, or an entry of a relative matrix, is measured in the space of a joint: the scalar of the first
  // entry of its relative matrix (kpsa/training/cue_values.h). Cues of single tiles alone.
  Index joint = kNoIndex;
  friend bool operator==(const CueRef&, const CueRef&) = default;
};
// Its first column among the D columns of a pose, and how many it has.
std::size_t CueColumn(const PoseLayout& layout, CueRef cue);
std::size_t CueHeight(const PoseLayout& layout, CueRef cue);

// The rows of a set of cues as the estimators see them. y = (raw - mean) * scale, y = C q + noise.
struct CueSet {
  std::vector<CueRef> cues;    // [K]
  std::vector<Index> offsets;  // [K + 1] first row of each cue
  Eigen::MatrixXd loadings;    // C [r x M]
  Eigen::VectorXd mean;        // [r] raw unit
  Eigen::VectorXd scale;       // [r] 1 for points, 1 / trained deviation for scalars (1 if it never moved)
  Eigen::VectorXd noise;       // [r] variance, in units of y
  Eigen::Index rows() const { return mean.size(); }
};
// What a measurement is not trusted below: variances of a coordinate (scene units) and of each scalar (raw
// units). Differences that no one would see are no information, however well the training poses agree on
// them: rounding far from the origin, a joint that a clip turns a little about an axis that no control has.
struct CueNoise {
  // Rounding alone; diagonal: of the model's bounding box, scene units.
  CueNoise(double diagonal) : point(1e-12 * diagonal * diagonal) {}  // NOLINT: a model's size is its noise
  double point = 0;
  std::vector<double> scalars = {};  // [scalars of the layout]; empty: none
};
// noise of a row: the largest of pca.output_noise(), that of CueNoise, and what the modes leave unexplained
// of that row; for scalars, in their normalised unit, at least 1e-6.
CueSet MakeCueSet(const Pca& pca, std::span<const CueRef> cues, const CueNoise& noise);

struct CueSelectionOptions {
  std::size_t count = 40;  // cues at most
  double max_cost = 0;     // stop before the summed marginal cost exceeds it; 0: no limit
  double min_distance =
      0;  // points nearer than this to a chosen point of the same kind are left out (coincident ones always)
  int swap_passes = 1;  // each pass offers every cue to be exchanged once
  std::span<const double> point_weights =
      {};                              // [N] of the squared errors of the output points; empty: 1 each
  std::span<const CueRef> fixed = {};  // taken first, whatever their gain, candidates or not
  // Cost of adding a candidate to what is chosen, > 0 (ns, say); empty: 1 each. Called for every candidate in
  // every step from one thread, so it should be a look-up.
  std::function<double(CueRef candidate, std::span<const CueRef> chosen)> marginal_cost = {};
};

struct CueSelection {
  std::vector<CueRef> cues;          // in order of choice (swaps replace in place)
  std::vector<double> expected_rms;  // [cues] expected RMS point error after each greedy step, scene units
  double final_rms = 0;              // after the swaps
  double cost = 0;                   // summed marginal costs
  int swaps = 0;
};

// Those of the cues that move: without scalars that never moved, and points whose RMS motion is below
// `min_motion` (1e-4, say) of the largest of their kind among them.
std::vector<CueRef> MovingCandidates(const Pca& pca, double min_motion, std::span<const CueRef> cues);
// All that move of the points and scalars of the layout.
std::vector<CueRef> AllCandidates(const Pca& pca, double min_motion, bool outputs, bool stages, bool scalars);

// positions: the rest positions of outputs, then stage points, [N + P] (for distances). Candidates: none
// twice.
CueSelection SelectCues(const Pca& pca, std::span<const CueRef> candidates,
                        std::span<const Double3> positions, const CueNoise& noise,
                        const CueSelectionOptions& options);

// The paper's rule. rotated [cN x M] (kpsa/training/varimax.h); per_mode 1 or 2; the second point of a mode
// lies outside exclusion_radius of the first. A point that another mode has taken already, or one that
// coincides with it, gives way to the next best. Fewer points come out only if no point is left.
std::vector<CueRef> SelectKeyPoints(const Eigen::MatrixXd& rotated, int components,
                                    std::span<const Double3> positions, int per_mode,
                                    double exclusion_radius);

}  // namespace kpsa::engine
