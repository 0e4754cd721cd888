// Ridge regressions of y [q x T] on x [p x T], whose rows are centred: where x has more rows than columns, by
// the Gram matrix of its columns, x^T (x x^T + r)^-1 = (x^T x + r)^-1 x^T, which is the smaller one. `ridge`
// is a share of the mean of the diagonal of x x^T. Internal to training.
#pragma once

#include <Eigen/Core>

#include "kpsa/training/cholesky.h"

namespace kpsa::engine {

// Of the Gram matrix of rows; with a larger ridge where that is not positive definite.
Cholesky Damped(const Eigen::MatrixXd& gram, double ridge);
// What the regression gives at other columns, xh.
Eigen::MatrixXd RidgeAt(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& xh,
                        double ridge);
// How much of the squares of y it tells. gram: x x^T, cross: y x^T.
double ToldByRidge(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& gram,
                   const Eigen::MatrixXd& cross, double ridge);

}  // namespace kpsa::engine
