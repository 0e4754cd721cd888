#include "kpsa/training/tile_products.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kpsa/training/cholesky.h"
#include "kpsa/training/eigen_solvers.h"
#include "kpsa/training/gemm.h"
#include "kpsa/training/greedy_columns.h"
#include "kpsa/training/point_errors.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

constexpr Eigen::Index kValidated = 5;     // every so manieth pose is not fitted to at first
constexpr double kSupport = 30;            // poses that have to carry a product
constexpr double kWorthwhile = 0.9;        // of the errors without products that may be left with them
constexpr double kNegligible = 0.25;       // of the largest error that a tile may have
constexpr double kExplained = 0.98;        // of what all products explain that those chosen have to,
constexpr std::size_t kMostProducts = 15;  // as far as so many can
constexpr double kRidge[] = {1e-3, 1e-2, 1e-1, 1};  // of a product's variance
constexpr double kExtraShare = 0.3;  // of the RMS budget: what the directions of products may leave out
constexpr double kProductByte = 127;

class ProductFitter {
 public:
  ProductFitter(const Eigen::MatrixXd& target, const Eigen::MatrixXd& measured, std::size_t clip_poses,
                const TileOptions& options, TileFactors* factors)
      : target_(target),
        measured_(measured),
        clip_poses_(clip_poses),
        options_(options),
        f_(*factors),
        poses_(measured.cols()) {}

  TileProducts Run() {
    TileProducts result;
    const Eigen::Index latents = std::min<Eigen::Index>(f_.u.cols(), kLatents);
    if (latents == 0 || f_.direct) return result;
    FindLatents(latents);
    FindResiduals();
    if (LargestErrors(residual_).maxCoeff() < kNegligible * options_.max_budget) return result;
    MakeProducts(latents);
    if (pairs_.empty() || !ChooseRidge()) return result;
    ChooseProducts();
    const Eigen::MatrixXd map = Solve(gram_, cross_, ridge_ * static_cast<double>(poses_));  // whitened p
    Store(map, &result);
    return result;
  }

