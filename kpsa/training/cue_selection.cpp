#include "kpsa/training/cue_selection.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/selection_kernel.h"

namespace kpsa::engine {
namespace {

constexpr double kScalarNoise = 1e-6;  // least variance of a normalised scalar's noise

Double3 Position(CueRef cue, const PoseLayout& layout, std::span<const Double3> positions) {
  return positions[cue.kind == CueKind::kStage ? layout.points + cue.index : cue.index];
}

// Root of W = A_out^T D A_out, D the weights of the points; empty where that is the identity.
Eigen::MatrixXd OutputRoot(const Pca& pca, std::span<const double> point_weights) {
  if (pca.output_orthonormal && point_weights.empty()) return {};
  Eigen::MatrixXd a = pca.output_modes();
  if (!point_weights.empty()) {
    Eigen::VectorXd root(a.rows());
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      root[i] = std::sqrt(
          point_weights[static_cast<std::size_t>(i) / static_cast<std::size_t>(pca.layout.components)]);
    }
    a = (root.asDiagonal() * a).eval();
  }
  const SymmetricEigen eigen = AllEigen(Gram(GemmOperand::Dense(a).Transposed()));
  return eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
}

// The state of a greedy selection.
class Selector {
 public:
  Selector(const Pca& pca, std::span<const CueRef> candidates, std::span<const Double3> positions,
           const CueNoise& noise, const CueSelectionOptions& options)
      : pca_(pca),
        candidates_(candidates),
        positions_(positions),
        options_(options),
        root_(OutputRoot(pca, options.point_weights)),
        gains_(MakeGains(pca, candidates, noise, root_)) {
    sigma_ = pca.mode_variance().asDiagonal();
    weight_ = root_.size() == 0 ? Eigen::MatrixXd() : Multiply(root_.transpose(), root_);
    blocked_.resize(candidates.size());
    gains_.Reset(sigma_);
  }

  double ExpectedRms() const {
    const double sum = weight_.size() == 0 ? sigma_.trace() : weight_.cwiseProduct(sigma_).sum();
    return std::sqrt(std::max(0.0, sum) / static_cast<double>(pca_.layout.points));
  }

  double Cost(std::size_t candidate) const {
    return options_.marginal_cost ? options_.marginal_cost(candidates_[candidate], chosen_cues_) : 1.0;
  }

  // The candidate with the largest gain for its cost that the budget allows, or the size if none is left.
  std::size_t Best(double budget) const {
    std::size_t best = candidates_.size();
    double best_value = 0;
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      const double gain = gains_.gains()[i];
      if (blocked_[i] > 0 || !(gain > 0)) continue;
      if (!options_.marginal_cost) {
        if (gain > best_value) best_value = gain, best = i;
        continue;
      }
      const double cost = std::max(Cost(i), std::numeric_limits<double>::min());
      if (cost <= budget && gain / cost > best_value) best_value = gain / cost, best = i;
    }
    return options_.marginal_cost || budget >= 1 ? best : candidates_.size();
  }

  void Take(std::size_t candidate, std::size_t place) {
    Change(candidate, -1);
    chosen_.insert(chosen_.begin() + static_cast<std::ptrdiff_t>(place), candidate);
    chosen_cues_.insert(chosen_cues_.begin() + static_cast<std::ptrdiff_t>(place), candidates_[candidate]);
    Block(candidate, 1);
  }

