#include "kpsa/training/tile_factorer.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/greedy_columns.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

constexpr Eigen::Index kDirections = 96;  // of a tile's motion that are looked for first
constexpr auto kMostColumns = static_cast<Eigen::Index>(kMaxTileRank);
constexpr int kAttempts = 10;
constexpr double kCueShare = 0.4;   // of the RMS budget: what the cues that are left out may cost,
constexpr double kRankShare = 0.3;  // what the truncation may cost,
constexpr double kByteShare = 0.1;  // and what rounding to bytes may cost
constexpr double kByte = 127, kTwoBytes = 127 * 256 + 127;
constexpr double kFirstWeight =
    0.25;  // of a sample with too large an error, in budgets a squared largest error

// Everything is done in coordinates s of the tile's own motion, f - mu = basis * s, basis [cn x q] with
// orthonormal columns.
class TileFactorer {
 public:
  TileFactorer(const Eigen::MatrixXd& gain, const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& samples,
               int components, const TileOptions& options, bool may_be_direct)
      : may_be_direct_(may_be_direct),
        gain_(gain),
        covariance_(covariance),
        samples_(samples),
        components_(components),
        max_budget_(options.max_budget),
        points_(static_cast<double>(gain.rows() / components)),
        budget_(options.rms_budget * options.rms_budget * points_),
        motion_(Multiply(gain, covariance)) {
    if (samples.size() > 0) moved_ = Multiply(gain, samples);
    // Directions of the motion, rare ones included: what is dropped costs a hundredth of the budget, and in
    // any one sample a tenth of the largest error
    const double of_samples =
        moved_.size() > 0 && std::isfinite(max_budget_) ? budget_ / (max_budget_ * max_budget_) : 0;
    total_ = motion_.cwiseProduct(gain).sum();
    const double all = total_ + (of_samples > 0 ? of_samples * moved_.squaredNorm() : 0);
    const SymmetricEigen eigen = Directions(of_samples, all);
    double rest = all;
    Eigen::Index q = 0;
    while (q < eigen.values.size() && rest > 0.01 * budget_ && eigen.values[q] > 1e-14 * eigen.values[0])
      rest -= eigen.values[q++];
    basis_ = eigen.vectors.leftCols(q);
    if (moved_.size() > 0) sample_motion_ = Multiply(basis_.transpose(), moved_);
    own_cross_ = Multiply(basis_.transpose(), motion_);
    own_variance_ = own_cross_.cwiseProduct(Multiply(basis_.transpose(), gain)).sum();
    weights_.setZero(samples.cols());
    Weigh();
  }