 private:
  // z of all poses, as the run time has them: whitened and clipped.
  void FindLatents(Eigen::Index latents) {
    Eigen::MatrixXd y(static_cast<Eigen::Index>(f_.columns.size()), poses_);
    for (Eigen::Index j = 0; j < y.rows(); ++j)
      y.row(j) = measured_.row(static_cast<Eigen::Index>(f_.columns[static_cast<std::size_t>(j)]));
    moved_ = f_.scale.asDiagonal() * Multiply(f_.v, y);
    whitening_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kLatents));
    z_.resize(latents, poses_);
    for (Eigen::Index i = 0; i < latents; ++i) {
      const double deviation = std::sqrt(moved_.row(i).squaredNorm() / static_cast<double>(poses_));
      whitening_[i] = deviation > 0 ? static_cast<double>(static_cast<float>(1 / deviation)) : 0;
      z_.row(i) = (moved_.row(i) * whitening_[i])
                      .cwiseMax(-static_cast<double>(kLatentClip))
                      .cwiseMin(static_cast<double>(kLatentClip));
    }
  }

  // What the linear tile is off by. [3n x T]
  void FindResiduals() {
    MultiplyFloats(GemmOperand::Dense(f_.u), GemmOperand::Dense(moved_), &residual_);
    residual_ = target_ - residual_;
  }

  bool validated(Eigen::Index t) const {
    return t % kValidated == kValidated - 1 && t >= static_cast<Eigen::Index>(clip_poses_);
  }

  // p of all poses: mean free, of unit variance.
  void MakeProducts(Eigen::Index latents) {
    std::vector<Eigen::RowVectorXd> rows;
    for (Eigen::Index a = 0; a < latents; ++a) {
      for (Eigen::Index b = a; b < latents; ++b) {
        Eigen::RowVectorXd row = z_.row(a).cwiseProduct(z_.row(b));
        const double mean = row.mean();
        row.array() -= mean;
        const double square = row.squaredNorm(), fourth = row.cwiseAbs2().squaredNorm();
        if (!(square > 0) || square * square < kSupport * fourth) continue;
        const double deviation = std::sqrt(square / static_cast<double>(poses_));
        pairs_.push_back({static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b)});
        means_.push_back(mean);
        deviations_.push_back(deviation);
        rows.push_back(row / deviation);
      }
    }
    products_.resize(static_cast<Eigen::Index>(rows.size()), poses_);
    for (std::size_t q = 0; q < rows.size(); ++q) products_.row(static_cast<Eigen::Index>(q)) = rows[q];
  }

  static Eigen::MatrixXd Solve(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& cross, double penalty) {
    Eigen::MatrixXd damped = gram;
    damped.diagonal().array() += penalty;
    return Cholesky(std::move(damped)).Solve(cross.transpose()).transpose();
  }

  // The penalty that serves poses best that are not fitted to; false where none does.
  bool ChooseRidge() {
    std::vector<Eigen::Index> held, fitted;
    for (Eigen::Index t = 0; t < poses_; ++t) (validated(t) ? held : fitted).push_back(t);
    if (held.size() < 20 || fitted.size() < 60) return false;
    // Penalties are large, and what is left is small: it may be rounded
    const GemmOperand products = GemmOperand::Dense(products_);
    gram_ = GramOf(products_);
    cross_ = MultiplyFloats(GemmOperand::Dense(residual_), products.Transposed());
    const Eigen::MatrixXd p = products_(Eigen::all, held), r = residual_(Eigen::all, held);
    const Eigen::MatrixXd gram = gram_ - GramOf(p), cross = cross_ - CrossOf(r, p);
    double best = kWorthwhile * LargestErrors(r).squaredNorm();
    bool found = false;
    for (const double ridge : kRidge) {
      const Eigen::MatrixXd left =
          r - Multiply(Solve(gram, cross, ridge * static_cast<double>(fitted.size())), p);
      const double error = LargestErrors(left).squaredNorm();
      if (error < best) best = error, ridge_ = ridge, found = true;
    }
    return found;
  }

  // As few products as explain nearly as much as all: greedy, by a pivoted Cholesky decomposition.
  void ChooseProducts() {
    const Eigen::MatrixXd all = Solve(gram_, cross_, ridge_ * static_cast<double>(poses_));
    const Eigen::MatrixXd wanted = Multiply(all, gram_);  // of the fit, not of the noise that it leaves
    const double total = wanted.cwiseProduct(all).sum();
    std::vector<Eigen::Index> chosen = GreedyColumns(
        gram_, wanted,
        {.total = total, .left = (1 - kExplained) * total, .most = kMostProducts, .least_variance = 1e-9});
    std::sort(chosen.begin(), chosen.end());
    gram_ = gram_(chosen, chosen).eval();
    cross_ = cross_(Eigen::all, chosen).eval();
    products_ = products_(chosen, Eigen::all).eval();
    for (std::size_t q = 0; q < chosen.size(); ++q) {
      const auto from = static_cast<std::size_t>(chosen[q]);
      pairs_[q] = pairs_[from], means_[q] = means_[from], deviations_[q] = deviations_[from];
    }
    pairs_.resize(chosen.size());
  }

  // W in the units of U's columns, more columns for what these cannot say, and what is watched.
  void Store(const Eigen::MatrixXd& map, TileProducts* result) {
    const auto onto = [](const Eigen::MatrixXd& columns, const Eigen::MatrixXd& what) {
      return Eigen::MatrixXd((columns.transpose() * columns).ldlt().solve(columns.transpose() * what));
    };
    Eigen::MatrixXd w = onto(f_.u, map);
    const Eigen::MatrixXd rest = map - f_.u * w;
    const Eigen::MatrixXd variance = gram_ / static_cast<double>(poses_);
    const SymmetricEigen eigen = EigenOfImage(rest, variance);
    const double budget =
        kExtraShare * options_.rms_budget * options_.rms_budget * static_cast<double>(f_.u.rows() / 3);
    double left = (rest * variance).cwiseProduct(rest).sum();
    Eigen::Index extra = 0;
    while (extra < eigen.values.size() && left > budget &&
           f_.u.cols() + extra < static_cast<Eigen::Index>(kMaxTileRank) - f_.wide)
      left -= std::max(0.0, eigen.values[extra++]);
    if (extra > 0) {
      Eigen::MatrixXd columns = eigen.vectors.leftCols(extra);
      for (Eigen::Index k = 0; k < extra; ++k)
        columns.col(k) =
            (columns.col(k) * (kProductByte / columns.col(k).cwiseAbs().maxCoeff())).array().round();
      const Eigen::MatrixXd more = onto(columns, rest);
      const Eigen::Index k = f_.u.cols();
      f_.u.conservativeResize(Eigen::NoChange, k + extra);
      f_.u.rightCols(extra) = columns;
      f_.v.conservativeResize(k + extra, Eigen::NoChange);
      f_.v.bottomRows(extra).setZero();
      f_.scale.conservativeResize(k + extra);
      w.conservativeResize(k + extra, Eigen::NoChange);
      w.bottomRows(extra) = more;
      f_.scale.tail(extra).setOnes();
      grown_ = extra;
    }

    // p = (1, z_i z_j ...): the mean is taken out by the 1
    result->whitening = whitening_;
    const auto count = static_cast<Eigen::Index>(pairs_.size());
    result->w.resize(w.rows(), 1 + count);
    result->pairs = {kUnitLatent, kUnitLatent};
    result->w.col(0).setZero();
    for (Eigen::Index q = 0; q < count; ++q) {
      const auto of = static_cast<std::size_t>(q);
      result->pairs.insert(result->pairs.end(), {pairs_[of][0], pairs_[of][1]});
      result->w.col(1 + q) = w.col(q) / deviations_[of];
      result->w.col(0) -= result->w.col(1 + q) * means_[of];
    }
    for (Eigen::Index k = 0; k < w.rows(); ++k) {
      if (k >= w.rows() - grown_) {
        const double up = ScaleForHalfs(result->w.row(k).cwiseAbs().maxCoeff());
        f_.scale[k] = static_cast<double>(static_cast<float>(1 / up));
      }
      if (f_.scale[k] == 0) continue;
      result->w.row(k) = (result->w.row(k) / f_.scale[k]).unaryExpr(&RoundToHalf);
    }
    Watch(result);
  }

  // The points whose product terms are the largest ones of the tile in most poses.
  void Watch(TileProducts* result) {
    const Eigen::MatrixXd map = f_.u * f_.scale.asDiagonal() * result->w;  // [3n x P] of p
    Eigen::MatrixXd p(map.cols(), poses_);
    p.row(0).setOnes();
    for (Eigen::Index q = 1; q < p.rows(); ++q) {
      const auto of = static_cast<std::size_t>(q - 1);
      p.row(q) = products_.row(q - 1) * deviations_[of];
      p.row(q).array() += means_[of];
    }
    const Eigen::Index points = map.rows() / 3;
    // By pose, which follow each other in memory
    const Eigen::MatrixXd length =
        PointErrors(MultiplyFloats(GemmOperand::Dense(map), GemmOperand::Dense(p))).transpose();
    Eigen::VectorXd seen = Eigen::VectorXd::Zero(poses_);
    result->doubt = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(kDoubtPoints), map.cols());
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(kDoubtPoints); ++i) {
      Eigen::Index best = 0;
      double most = -1;
      for (Eigen::Index point = 0; point < points; ++point) {
        const double gain = (length.col(point) - seen).cwiseMax(0.0).squaredNorm();
        if (gain > most) most = gain, best = point;
      }
      seen = seen.cwiseMax(length.col(best));
      for (Eigen::Index c = 0; c < 3; ++c)
        result->doubt.row(c * static_cast<Eigen::Index>(kDoubtPoints) + i) = map.row(3 * best + c);
    }
    const double up = ScaleForHalfs(result->doubt.cwiseAbs().maxCoeff());
    result->doubt = (result->doubt * up).unaryExpr(&RoundToHalf);
    result->doubt_scale = 1 / up;
  }

  const Eigen::MatrixXd &target_, &measured_;
  const std::size_t clip_poses_;
  const TileOptions& options_;
  TileFactors& f_;
  const Eigen::Index poses_;
  Eigen::MatrixXd moved_, z_, residual_, products_;  // [k x T], [L x T], [3n x T], [P x T]
  Eigen::VectorXd whitening_;
  std::vector<std::array<std::uint8_t, 2>> pairs_;
  std::vector<double> means_, deviations_;  // of the products
  Eigen::MatrixXd gram_, cross_;            // of the products, and of the residual with them
  double ridge_ = 0;
  Eigen::Index grown_ = 0;
};

}  // namespace

TileProducts FitProducts(const Eigen::MatrixXd& target, const Eigen::MatrixXd& measured,
                         std::size_t clip_poses, const TileOptions& options, TileFactors* factors) {
  return ProductFitter(target, measured, clip_poses, options, factors).Run();
}

}  // namespace kpsa::engine
