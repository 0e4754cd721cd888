#include "kpsa/training/cue_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "kpsa/calibration.h"
#include "kpsa/training/estimator.h"
#include "kpsa/training/make_subspace.h"
#include "kpsa/training/mode_choice.h"
#include "kpsa/training/varimax.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kSelectionRounds = 4;  // shares of the cues, each chosen for what the last ones left
constexpr std::size_t kErrorPoses = 800;     // training poses that say where errors are left
constexpr double kErrorPower = 3;            // of a point's largest error in its weight
constexpr double kDear = 0.4;                // share of the cost, from which points are priced
constexpr double kPointPrice = 12;           // rows: what a point then has to be worth
constexpr double kMinMotion = 1e-3;          // of the largest: points that move less are no cues
// Share of the poses beyond the tolerance from which worst points are measured: where no judge says what
// misses, and where more than kMissed of the judges do
constexpr double kHopeless = 0.15, kHopelessWhereMissed = 0.01, kMissed = 0.02;
constexpr std::size_t kWorstRounds = 6, kWorstPoints = 8;  // at most so many times so many
constexpr double kWorstShare = 0.1;                        // and of all points
constexpr double kWorthwhile = 0.5;  // of the poses beyond the tolerance that must be left by them

// Of the rows: fewer are tried, until more judges miss; not where many do
constexpr double kFewer[] = {0.5, 0.35};
constexpr double kMissedMore = 0.004;  // of the judges: fewer rows may add so much
constexpr double kManyMissed = 0.05;
constexpr double kHalf = 0.5;  // of the cost, for others
constexpr std::size_t kOthers = 2;

constexpr double kStricter = 0.5;  // of the tolerance: clips that nobody trained on err up to so much more

// Values that move more than they are trusted.
std::vector<CueRef> Candidates(const Pca& pca, const CueNoise& noise, const std::vector<CueRef>& place,
                               std::size_t max_outputs) {
  std::vector<CueRef> candidates = place;
  for (Index i = 0; i < pca.layout.scalars; ++i) candidates.push_back({CueKind::kScalar, i});
  candidates = MovingCandidates(pca, kMinMotion, candidates);
  std::erase_if(candidates, [&](const CueRef& cue) {
    const auto column = static_cast<Eigen::Index>(CueColumn(pca.layout, cue));
    return cue.kind == CueKind::kScalar && !noise.scalars.empty() &&
           pca.row_variance[column] <= noise.scalars[cue.index];
  });
  std::ranges::stable_sort(candidates, {}, &CueRef::kind);
  const auto outputs = static_cast<std::size_t>(std::count_if(
      candidates.begin(), candidates.end(), [](const CueRef& c) { return c.kind == CueKind::kOutput; }));
  if (max_outputs == 0 || outputs <= max_outputs) return candidates;
  const std::vector<Index> kept = GoldenSpread(outputs, max_outputs);  // outputs come first
  std::vector<CueRef> thinned;
  for (const Index i : kept) thinned.push_back(candidates[i]);
  thinned.insert(thinned.end(), candidates.begin() + static_cast<std::ptrdiff_t>(outputs), candidates.end());
  return thinned;
}

class Chooser {
 public:
  Chooser(const Pca& pca, std::span<const Double3> positions, const CueNoise& noise, const PoseMatrix& poses,
          const CueChoiceOptions& options)
      : pca_(pca), positions_(positions), noise_(noise), poses_(poses), options_(options) {}

  CueChoice Run() {
    std::vector<CuePlace> places = options_.places;
    if (places.empty()) {
      const bool stages = pca_.layout.stage_points > 0;
      places.push_back(AllCandidates(pca_, kMinMotion, !stages, stages, false));
    }
    const bool compares = options_.judges != nullptr;
    for (const CuePlace& place : places) {
      place_ = static_cast<std::size_t>(&place - places.data());
      const bool better = TryPlace(place);
      if (chosen_.empty()) continue;
      if (!compares) return {std::move(chosen_), place_};
      if (!better) break;  // earlier ones see even less
    }
    if (options_.may_choose_rows && !best_.cues.empty()) ChooseRows(places);
    FindCheaper();
    return std::move(best_);
  }

 private:
  // Whether it is cheaper than those before.
  bool TryPlace(const CuePlace& place) {
    const bool compares = options_.judges != nullptr;
    chosen_.clear();
    SelectInRounds(place, 3);
    if (chosen_.empty()) return false;
    AddPoints(place);
    bool better = compares && KeepIfCheaper();
    if (better && !options_.by_rms && options_.points_cost(chosen_) > kDear * best_.cost) {
      const std::vector<CueRef> many = std::exchange(chosen_, {});
      SelectInRounds(place, kPointPrice);
      AddPoints(place);
      if (!KeepIfCheaper()) chosen_ = many;
    }
    const bool early = std::any_of(chosen_.begin(), chosen_.end(),
                                   [](const CueRef& cue) { return cue.kind == CueKind::kStage; });
    const double hopeless = compares && best_.misses > kMissed ? kHopelessWhereMissed : kHopeless;
    if (early && !options_.by_rms && AddWorstPoints(hopeless)) better |= compares && KeepIfCheaper();
    return better;
  }