  void GiveBack(std::size_t place) {
    const std::size_t candidate = chosen_[place];
    chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(place));
    chosen_cues_.erase(chosen_cues_.begin() + static_cast<std::ptrdiff_t>(place));
    Block(candidate, -1);
    Change(candidate, 1);
  }

  // Sigma and everything that follows from it, from the chosen cues alone; takes out the rounding of many
  // corrections.
  void Refresh() {
    sigma_ = pca_.mode_variance().asDiagonal();
    for (const std::size_t candidate : chosen_) sigma_ += SigmaChange(candidate, -1);
    gains_.Reset(sigma_);
  }

  std::size_t Find(CueRef cue) const {
    return static_cast<std::size_t>(std::find(candidates_.begin(), candidates_.end(), cue) -
                                    candidates_.begin());
  }
  const std::vector<std::size_t>& chosen() const { return chosen_; }
  const std::vector<CueRef>& chosen_cues() const { return chosen_cues_; }
  double gain(std::size_t candidate) const { return gains_.gains()[candidate]; }

 private:
  static CandidateGains MakeGains(const Pca& pca, std::span<const CueRef> candidates, const CueNoise& noise,
                                  const Eigen::MatrixXd& output_root) {
    const CueSet set = MakeCueSet(pca, candidates, noise);
    std::vector<float> loadings(static_cast<std::size_t>(set.loadings.size()));
    Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        loadings.data(), set.loadings.rows(), set.loadings.cols()) = set.loadings.cast<float>();
    return CandidateGains(set.offsets, std::move(loadings),
                          {set.noise.data(), set.noise.data() + set.noise.size()}, output_root);
  }

  // U [h x M] with Sigma' = Sigma - U^T U after measuring (sign -1), or Sigma + U^T U after forgetting (sign
  // +1).
  Eigen::MatrixXd Factor(std::size_t candidate, double sign) const {
    const Eigen::MatrixXd c = gains_.Loadings(candidate);
    const Eigen::MatrixXd t = c * sigma_;
    Eigen::MatrixXd g = -sign * t * c.transpose();
    g.diagonal() += gains_.Noise(candidate);
    return g.llt().matrixL().solve(t);
  }
  Eigen::MatrixXd SigmaChange(std::size_t candidate, double sign) const {
    const Eigen::MatrixXd u = Factor(candidate, sign);
    return sign * u.transpose() * u;
  }
  void Change(std::size_t candidate, double sign) {
    const Eigen::MatrixXd u = Factor(candidate, sign);
    sigma_ += sign * u.transpose() * u;
    gains_.Apply(u, sign);
  }

  // A chosen point blocks itself, what coincides with it and what lies within the wanted distance.
  void Block(std::size_t candidate, int change) {
    const CueRef cue = candidates_[candidate];
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      if (candidates_[i].kind != cue.kind) continue;
      const bool near = i == candidate ||
                        (cue.kind != CueKind::kScalar &&
                         Length(Position(cue, pca_.layout, positions_) -
                                Position(candidates_[i], pca_.layout, positions_)) <= options_.min_distance);
      if (near) blocked_[i] += change;
    }
  }

  const Pca& pca_;
  std::span<const CueRef> candidates_;
  std::span<const Double3> positions_;
  const CueSelectionOptions& options_;
  const Eigen::MatrixXd root_;  // OutputRoot
  CandidateGains gains_;
  Eigen::MatrixXd sigma_, weight_;  // [M x M]; weight_ W, empty for the identity
  std::vector<std::size_t> chosen_;
  std::vector<CueRef> chosen_cues_;
  std::vector<int> blocked_;  // by how many chosen cues
};

double TotalCost(std::span<const CueRef> cues, const CueSelectionOptions& options) {
  if (!options.marginal_cost) return static_cast<double>(cues.size());
  double cost = 0;
  for (std::size_t i = 0; i < cues.size(); ++i) cost += options.marginal_cost(cues[i], cues.first(i));
  return cost;
}

}  // namespace

std::size_t CueColumn(const PoseLayout& layout, CueRef cue) {
  switch (cue.kind) {
    case CueKind::kOutput:
      return cue.index * static_cast<std::size_t>(layout.components);
    case CueKind::kStage:
      return layout.stage_begin() + 3 * std::size_t{cue.index};
    default:
      return layout.scalar_begin() + cue.index;
  }
}

std::size_t CueHeight(const PoseLayout& layout, CueRef cue) {
  return cue.kind == CueKind::kOutput  ? static_cast<std::size_t>(layout.components)
         : cue.kind == CueKind::kStage ? 3
                                       : 1;
}

