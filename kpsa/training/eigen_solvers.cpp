#include "kpsa/training/eigen_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <random>

#include "base/check.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {
namespace {

Eigen::MatrixXd ThinQ(const Eigen::MatrixXd& tall) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(tall);
  return qr.householderQ() * Eigen::MatrixXd::Identity(tall.rows(), tall.cols());
}

constexpr int kMostPasses = 8;
constexpr double kOrthogonal = 1e-8;  // of a unit vector: what may lie within; rounding after the last pass
constexpr Eigen::Index kSmall = 160;  // below this the dense solver is as fast

}  // namespace

SymmetricEigen AllEigen(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  SymmetricEigen result;
  result.values = solver.eigenvalues().reverse();
  result.vectors = solver.eigenvectors().rowwise().reverse();
  return result;
}

SymmetricEigen LargestEigen(const Eigen::MatrixXd& matrix, Eigen::Index m, std::uint64_t seed) {
  const Eigen::Index n = matrix.rows();
  m = std::min(m, n);
  if (n <= kSmall || 3 * m >= n) {
    SymmetricEigen all = AllEigen(matrix);
    return {all.values.head(m), all.vectors.leftCols(m)};
  }
  const Eigen::Index block = std::clamp<Eigen::Index>(m / 4, 16, 64);
  const Eigen::Index limit = std::min(n - n % block, std::max<Eigen::Index>(8 * m, 8 * block));
  Eigen::MatrixXd space(n, limit), image(n, limit);  // Q and G Q
  Eigen::Index used = 0, next_check = std::min(limit, 2 * m + 2 * block);
  Eigen::MatrixXd fresh = ThinQ(RandomNormal(n, block, seed));
  while (true) {
    // Orthogonalise against what is there, again where that left little but rounding, which has parts of it:
    // the image of a space that holds all that the matrix moves
    for (int pass = 0; pass < kMostPasses; ++pass) {
      double within = 0;
      if (used > 0) {
        const Eigen::MatrixXd part = TransposedProduct(space.leftCols(used), fresh);
        within = part.cwiseAbs().maxCoeff();
        fresh -= Multiply(space.leftCols(used), part);
      }
      fresh = ThinQ(fresh);
      if (pass > 0 && within < kOrthogonal) break;
    }
    space.middleCols(used, block) = fresh;
    image.middleCols(used, block) = Multiply(matrix, fresh);
    fresh = image.middleCols(used, block);
    used += block;
    if (used < next_check && used + block <= limit) continue;

    // Rayleigh-Ritz
    const Eigen::MatrixXd projected = TransposedProduct(space.leftCols(used), image.leftCols(used));
    const SymmetricEigen ritz = AllEigen(0.5 * (projected + projected.transpose()));
    SymmetricEigen result;
    result.values = ritz.values.head(m);
    result.vectors = Multiply(space.leftCols(used), ritz.vectors.leftCols(m));
    const Eigen::MatrixXd residual = Multiply(image.leftCols(used), ritz.vectors.leftCols(m)) -
                                     result.vectors * result.values.asDiagonal();
    bool converged = true;
    for (Eigen::Index k = 0; k < m && converged; ++k) {
      converged = residual.col(k).norm() <= std::max(1e-7 * result.values[k], 1e-14 * result.values[0]);
    }
    if (converged || used + block > limit) return result;
    next_check = std::min(limit, used + std::max(block, used / 2));
  }
}

SymmetricEigen EigenOfImage(const Eigen::MatrixXd& map, const Eigen::MatrixXd& inner) {
  const Eigen::Index rank = map.cols();
  if (rank == 0) return {Eigen::VectorXd(0), Eigen::MatrixXd(map.rows(), 0)};
  if (rank >= map.rows()) return AllEigen(map * inner * map.transpose());
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(map);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
  SymmetricEigen eigen = AllEigen(r * inner * r.transpose());
  Eigen::MatrixXd vectors = Eigen::MatrixXd::Zero(map.rows(), rank);
  vectors.topRows(rank) = eigen.vectors;
  vectors.applyOnTheLeft(qr.householderQ());
  return {std::move(eigen.values), std::move(vectors)};
}

void Orthonormalize(Eigen::MatrixXd* tall) {
  for (int pass = 0; pass < 3; ++pass) {
    const Eigen::MatrixXd gram = Gram(GemmOperand::Dense(*tall).Transposed());
    const Eigen::Index m = gram.rows();
    if (pass > 0 && (gram - Eigen::MatrixXd::Identity(m, m)).cwiseAbs().maxCoeff() < 1e-14) return;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(gram);
    const Eigen::VectorXd diagonal = cholesky.matrixLLT().diagonal();
    if (cholesky.info() != Eigen::Success || diagonal.minCoeff() < 1e-6 * diagonal.maxCoeff()) {
      *tall = ThinQ(*tall);
      continue;
    }
    const Eigen::MatrixXd inverse = cholesky.matrixU().solve(Eigen::MatrixXd::Identity(m, m));
    *tall = Multiply(*tall, inverse);
  }
}

ThinSvd TallSvd(const Eigen::MatrixXd& tall) {
  KPSA_CHECK_LE(tall.cols(), tall.rows());
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(tall);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(tall.cols()).triangularView<Eigen::Upper>();
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(r, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(tall.rows(), tall.cols());
  u.topRows(tall.cols()) = svd.matrixU();
  u.applyOnTheLeft(qr.householderQ());
  return {std::move(u), svd.singularValues(), svd.matrixV()};
}

Eigen::MatrixXd RandomNormal(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix.data()[i] = normal(random);
  return matrix;
}

}  // namespace kpsa::engine