  // As few rows as the judges do not miss more often with, with half the tolerance, too, since clips err more
  // than judges do.
  void ChooseRows(const std::vector<CuePlace>& places) {
    const CueChoice all = best_;
    if (std::max(all.misses, all.misses_of_stricter) > kManyMissed) return;
    const bool has_worst = std::ranges::any_of(all.cues, [&](const CueRef& cue) {
      return std::ranges::find(places[all.place], cue) == places[all.place].end() &&
             cue.kind != CueKind::kScalar;
    });
    place_ = all.place;
    const double price = best_price_;
    for (const double share : kFewer) {
      const CueChoice before = best_;
      rows_ = static_cast<std::size_t>(share * static_cast<double>(options_.rows));
      chosen_.clear();
      SelectInRounds(places[place_], price);
      AddPoints(places[place_]);
      if (has_worst) AddWorstPoints(kHopeless);
      if (!chosen_.empty() && KeepIfCheaper() && best_.misses <= all.misses + kMissedMore &&
          best_.misses_of_stricter <= all.misses_of_stricter + kMissedMore)
        continue;
      best_ = before;
      break;
    }
  }

  void FindCheaper() {
    for (CueChoice::Other& other : tried_) {
      if (other.cost_of_hits < kHalf * best_.cost && other.cues != best_.cues)
        best_.cheaper.push_back(std::move(other));
    }
    std::ranges::stable_sort(best_.cheaper, {}, &CueChoice::Other::cost);
    if (best_.cheaper.size() > kOthers) best_.cheaper.resize(kOthers);
  }

  // Whether what is chosen is expected to cost less than the best so far, which it then is.
  bool KeepIfCheaper() {
    double rows = 0;
    for (const CueRef& cue : chosen_) rows += cue.kind == CueKind::kScalar ? 1 : 3;
    const Missed missed = Misses(chosen_);
    const double of_hits = options_.points_cost(chosen_) + kScoreCost * rows * rows,
                 cost = of_hits + missed.share * options_.miss_cost;
    tried_.push_back({chosen_, cost, of_hits});
    if (!best_.cues.empty() && cost >= best_.cost) return false;
    best_ = {chosen_, place_, cost, missed.share, missed.of_stricter};
    best_price_ = price_;
    return true;
  }

  PointSurvey Survey(const std::vector<CueRef>& chosen) const {
    const CueSet cues = MakeCueSet(pca_, chosen, noise_);
    return SurveyPoints(pca_, cues, MapEstimator(pca_, cues, EstimatorParts::kNoGain), poses_,
                        std::max<std::size_t>(1, poses_.poses() / kErrorPoses), options_.tolerance);
  }

  // Share of the poses that SoftCache would not accept, calibrated with the judges of all kinds: of the
  // sampled ones, which are new, and of the training poses, among them the frames of clips, in equal parts.
  struct Missed {
    double share = 0, of_stricter = 0;  // with the tolerance, and with kStricter of it
  };
  Missed Misses(const std::vector<CueRef>& chosen) const {
    const CueSet cues = MakeCueSet(pca_, chosen, noise_);
    const Estimator estimator = MapEstimator(pca_, cues, EstimatorParts::kReach);
    const Eigen::MatrixXd trained = MeasuredPoses(pca_.layout, cues, poses_),
                          judges = MeasuredPoses(pca_.layout, cues, *options_.judges);
    const SoftCacheModel model = MakeSoftCacheModel(estimator, cues, trained);
    const PointSurvey survey = SurveyPoints(pca_, cues, estimator, *options_.judges, 1);
    const std::vector<double> scores = Scores(model, judges);
    std::vector<CalibrationPair> pairs;
    const std::vector<int>& kinds = options_.judge_kinds;
    std::vector<double> sampled;
    for (std::size_t t = 0; t < scores.size(); ++t) {
      pairs.push_back({scores[t], survey.by_pose[t], 0, kinds.empty() ? 0 : kinds[t]});
      if (pairs.back().kind == 0) sampled.push_back(scores[t]);
    }
    const std::vector<double> of_trained = Scores(model, trained);
    const auto missed = [&](double tolerance) {
      const double hits =
          Calibrate(pairs, tolerance, options_.violation_rate, kBlendStart, kEvenOdds).threshold.tau_lo();
      const auto share = [&](const std::vector<double>& of) {
        return static_cast<double>(
                   std::ranges::count_if(of, [&](double score) { return !(score <= hits); })) /
               static_cast<double>(of.size());
      };
      return (share(sampled) + share(of_trained)) / 2;
    };
    return {missed(options_.tolerance), missed(kStricter * options_.tolerance)};
  }
  static std::vector<double> Scores(const SoftCacheModel& model, const Eigen::MatrixXd& measured) {
    SoftCacheThreshold always;
    always.tau = std::numeric_limits<double>::infinity();
    AlignedArray<float> y(model.padded_rows()), g(model.padded_rows());
    std::vector<double> scores;
    for (Eigen::Index t = 0; t < measured.cols(); ++t) {
      Eigen::Map<Eigen::VectorXf>(y.data(), measured.rows()) = measured.col(t).cast<float>();
      scores.push_back(Judge(model, always, y.span(), g.span()).score);
    }
    return scores;
  }