  TileFactors Run() {
    TileFactors best;
    double share = 1;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      Choose(share * kCueShare * budget_);
      TileFactors f = Factor(share * budget_);
      const bool fits_rms = f.squared_error <= budget_, fits_largest = f.largest <= max_budget_;
      const double excess = std::max(f.squared_error / budget_, f.largest / max_budget_);
      if (attempt == 0 || excess < best_excess_) best = std::move(f), best_excess_ = excess;
      if (fits_rms && fits_largest) break;
      if (!fits_rms) share *= 0.5;
      if (!fits_largest && !GrowWeights()) share *= 0.5;
      Weigh();
    }
    return best;
  }

 private:
  // Of the motion's covariance, and so many times that of the samples; `all`: its trace.
  SymmetricEigen Directions(double of_samples, double all) const {
    if (2 * gain_.cols() <= gain_.rows()) {  // no more directions than numbers that tell it
      Eigen::MatrixXd spread = covariance_;
      if (of_samples > 0) spread += of_samples * GramOf(samples_);
      return EigenOfImage(gain_, spread);
    }
    Eigen::MatrixXd gram = Multiply(GemmOperand::Dense(motion_), GemmOperand::Dense(gain_).Transposed());
    if (of_samples > 0) gram += of_samples * GramOf(moved_);
    if (gram.rows() > 2 * kDirections) {
      SymmetricEigen eigen = LargestEigen(gram, kDirections, 1);
      if (all - eigen.values.cwiseMax(0.0).sum() <= 0.01 * budget_) return eigen;
    }
    return AllEigen(gram);
  }

  // The covariances of y, and of s and y, with the weights of samples.
  void Weigh() {
    weighted_covariance_ = covariance_;
    cross_ = own_cross_;
    variance_ = own_variance_;
    for (Eigen::Index i = 0; i < weights_.size(); ++i) {
      if (weights_[i] == 0) continue;
      weighted_covariance_.noalias() += weights_[i] * samples_.col(i) * samples_.col(i).transpose();
      cross_.noalias() += weights_[i] * sample_motion_.col(i) * samples_.col(i).transpose();
      variance_ += weights_[i] * sample_motion_.col(i).squaredNorm();
    }
  }

  // More weight for samples with too large an error; false if there are none.
  bool GrowWeights() {
    const double first = kFirstWeight * budget_ / (max_budget_ * max_budget_);
    bool grown = false;
    for (Eigen::Index i = 0; i < weights_.size(); ++i) {
      if (sample_errors_[i] <= 0.95 * max_budget_) continue;
      weights_[i] = weights_[i] == 0 ? first : 3 * weights_[i];
      grown = true;
    }
    return grown;
  }

  // Takes cues until the others would add less than `left` to what is predicted.
  void Choose(double left) {
    chosen_.clear();
    for (const Eigen::Index j : GreedyColumns(weighted_covariance_, cross_,
                                              {.total = variance_, .left = left, .least_gain = 1e-9 * left}))
      chosen_.push_back(static_cast<std::uint32_t>(j));
  }

  // The best map from the chosen cues, with as few columns and bytes as the shares of `budget` allow.
  TileFactors Factor(double budget) {
    TileFactors f;
    f.columns = chosen_;
    std::sort(f.columns.begin(), f.columns.end());
    const auto count = static_cast<Eigen::Index>(f.columns.size()), q = basis_.cols();
    if (count == 0 || q == 0) {  // nothing that the budget sees moves
      f.columns.clear();
      f.u.resize(gain_.rows(), 0);
      f.v.resize(0, 0);
      f.squared_error = total_;
      f.largest = Largest(Eigen::MatrixXd::Zero(gain_.rows(), 0), {});
      return f;
    }
    const Eigen::MatrixXd inner = Inner(weighted_covariance_, f.columns);
    Eigen::MatrixXd cross(q, count);
    for (Eigen::Index j = 0; j < count; ++j)
      cross.col(j) = cross_.col(f.columns[static_cast<std::size_t>(j)]);
    const Eigen::LLT<Eigen::MatrixXd> cholesky(inner);
    const Eigen::MatrixXd map = cholesky.solve(cross.transpose()).transpose();  // [q x |J|] s from y_J
    const Eigen::MatrixXd whitened =
        cholesky.matrixL().solve(cross.transpose()).transpose();  // the same from whitened y_J
    const SymmetricEigen eigen = AllEigen(whitened * whitened.transpose());
    double rest = eigen.values.cwiseMax(0.0).sum();
    Eigen::Index rank = 0;
    while (rank < std::min(q, count) && rank < kMostColumns && rest > kRankShare * budget)
      rest -= std::max(0.0, eigen.values[rank++]);

    // What is read: U and V, or their product
    const double factored =
        static_cast<double>(rank * gain_.rows()) + 2.0 * static_cast<double>(count * ((rank + 15) / 16 * 16));
    f.direct =
        may_be_direct_ && count <= kMostColumns && factored >= static_cast<double>(count * gain_.rows());
    Eigen::VectorXd variances;  // of the inputs of U's columns
    if (f.direct) {
      f.u = basis_ * map;
      variances = inner.diagonal();
      SortColumns(&f, &variances);
    } else {
      f.u = basis_ * eigen.vectors.leftCols(rank);
      f.v = eigen.vectors.leftCols(rank).transpose() * map;
      variances = eigen.values.head(rank).cwiseMax(0.0);
    }
    Quantize(variances, kByteShare * budget, &f);
    Eigen::MatrixXd product = f.u * f.scale.asDiagonal();
    if (!f.direct) product = product * f.v;
    f.squared_error = ExpectedError(product, f.columns);
    f.largest = Largest(product, f.columns);
    return f;
  }

  // Direct tiles: the columns that move most come first, as narrow columns follow wide ones.
  static void SortColumns(TileFactors* f, Eigen::VectorXd* variances) {
    std::vector<Eigen::Index> order(f->columns.size());
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    const Eigen::VectorXd weight = f->u.colwise().squaredNorm().transpose().cwiseProduct(*variances);
    std::stable_sort(order.begin(), order.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return weight[a] > weight[b]; });
    std::vector<std::uint32_t> columns;
    for (const Eigen::Index i : order) columns.push_back(f->columns[static_cast<std::size_t>(i)]);
    f->u = f->u(Eigen::all, order).eval();
    *variances = (*variances)(order).eval();
    f->columns = std::move(columns);
  }

  // Rounds V to halfs and U to whole numbers: of one byte from the last column on, as long as that costs
  // little.
  static void Quantize(const Eigen::VectorXd& variances, double budget, TileFactors* f) {
    const Eigen::Index rank = f->u.cols();
    f->scale = Eigen::VectorXd::Ones(rank);
    for (Eigen::Index k = 0; k < rank && !f->direct; ++k) {
      const double up = ScaleForHalfs(f->v.row(k).cwiseAbs().maxCoeff());
      f->v.row(k) = (f->v.row(k) * up).unaryExpr(&RoundToHalf);
      f->scale[k] /= up;
    }
    const auto round = [&](Eigen::Index k, double range) {
      const double largest = f->u.rows() == 0 ? 0 : f->u.col(k).cwiseAbs().maxCoeff();
      const double unit = static_cast<double>(static_cast<float>(largest > 0 ? largest / range : 1));
      return std::pair(
          unit, Eigen::VectorXd((f->u.col(k) / unit).array().round().cwiseMin(range).cwiseMax(-range)));
    };
    f->wide = rank;
    double cost = 0;
    for (Eigen::Index k = rank - 1; k >= 0; --k) {
      auto [unit, whole] = round(k, kByte);
      cost += (whole * unit - f->u.col(k)).squaredNorm() * variances[k];
      if (cost > budget) break;
      f->wide = k;
      f->u.col(k) = whole;
      f->scale[k] *= unit;
    }
    for (Eigen::Index k = 0; k < f->wide; ++k) {
      const auto [unit, whole] = round(k, kTwoBytes);
      f->u.col(k) = whole;
      f->scale[k] *= unit;
    }
    for (Eigen::Index k = 0; k < rank; ++k)
      f->scale[k] = static_cast<double>(static_cast<float>(f->scale[k]));
  }

  static Eigen::MatrixXd Inner(const Eigen::MatrixXd& covariance, const std::vector<std::uint32_t>& columns) {
    const auto count = static_cast<Eigen::Index>(columns.size());
    Eigen::MatrixXd inner(count, count);
    for (Eigen::Index b = 0; b < count; ++b) {
      for (Eigen::Index a = 0; a < count; ++a)
        inner(a, b) = covariance(columns[static_cast<std::size_t>(a)], columns[static_cast<std::size_t>(b)]);
    }
    return inner;
  }

  // E |B y - P y_J|^2 under the covariance of y: tr(B G B^T) - 2 tr(P (B G)_J^T) + tr(P G_JJ P^T).
  double ExpectedError(const Eigen::MatrixXd& product, const std::vector<std::uint32_t>& columns) const {
    double linear = 0;
    for (Eigen::Index j = 0; j < product.cols(); ++j)
      linear += product.col(j).dot(motion_.col(columns[static_cast<std::size_t>(j)]));
    const Eigen::MatrixXd inner = Inner(covariance_, columns);
    return std::max(0.0, total_ - 2 * linear + Multiply(product, inner).cwiseProduct(product).sum());
  }

  // The largest point error in the samples, against the whole map; keeps it for each sample.
  double Largest(const Eigen::MatrixXd& product, const std::vector<std::uint32_t>& columns) {
    sample_errors_.setZero(samples_.cols());
    if (moved_.size() == 0) return 0;
    Eigen::MatrixXd error = moved_;
    if (!columns.empty()) {
      Eigen::MatrixXd y(product.cols(), samples_.cols());
      for (Eigen::Index j = 0; j < y.rows(); ++j)
        y.row(j) = samples_.row(columns[static_cast<std::size_t>(j)]);
      error -= Multiply(product, y);
    }
    for (Eigen::Index i = 0; i < error.cols(); ++i) {
      const Eigen::Map<const Eigen::MatrixXd> by_point(error.col(i).data(), components_,
                                                       error.rows() / components_);
      sample_errors_[i] = std::sqrt(by_point.colwise().squaredNorm().maxCoeff());
    }
    return sample_errors_.maxCoeff();
  }

  const bool may_be_direct_;
  const Eigen::MatrixXd& gain_;
  const Eigen::MatrixXd& covariance_;
  const Eigen::MatrixXd& samples_;
  int components_;
  double max_budget_, points_, budget_, total_ = 0;
  Eigen::MatrixXd motion_;  // B G [cn x r]
  Eigen::MatrixXd moved_;   // B Y [cn x S]
  Eigen::MatrixXd basis_, sample_motion_;
  Eigen::MatrixXd own_cross_;                    // of s and y, without weights of samples [q x r]
  double own_variance_ = 0;                      // likewise of s
  Eigen::VectorXd weights_, sample_errors_;      // [S]
  Eigen::MatrixXd weighted_covariance_, cross_;  // [r x r], [q x r]
  double variance_ = 0;                          // of s
  std::vector<std::uint32_t> chosen_;
  double best_excess_ = 0;
};

}  // namespace

double RoundToHalf(double value) {
  return static_cast<double>(FloatFromHalf(HalfFromFloat(static_cast<float>(value))));
}

double ScaleForHalfs(double largest) {
  int exponent = 0;
  if (largest > 0) std::frexp(largest, &exponent);
  return std::ldexp(1.0, std::clamp(10 - exponent, -100, 100));
}

TileFactors FactorTile(const Eigen::MatrixXd& gain, const Eigen::MatrixXd& covariance,
                       const Eigen::MatrixXd& samples, int components, const TileOptions& options,
                       bool may_be_direct) {
  return TileFactorer(gain, covariance, samples, components, options, may_be_direct).Run();
}

}  // namespace kpsa::engine
