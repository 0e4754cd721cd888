#include "kpsa/training/cue_products.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/greedy_columns.h"
#include "kpsa/training/mode_choice.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kEnoughPoses = 1000;  // fewer fit some of the thousands of candidates by chance
constexpr std::size_t kChoosingPoses = 2400, kChoosingPoints = 400;  // that choose
constexpr std::size_t kMostRegressors = 2;    // a pose: with more of them a regression leaves nothing
constexpr Eigen::Index kLeftDirections = 64;  // of what is left of the points
constexpr std::size_t kSolvedAtOnce = 64;     // columns
constexpr double kRegressorRidge = 1e-7;      // of the mean variance
constexpr double kTwins = 1 - 1e-8;           // correlation of scalars that are one
constexpr double kKnots[] = {0.2, 0.35, 0.5, 0.65, 0.8};  // of a range
constexpr std::size_t kMostHinges = 24;
constexpr std::size_t kMostFactors = 300, kShortlist = 1500;
constexpr double kCarryingPoses = 30;    // poses that have to carry a product
constexpr double kLeastDeviation = 0.2;  // of a product of two of deviation 1
constexpr double kProductOwn =
    3e-3;  // of a product's variance: less than this beyond the regressors is noise
constexpr double kBeyondNoise =
    1.5;  // times what a column of noise would explain on average: many stand for choice
constexpr double kProductSeen = 1e-3;  // tolerances (RMS) that one has to tell

// What a ridge regression on the rows of x leaves of those of y.
Eigen::MatrixXd LeftBy(const Eigen::MatrixXd& y, const Eigen::MatrixXd& x) {
  if (x.rows() == 0) return y;
  Eigen::MatrixXd gram = GramOf(x);
  gram.diagonal().array() += kRegressorRidge * gram.trace() / static_cast<double>(gram.rows());
  Eigen::MatrixXd map = CrossOf(x, y);
  const Eigen::LLT<Eigen::MatrixXd> factored(gram);
  ParallelFor((static_cast<std::size_t>(map.cols()) + kSolvedAtOnce - 1) / kSolvedAtOnce, 1,
              [&](std::size_t begin, std::size_t end) {
                for (std::size_t part = begin; part < end; ++part) {
                  const auto first = static_cast<Eigen::Index>(part * kSolvedAtOnce);
                  factored.solveInPlace(
                      map.middleCols(first, std::min<Eigen::Index>(kSolvedAtOnce, map.cols() - first)));
                }
              });
  return y - Multiply(GemmOperand::Dense(map).Transposed(), GemmOperand::Dense(x));
}

// A factor and its values, of deviation 1.
struct ScalarFactor {
  Index scalar;
  ProductCurve curve;
};

class ProductChooser {
 public:
  ProductChooser(const PoseMatrix& poses, const CueProductOptions& options)
      : poses_(poses), options_(options), stride_(poses.poses() / kChoosingPoses + 1) {
    for (std::size_t t = 0; t < poses.poses(); t += stride_) taken_.push_back(t);
  }

  std::vector<CueProduct> Run() {
    if (options_.regressors.size() > kMostRegressors * taken_.size()) return {};
    FindFactors();
    if (factors_.empty()) return {};
    FindResidual();
    if (options_.hinges) ChooseHinges();
    ChoosePairs();
    for (CueProduct& product : chosen_) FindRange(&product);
    return std::move(chosen_);
  }

 private:
  Eigen::Index count() const { return static_cast<Eigen::Index>(taken_.size()); }
  float At(std::size_t t, Index scalar) const {
    return poses_.row(t)[poses_.layout().scalar_begin() + scalar];
  }

  // Of a scalar, centred and of deviation 1; false where it stands still.
  bool Whiten(Index scalar, ScalarFactor* factor, Eigen::Ref<Eigen::RowVectorXd> values) const {
    double lo = std::numeric_limits<double>::infinity(), hi = -lo;
    for (std::size_t k = 0; k < taken_.size(); ++k) {
      const double value = static_cast<double>(At(taken_[k], scalar));
      values[static_cast<Eigen::Index>(k)] = value;
      lo = std::min(lo, value), hi = std::max(hi, value);
    }
    const double mean = values.mean();
    values.array() -= mean;
    const double deviation = std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
    if (!(deviation > options_.still[scalar]) || !(hi > lo)) return false;
    values /= deviation;
    *factor = {scalar, {mean, 1 / deviation, false}};
    return true;
  }