  // A row costs what it costs at run time, whatever it measures; a cue of three rows has to be worth them.
  void SelectInRounds(const std::vector<CueRef>& place, double point_price) {
    price_ = point_price;
    const std::vector<CueRef> candidates = Candidates(pca_, noise_, place, options_.max_outputs);
    std::vector<double> weights;
    const std::size_t rounds = options_.by_rms ? 1 : kSelectionRounds;
    for (std::size_t round = 1; round <= rounds; ++round) {
      CueSelectionOptions selection;
      selection.fixed = chosen_;
      selection.count = rows_;
      // At other prices as many points fit in as have to be there
      const double budget =
          static_cast<double>(rows_) + (point_price - 3) * static_cast<double>(options_.min_points);
      selection.max_cost = budget * static_cast<double>(round) / static_cast<double>(rounds);
      selection.marginal_cost = [point_price](CueRef cue, std::span<const CueRef>) {
        return cue.kind == CueKind::kScalar ? 1.0 : point_price;
      };
      selection.point_weights = weights;
      chosen_ = SelectCues(pca_, candidates, positions_, noise_, selection).cues;
      if (round == rounds || chosen_.empty()) break;
      weights = Survey(chosen_).largest;
      double mean = 0;
      for (const double error : weights) mean += error / static_cast<double>(weights.size());
      for (double& weight : weights) weight = std::pow(weight / std::max(mean, 1e-300), kErrorPower) + 1e-3;
    }
  }

  void AddPoints(const std::vector<CueRef>& place) {
    std::vector<CueRef> points = Candidates(pca_, noise_, place, options_.max_outputs);
    std::erase_if(points, [](const CueRef& cue) { return cue.kind == CueKind::kScalar; });
    std::size_t have = 0;
    for (const CueRef& cue : chosen_) have += cue.kind != CueKind::kScalar;
    if (have >= options_.min_points) return;
    CueSelectionOptions more;
    more.fixed = chosen_;
    more.count = chosen_.size() + options_.min_points - have;
    more.swap_passes = 0;
    chosen_ = SelectCues(pca_, points, positions_, noise_, more).cues;
  }

  // Whether it added any.
  bool AddWorstPoints(double hopeless) {
    PointSurvey survey = Survey(chosen_);
    const std::size_t before = survey.poses_beyond(options_.tolerance);
    if (static_cast<double>(before) < hopeless * static_cast<double>(survey.poses())) return false;
    const auto most = static_cast<std::size_t>(kWorstShare * static_cast<double>(pca_.layout.points));
    std::vector<CueRef> more = chosen_;
    for (std::size_t round = 0; round < kWorstRounds && survey.poses_beyond(options_.tolerance) > 0;
         ++round) {
      std::vector<Index> order(pca_.layout.points);
      std::iota(order.begin(), order.end(), Index{0});
      std::stable_sort(order.begin(), order.end(),
                       [&](Index a, Index b) { return survey.beyond[a] > survey.beyond[b]; });
      std::size_t added = 0;
      for (const Index point : order) {
        if (added == kWorstPoints || more.size() == chosen_.size() + most || survey.beyond[point] == 0) break;
        if (!options_.measurable.empty() && !options_.measurable[point]) continue;
        const CueRef cue{CueKind::kOutput, point};
        if (std::find(more.begin(), more.end(), cue) != more.end()) continue;
        more.push_back(cue);
        ++added;
      }
      if (added == 0) break;
      survey = Survey(more);
    }
    if (more.size() == chosen_.size() || static_cast<double>(survey.poses_beyond(options_.tolerance)) >
                                             kWorthwhile * static_cast<double>(before))
      return false;
    chosen_ = std::move(more);
    return true;
  }

  const Pca& pca_;
  std::span<const Double3> positions_;
  const CueNoise& noise_;
  const PoseMatrix& poses_;
  const CueChoiceOptions& options_;
  std::size_t place_ = 0, rows_ = options_.rows;
  double price_ = 0, best_price_ = 0;  // of a point, in rows
  std::vector<CueChoice::Other> tried_;
  std::vector<CueRef> chosen_;
  CueChoice best_;
};

}  // namespace

CueChoice ChooseCues(const Pca& pca, std::span<const Double3> positions, const CueNoise& noise,
                     const PoseMatrix& poses, const CueChoiceOptions& options) {
  return Chooser(pca, positions, noise, poses, options).Run();
}

std::vector<CueRef> ChoosePaperCues(const Pca& pca, std::span<const Double3> positions, double diagonal) {
  Eigen::MatrixXd rotated = pca.output_modes();
  Varimax({}, 3, &rotated);
  return SelectKeyPoints(rotated, 3, positions, 2, 0.05 * diagonal);
}

}  // namespace kpsa::engine
