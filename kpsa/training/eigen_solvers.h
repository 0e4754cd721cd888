// The dense decompositions that training needs; kept in one source so that Eigen's solvers are compiled once.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace kpsa::engine {

struct SymmetricEigen {
  Eigen::VectorXd values;   // [m] descending
  Eigen::MatrixXd vectors;  // [n x m]
};
// All eigenpairs of a symmetric matrix.
SymmetricEigen AllEigen(const Eigen::MatrixXd& matrix);
// The m largest of a positive semi-definite matrix. Small matrices, or most of the pairs: all of them; else a
// block Krylov space with full orthogonalisation (Golub, Underwood 1977), grown until the residuals of all m
// pairs are small against their eigenvalues, or eight times m long: slow decay leaves the last pairs with a
// larger residual then.
SymmetricEigen LargestEigen(const Eigen::MatrixXd& matrix, Eigen::Index m, std::uint64_t seed);
// The eigenpairs of map * inner * map^T [n x n] that may be other than zero: min(n, r) of them. map [n x r]; inner [r x r]
// symmetric.
SymmetricEigen EigenOfImage(const Eigen::MatrixXd& map, const Eigen::MatrixXd& inner);

// Makes the columns of a tall matrix orthonormal without leaving their span: Cholesky QR, repeated;
// Householder where the columns are too dependent for that.
void Orthonormalize(Eigen::MatrixXd* tall);

struct ThinSvd {
  Eigen::MatrixXd u;       // [n x m]
  Eigen::VectorXd values;  // [m] descending
  Eigen::MatrixXd v;       // [m x m]
};
// SVD of a tall matrix [n x m], n >= m: a QR, then a divide-and-conquer SVD of R.
ThinSvd TallSvd(const Eigen::MatrixXd& tall);

Eigen::MatrixXd RandomNormal(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed);

}  // namespace kpsa::engine