CueSet MakeCueSet(const Pca& pca, std::span<const CueRef> cues, const CueNoise& noise) {
  CueSet set;
  set.cues.assign(cues.begin(), cues.end());
  set.offsets.push_back(0);
  for (const CueRef cue : cues)
    set.offsets.push_back(set.offsets.back() + static_cast<Index>(CueHeight(pca.layout, cue)));
  const auto rows = static_cast<Eigen::Index>(set.offsets.back());
  set.loadings.resize(rows, pca.mode_count());
  set.mean.resize(rows);
  set.scale = Eigen::VectorXd::Ones(rows);
  set.noise.resize(rows);
  KPSA_CHECK(noise.scalars.empty() || noise.scalars.size() == pca.layout.scalars);
  const double floor = std::max({pca.output_noise(), noise.point, std::numeric_limits<double>::min()});
  for (std::size_t k = 0; k < cues.size(); ++k) {
    for (Index j = set.offsets[k]; j < set.offsets[k + 1]; ++j) {
      const auto row = static_cast<Eigen::Index>(j);
      const auto column = static_cast<Eigen::Index>(CueColumn(pca.layout, cues[k]) + j - set.offsets[k]);
      const double variance = pca.row_variance[column];
      const bool scalar = cues[k].kind == CueKind::kScalar;
      if (scalar && variance > 0) set.scale[row] = 1 / std::sqrt(variance);
      const double scale = set.scale[row];
      set.loadings.row(row) = pca.modes.row(column) * scale;
      set.mean[row] = pca.mean[column];
      const double raw = scalar && !noise.scalars.empty() ? noise.scalars[cues[k].index] : 0;
      set.noise[row] =
          std::max(scalar ? kScalarNoise : floor, std::max(pca.row_residual[column], raw) * scale * scale);
    }
  }
  return set;
}

std::vector<CueRef> MovingCandidates(const Pca& pca, double min_motion, std::span<const CueRef> cues) {
  const auto motion = [&](CueRef cue) {
    return pca.row_variance
        .segment(static_cast<Eigen::Index>(CueColumn(pca.layout, cue)),
                 static_cast<Eigen::Index>(CueHeight(pca.layout, cue)))
        .sum();
  };
  double largest[3] = {};  // by kind
  const auto of_kind = [&](CueRef cue) -> double& { return largest[static_cast<std::size_t>(cue.kind)]; };
  for (const CueRef& cue : cues) of_kind(cue) = std::max(of_kind(cue), motion(cue));
  std::vector<CueRef> moving;
  for (const CueRef& cue : cues) {
    const double least = cue.kind == CueKind::kScalar ? 0 : min_motion * min_motion * of_kind(cue);
    if (motion(cue) > 0 && motion(cue) >= least) moving.push_back(cue);
  }
  return moving;
}

std::vector<CueRef> AllCandidates(const Pca& pca, double min_motion, bool outputs, bool stages,
                                  bool scalars) {
  std::vector<CueRef> all;
  const auto add = [&](bool wanted, CueKind kind, std::size_t count) {
    for (std::size_t i = 0; wanted && i < count; ++i) all.push_back({kind, static_cast<Index>(i)});
  };
  add(outputs, CueKind::kOutput, pca.layout.points);
  add(stages, CueKind::kStage, pca.layout.stage_points);
  add(scalars, CueKind::kScalar, pca.layout.scalars);
  return MovingCandidates(pca, min_motion, all);
}

