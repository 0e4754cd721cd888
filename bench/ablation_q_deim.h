// Points by pivoting (Q-DEIM: Drmac, Gugercin 2016): another rule than the paper's and than the A-optimal
// one, to compare them with.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/types.h"

namespace kpsa::engine::ablation {

// The first `count` pivots of a QR factorisation of the transposed modes [cN x M] with column pivoting. A
// point's c rows are one pivot: the point is taken of whose rows most (Frobenius norm) is outside of the span
// of those that were taken. Where these span everything, the next ones are pivots of a new factorisation over
// the others.
std::vector<Index> QDeimPoints(const Eigen::MatrixXd& modes, int components, std::size_t count);

}  // namespace kpsa::engine::ablation