  void FindFactors() {
    Eigen::MatrixXd z(static_cast<Eigen::Index>(options_.factors.size()), count());
    Eigen::Index rows = 0;
    for (const Index scalar : options_.factors) {
      ScalarFactor factor;
      Eigen::RowVectorXd values(count());
      if (!Whiten(scalar, &factor, values)) continue;
      const Eigen::VectorXd same = z.topRows(rows) * values.transpose() / static_cast<double>(count());
      if (rows > 0 && same.cwiseAbs().maxCoeff() > kTwins) continue;
      z.row(rows++) = values;
      factors_.push_back(factor);
    }
    z_ = z.topRows(rows);
    std::vector<Eigen::RowVectorXd> x;
    for (const Index scalar : options_.regressors) {
      ScalarFactor factor;
      Eigen::RowVectorXd values(count());
      if (Whiten(scalar, &factor, values)) x.push_back(values);
    }
    x_.resize(static_cast<Eigen::Index>(x.size()), count());
    for (std::size_t i = 0; i < x.size(); ++i) x_.row(static_cast<Eigen::Index>(i)) = x[i];
  }

  // The main directions of what is left of some points.
  void FindResidual() {
    const PoseLayout& layout = poses_.layout();
    const std::vector<Index> points = EvenSpread(layout.points, std::min(layout.points, kChoosingPoints));
    const auto c = static_cast<std::size_t>(layout.components);
    Eigen::MatrixXd y(static_cast<Eigen::Index>(points.size() * c), count());
    for (std::size_t k = 0; k < taken_.size(); ++k) {
      const std::span<const float> row = poses_.row(taken_[k]);
      for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t e = 0; e < c; ++e)
          y(static_cast<Eigen::Index>(i * c + e), static_cast<Eigen::Index>(k)) =
              static_cast<double>(row[points[i] * c + e]);
      }
    }
    const Eigen::VectorXd mean = y.rowwise().mean();
    y.colwise() -= mean;
    const Eigen::MatrixXd left = LeftBy(y, x_);
    const SymmetricEigen main = LargestEigen(GramOf(left), std::min(kLeftDirections, left.rows()), 1);
    residual_ = Multiply(main.vectors.transpose(), left);
    const double seen = kProductSeen * options_.tolerance;
    seen_ = seen * seen * static_cast<double>(points.size() * taken_.size());
    KeepStrongest(left);
  }

  // Where there are many factors, those with which the residual grows.
  void KeepStrongest(const Eigen::MatrixXd& left) {
    if (factors_.size() <= kMostFactors) return;
    const Eigen::RowVectorXd size = left.colwise().squaredNorm();
    const Eigen::VectorXd growth = z_.cwiseAbs2() * size.transpose();
    std::vector<std::size_t> order(factors_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return growth[static_cast<Eigen::Index>(a)] > growth[static_cast<Eigen::Index>(b)];
    });
    order.resize(kMostFactors);
    std::sort(order.begin(), order.end());
    std::vector<ScalarFactor> kept;
    for (const std::size_t i : order) kept.push_back(factors_[i]);
    factors_ = std::move(kept);
    z_ = z_(std::vector<Eigen::Index>(order.begin(), order.end()), Eigen::all).eval();
  }

  // Makes what many poses carry mean free and of deviation 1. Returns the deviation that it had; 0: too few
  // poses carry it.
  double Standardize(Eigen::RowVectorXd* row, double least) const {
    row->array() -= row->mean();
    const double square = row->squaredNorm(), fourth = row->cwiseAbs2().squaredNorm();
    const double deviation = std::sqrt(square / static_cast<double>(count()));
    if (!(deviation > least) || square * square < kCarryingPoses * fourth) return 0;
    *row /= deviation;
    return deviation;
  }

  // Greedily, of the candidates (rows) those that tell the residual; both are changed to what the regressors
  // and these leave, and these become regressors.
  std::vector<Eigen::Index> Choose(const Eigen::MatrixXd& candidates, std::size_t most) {
    const Eigen::MatrixXd own = LeftBy(candidates, x_);
    Eigen::MatrixXd covariance = GramOf(own), cross = CrossOf(residual_, own);
    std::vector<Eigen::Index> sound;
    for (Eigen::Index i = 0; i < own.rows(); ++i) {
      if (covariance(i, i) > kProductOwn * candidates.row(i).squaredNorm()) sound.push_back(i);
    }
    covariance = covariance(sound, sound).eval();
    cross = cross(Eigen::all, sound).eval();
    covariance.diagonal().array() += kProductOwn * static_cast<double>(count());
    const double total = residual_.squaredNorm();
    std::vector<Eigen::Index> chosen =
        GreedyColumns(covariance, cross,
                      {.total = total,
                       .most = most,
                       .least_variance = 1e-3,
                       .least_gain = std::max(kBeyondNoise * total / static_cast<double>(count()), seen_)});
    for (Eigen::Index& i : chosen) i = sound[static_cast<std::size_t>(i)];
    if (chosen.empty()) return chosen;
    const Eigen::MatrixXd taken = candidates(chosen, Eigen::all);
    const Eigen::Index before = x_.rows();
    x_.conservativeResize(before + taken.rows(), Eigen::NoChange);
    x_.bottomRows(taken.rows()) = taken;
    residual_ = LeftBy(residual_, x_);
    return chosen;
  }

  // max(0, s - c): each becomes a factor, too.
  void ChooseHinges() {
    std::vector<ScalarFactor> hinges;
    std::vector<Eigen::RowVectorXd> rows;
    for (std::size_t i = 0; i < factors_.size(); ++i) {
      const Eigen::RowVectorXd z = z_.row(static_cast<Eigen::Index>(i));
      const double lo = z.minCoeff(), hi = z.maxCoeff();
      for (const double knot : kKnots) {
        const double at = lo + knot * (hi - lo);
        Eigen::RowVectorXd row = (z.array() - at).cwiseMax(0.0).matrix();
        const double deviation = Standardize(&row, 1e-3);
        if (!(deviation > 0)) continue;
        const ProductCurve& of = factors_[i].curve;
        hinges.push_back({factors_[i].scalar, {of.centre + at / of.scale, of.scale / deviation, true}});
        rows.push_back(std::move(row));
      }
    }
    if (rows.empty()) return;
    const std::vector<std::size_t> kept = Shortlist(rows);
    Eigen::MatrixXd candidates(static_cast<Eigen::Index>(kept.size()), count());
    for (std::size_t i = 0; i < kept.size(); ++i)
      candidates.row(static_cast<Eigen::Index>(i)) = rows[kept[i]];
    for (const Eigen::Index i : Choose(candidates, std::min(kMostHinges, options_.most))) {
      const ScalarFactor& hinge = hinges[kept[static_cast<std::size_t>(i)]];
      chosen_.push_back({hinge.scalar, kNoIndex, hinge.curve, {}, 0, 0});
      factors_.push_back(hinge);
      z_.conservativeResize(z_.rows() + 1, Eigen::NoChange);
      z_.row(z_.rows() - 1) = candidates.row(i);
    }
  }

  std::vector<std::size_t> Shortlist(const std::vector<Eigen::RowVectorXd>& rows) const {
    std::vector<double> gains;
    for (const Eigen::RowVectorXd& row : rows) gains.push_back((residual_ * row.transpose()).squaredNorm());
    return Best(gains);
  }
  static std::vector<std::size_t> Best(const std::vector<double>& gains) {
    std::vector<std::size_t> order(gains.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return gains[a] > gains[b]; });
    order.resize(std::min(order.size(), kShortlist));
    std::sort(order.begin(), order.end());
    return order;
  }

  Eigen::RowVectorXd Pair(Eigen::Index a, Eigen::Index b) const { return z_.row(a).cwiseProduct(z_.row(b)); }

  void ChoosePairs() {
    if (chosen_.size() >= options_.most) return;
    std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs;
    std::vector<double> gains;
    for (Eigen::Index a = 0; a < z_.rows(); ++a) {
      Eigen::MatrixXd some(z_.rows() - a, count());
      Eigen::Index rows = 0;
      for (Eigen::Index b = a; b < z_.rows(); ++b) {
        Eigen::RowVectorXd row = Pair(a, b);
        if (!(Standardize(&row, kLeastDeviation) > 0)) continue;
        some.row(rows++) = row;
        pairs.emplace_back(a, b);
      }
      const Eigen::MatrixXd told = CrossOf(residual_, some.topRows(rows));
      for (Eigen::Index i = 0; i < rows; ++i) gains.push_back(told.col(i).squaredNorm());
    }
    if (pairs.empty()) return;
    const std::vector<std::size_t> kept = Best(gains);
    Eigen::MatrixXd candidates(static_cast<Eigen::Index>(kept.size()), count());
    std::vector<double> deviations;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      Eigen::RowVectorXd row = Pair(pairs[kept[i]].first, pairs[kept[i]].second);
      deviations.push_back(Standardize(&row, 0));
      candidates.row(static_cast<Eigen::Index>(i)) = row;
    }
    for (const Eigen::Index i : Choose(candidates, options_.most - chosen_.size())) {
      const auto [a, b] = pairs[kept[static_cast<std::size_t>(i)]];
      CueProduct product;
      const ScalarFactor &of_a = factors_[static_cast<std::size_t>(a)],
                         &of_b = factors_[static_cast<std::size_t>(b)];
      product.a = of_a.scalar, product.b = of_b.scalar;
      product.of_a = of_a.curve, product.of_b = of_b.curve;
      product.of_a.scale /= deviations[static_cast<std::size_t>(i)];
      chosen_.push_back(product);
    }
  }

  // Over all poses.
  void FindRange(CueProduct* product) const {
    product->lo = -std::numeric_limits<double>::infinity();
    product->hi = -product->lo;
    double lo = product->hi, hi = product->lo;
    for (std::size_t t = 0; t < poses_.poses(); ++t) {
      const double value = ValueOf(*product, poses_.row(t).subspan(poses_.layout().scalar_begin()));
      lo = std::min(lo, value), hi = std::max(hi, value);
    }
    product->lo = lo, product->hi = hi;
  }

  const PoseMatrix& poses_;
  const CueProductOptions& options_;
  const std::size_t stride_;
  std::vector<std::size_t> taken_;  // poses
  std::vector<ScalarFactor> factors_;
  Eigen::MatrixXd z_, x_;     // [factors x T], [regressors x T]
  Eigen::MatrixXd residual_;  // [directions x T]
  double seen_ = 0;           // squared errors that a product has to explain
  std::vector<CueProduct> chosen_;
};

}  // namespace

double ValueOf(const CueProduct& product, std::span<const float> scalars) {
  double value = product.of_a.Of(static_cast<double>(scalars[product.a]));
  if (product.b != kNoIndex) value *= product.of_b.Of(static_cast<double>(scalars[product.b]));
  return std::clamp(value, product.lo, product.hi);
}

std::vector<CueProduct> ChooseCueProducts(const PoseMatrix& poses, const CueProductOptions& options) {
  KPSA_CHECK(!poses.centered());
  if (poses.poses() < kEnoughPoses) return {};
  return ProductChooser(poses, options).Run();
}

void StoreProducts(std::span<const CueProduct> products, const PoseLayout& layout, std::span<float> row) {
  KPSA_CHECK(products.size() <= layout.products);
  const std::span<float> scalars = row.subspan(layout.scalar_begin());
  for (std::size_t k = 0; k < products.size(); ++k)
    scalars[layout.products_begin() + k] = static_cast<float>(ValueOf(products[k], scalars));
}

}  // namespace kpsa::engine