CueSelection SelectCues(const Pca& pca, std::span<const CueRef> wanted, std::span<const Double3> positions,
                        const CueNoise& noise, const CueSelectionOptions& options) {
  KPSA_CHECK_EQ(positions.size(), pca.layout.points + pca.layout.stage_points);
  KPSA_CHECK(options.point_weights.empty() || options.point_weights.size() == pca.layout.points);
  CueSelection selection;
  std::vector<CueRef> candidates(wanted.begin(), wanted.end());
  for (const CueRef cue : options.fixed) {
    if (std::find(candidates.begin(), candidates.end(), cue) == candidates.end()) candidates.push_back(cue);
  }
  if (candidates.empty()) return selection;
  Selector selector(pca, candidates, positions, noise, options);
  double refreshed = selector.ExpectedRms();
  double cost = 0;
  const auto take = [&](std::size_t candidate) {
    cost += selector.Cost(candidate);
    selector.Take(candidate, selector.chosen().size());
    selection.expected_rms.push_back(selector.ExpectedRms());
    if (selection.expected_rms.back() < 0.01 * refreshed) {  // H has lost four digits of its sixteen
      selector.Refresh();
      refreshed = selection.expected_rms.back();
    }
  };
  const auto budget = [&] {
    return options.max_cost > 0 ? options.max_cost - cost : std::numeric_limits<double>::infinity();
  };

  for (const CueRef cue : options.fixed) {
    take(selector.Find(cue));
  }
  while (selector.chosen().size() < options.count) {
    const std::size_t best = selector.Best(budget());
    if (best == candidates.size()) break;
    take(best);
  }

  // Swaps: each cue is given back, and the best candidate takes its place; most often the same one
  for (int pass = 0; pass < options.swap_passes; ++pass) {
    int swapped = 0;
    for (std::size_t place = options.fixed.size(); place < selector.chosen().size(); ++place) {
      const std::size_t old = selector.chosen()[place];
      selector.GiveBack(place);
      const double old_cost = selector.Cost(old), old_gain = selector.gain(old);
      std::size_t best =
          selector.Best(options.max_cost > 0 ? budget() + old_cost : std::numeric_limits<double>::infinity());
      // Where cost counts, an exchange must gain without costing more
      if (best == candidates.size() || selector.gain(best) < old_gain * (1 + 1e-6) ||
          selector.Cost(best) > old_cost)
        best = old;
      if (best != old) {
        ++swapped;
        cost += selector.Cost(best) - old_cost;
      }
      selector.Take(best, place);
    }
    selection.swaps += swapped;
    if (swapped == 0) break;
  }
  selection.cues = selector.chosen_cues();
  selection.final_rms = selector.ExpectedRms();
  selection.cost = TotalCost(selection.cues, options);
  return selection;
}

std::vector<CueRef> SelectKeyPoints(const Eigen::MatrixXd& rotated, int components,
                                    std::span<const Double3> positions, int per_mode,
                                    double exclusion_radius) {
  const Eigen::Index points = rotated.rows() / components;
  KPSA_CHECK_LE(static_cast<std::size_t>(points), positions.size());
  std::vector<CueRef> chosen;
  std::vector<bool> taken(static_cast<std::size_t>(points));
  for (Eigen::Index k = 0; k < rotated.cols(); ++k) {
    const Eigen::Map<const Eigen::MatrixXd> mode(rotated.col(k).data(), components, points);
    Eigen::VectorXd motion = mode.colwise().squaredNorm();
    for (int pick = 0; pick < per_mode; ++pick) {
      Eigen::Index best = -1;
      for (Eigen::Index i = 0; i < points; ++i) {
        if (!taken[static_cast<std::size_t>(i)] && motion[i] > 0 && (best < 0 || motion[i] > motion[best]))
          best = i;
      }
      if (best < 0) break;
      chosen.push_back({CueKind::kOutput, static_cast<Index>(best)});
      const Double3 center = positions[static_cast<std::size_t>(best)];
      for (Eigen::Index i = 0; i < points; ++i) {
        const double distance = Length(positions[static_cast<std::size_t>(i)] - center);
        if (i == best || distance == 0) taken[static_cast<std::size_t>(i)] = true;
        if (distance <= exclusion_radius) motion[i] = 0;
      }
    }
  }
  return chosen;
}

}  // namespace kpsa::engine
