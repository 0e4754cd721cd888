#include "bench/ablation_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "bench/ablation_q_deim.h"
#include "kpsa/training/estimator.h"
#include "kpsa/training/varimax.h"

namespace kpsa::engine::ablation {
namespace {

constexpr std::size_t kScalars = 80;
constexpr unsigned kRandomSeeds = 10;
constexpr double kMinMotion = 1e-3;  // of the largest: what moves less is no cue

using Cues = std::vector<CueRef>;
using Sort = AblationPoses::Sort;

class PointsTable {
 public:
  PointsTable(AblationPoses* poses, std::span<const std::size_t> counts,
              const std::function<void(const PointsRow&)>& done)
      : poses_(*poses), pca_(poses->pca), counts_(counts), done_(done) {}

  void Run() {
    const PoseLayout& layout = pca_.layout;
    output_cost_ = poses_.PointsComputed({{CueKind::kOutput, static_cast<Index>(layout.points / 2)}});
    stage_cost_ = poses_.PointsComputed({{CueKind::kStage, static_cast<Index>(layout.stage_points / 2)}});
    for (const int per_mode : {1, 2}) {
      Add(fmt::format("paper: {} a mode, output points", per_mode), "LS", [&](std::size_t k) {
        return LeastSquares(KeyPoints(k, per_mode), k / static_cast<std::size_t>(per_mode));
      });
    }
    Add("paper: 2 a mode, output points", "MAP", [&](std::size_t k) { return Map(KeyPoints(k, 2)); });
    Add("Q-DEIM, 3 modes a point, output points", "LS",
        [&](std::size_t k) { return LeastSquares(Pivots(k, false), 3 * k); });
    Add("Q-DEIM, output points", "MAP", [&](std::size_t k) { return Map(Pivots(k, false)); });
    Add("Q-DEIM of modes times deviations", "MAP", [&](std::size_t k) { return Map(Pivots(k, true)); });
    Add("A-optimal, output points", "LS",
        [&](std::size_t k) { return LeastSquares(Optimal(k, true, false), k / 2); });
    Add("A-optimal, output points", "MAP", [&](std::size_t k) { return Map(Optimal(k, true, false)); });
    if (layout.stage_points > 0) AddStages();
    for (const bool map : {false, true}) {
      Add(fmt::format("random output points, median of {}", kRandomSeeds), map ? "MAP" : "LS",
          [&](std::size_t k) { return RandomPoints(k, map); });
    }
    AddScalars("", {Sort::kLocal});
    AddScalars(", world matrices among them", {Sort::kLocal, Sort::kMatrix});
    AddScalars(", and products", {Sort::kLocal, Sort::kMatrix, Sort::kProduct});
  }

 private:
  void AddStages() {
    Add("A-optimal, points before the last stage", "MAP",
        [&](std::size_t k) { return Map(Optimal(k, false, true)); });
    Add("A-optimal by cost, both sorts of points", "MAP",
        [&](std::size_t k) { return Map(Optimal(k, true, true)); });
    const Cues scalars = Scalars({Sort::kLocal});
    Add(fmt::format("the same and {} scalars", kScalars), "MAP",
        [&](std::size_t k) { return Map(Optimal(k, true, true, scalars)); });
    Add(fmt::format("points before the last stage, {} scalars", kScalars), "MAP",
        [&](std::size_t k) { return Map(Optimal(k, false, true, scalars)); });
  }
  void AddScalars(const char* among, const std::vector<Sort>& sorts) {
    const PointsScore score = Map(Scalars(sorts));
    Add(fmt::format("{} scalars alone{}", kScalars, among), "MAP", [&](std::size_t) { return score; });
  }
  void Add(const std::string& cues, const char* estimator,
           const std::function<PointsScore(std::size_t)>& score) {
    PointsRow row{cues, estimator, {}};
    for (const std::size_t count : counts_) row.scores.push_back(score(count));
    done_(row);
  }

  Cues KeyPoints(std::size_t count, int per_mode) const {
    Eigen::MatrixXd rotated = TruncatedPca(pca_, static_cast<Eigen::Index>(count) / per_mode).output_modes();
    Varimax({}, 3, &rotated);
    return SelectKeyPoints(rotated, 3, poses_.positions, per_mode, 0.05 * poses_.diagonal);
  }
  // Of as many modes as the points have coordinates.
  Cues Pivots(std::size_t count, bool weighted) const {
    const Pca pca = TruncatedPca(pca_, static_cast<Eigen::Index>(3 * count));
    Eigen::MatrixXd modes = pca.output_modes();
    if (weighted) modes *= pca.singular.asDiagonal();
    Cues cues;
    for (const Index point : QDeimPoints(modes, 3, count)) cues.push_back({CueKind::kOutput, point});
    return cues;
  }
  // A-optimal points besides what is fixed. Of two sorts they are weighed by the points that each has to
  // compute.
  Cues Optimal(std::size_t count, bool outputs, bool stages, const Cues& fixed = {}) const {
    CueSelectionOptions options;
    options.fixed = fixed;
    options.count = fixed.size() + count;
    options.swap_passes = 0;
    if (outputs && stages) {
      options.marginal_cost = [this](CueRef cue, std::span<const CueRef>) {
        return cue.kind == CueKind::kOutput ? output_cost_ : stage_cost_;
      };
    }
    return SelectCues(pca_, AllCandidates(pca_, kMinMotion, outputs, stages, false), poses_.positions,
                      poses_.noise, options)
        .cues;
  }
  Cues Scalars(const std::vector<Sort>& sorts) const {
    Cues candidates = AllCandidates(pca_, kMinMotion, false, false, true);
    std::erase_if(candidates, [&](const CueRef& cue) {
      const auto column = static_cast<Eigen::Index>(CueColumn(pca_.layout, cue));
      return std::ranges::find(sorts, poses_.SortOf(cue.index)) == sorts.end() ||
             pca_.row_variance[column] <= poses_.noise.scalars[cue.index];
    });
    CueSelectionOptions options;
    options.count = kScalars;
    options.swap_passes = 0;
    return SelectCues(pca_, candidates, poses_.positions, poses_.noise, options).cues;
  }

  PointsScore Map(const Cues& cues) {
    const CueSet set = MakeCueSet(pca_, cues, poses_.noise);
    return Judge(pca_, set, MapEstimator(pca_, set), cues);
  }
  PointsScore LeastSquares(const Cues& cues, std::size_t modes) {
    const Pca pca = TruncatedPca(pca_, static_cast<Eigen::Index>(modes));
    const CueSet set = MakeCueSet(pca, cues, poses_.noise);
    return Judge(pca, set, LeastSquaresEstimator(pca, set), cues);
  }
  PointsScore Judge(const Pca& pca, const CueSet& set, const Estimator& estimator, const Cues& cues) {
    const std::vector<PoseErrors> errors = EstimateErrors(pca, set, estimator, *poses_.test);
    PointsScore score;
    score.rms = 100 * RmsError(errors, pca.layout.points) / poses_.diagonal;
    for (const PoseErrors& error : errors)
      score.max = std::max(score.max, 100 * error.largest / poses_.diagonal);
    score.cue_us = poses_.Microseconds(cues);
    score.fell_back = !estimator.warning.empty();
    return score;
  }
  PointsScore RandomPoints(std::size_t count, bool map) {
    std::vector<PointsScore> scores;
    for (unsigned seed = 1; seed <= kRandomSeeds; ++seed) {
      std::mt19937 random(seed);
      Cues cues;
      while (cues.size() < std::min(count, pca_.layout.points)) {
        const CueRef cue{CueKind::kOutput, static_cast<Index>(random() % pca_.layout.points)};
        if (std::find(cues.begin(), cues.end(), cue) == cues.end()) cues.push_back(cue);
      }
      scores.push_back(map ? Map(cues) : LeastSquares(cues, count / 2));
    }
    std::ranges::sort(scores, {}, &PointsScore::rms);
    return scores[kRandomSeeds / 2];
  }

  AblationPoses& poses_;
  const Pca& pca_;
  const std::span<const std::size_t> counts_;
  const std::function<void(const PointsRow&)>& done_;
  double stage_cost_ = 1, output_cost_ = 1;
};

}  // namespace

void ComparePoints(AblationPoses* poses, std::span<const std::size_t> counts,
                   const std::function<void(const PointsRow&)>& done) {
  PointsTable(poses, counts, done).Run();
}

std::string PointsHeader(std::span<const std::size_t> counts) {
  std::string text = fmt::format("{:<46}{:<4}", "cues", "by");
  for (const std::size_t count : counts) text += fmt::format("{:>28}", fmt::format("{} points", count));
  text += fmt::format("\n{:<50}", "");
  for (std::size_t i = 0; i < counts.size(); ++i) text += fmt::format("{:>28}", "RMS %   max %   cues us");
  return text + "\n";
}

std::string PointsText(const PointsRow& row) {
  std::string text = fmt::format("{:<46}{:<4}", row.cues, row.estimator);
  for (const PointsScore& score : row.scores) {
    text += fmt::format("{:>28}", fmt::format("{:.4f} {:>7.3f} {:>8.1f}{}", score.rms, score.max,
                                              score.cue_us, score.fell_back ? "*" : " "));
  }
  return text + "\n";
}

}  // namespace kpsa::engine::ablation
