// Matrix products for training (offline only: the bits depend on the machine). The build has no
// -march flag, so Eigen's own products use SSE2; these use Highway and are 10 to 20 times as fast for large
// operands.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "kpsa/training/pose_matrix.h"

namespace kpsa::engine {

// One factor: a float64 matrix, or poses (rows of float32) with an optional factor a column. Refers to its
// source.
class GemmOperand {
 public:
  static GemmOperand Dense(
      const Eigen::Ref<const Eigen::MatrixXd>& matrix);  // column-major, unit inner stride
  // Poses [first, first + count) and columns [begin, end); column_scale empty or [D].
  static GemmOperand Poses(const PoseMatrix& poses, std::size_t first, std::size_t count, std::size_t begin,
                           std::size_t end, std::span<const double> column_scale = {});
  GemmOperand Transposed() const;
  std::size_t rows() const { return transposed_ ? columns_ : rows_; }
  std::size_t columns() const { return transposed_ ? rows_ : columns_; }

  // Writes rows [row, row + height) of columns [column, column + width) as panels of kStep rows:
  // out[panel][column][kStep], zero beyond the matrix. double or float.
  template <std::size_t kStep, typename Number>
  void Pack(std::size_t row, std::size_t height, std::size_t column, std::size_t width, Number* out) const;

 private:
  bool transposed_ = false;
  std::size_t rows_ = 0, columns_ = 0;
  const double* dense_ = nullptr;
  std::size_t leading_ = 0;              // of dense_: distance of columns
  std::vector<const float*> pose_rows_;  // [rows_] first wanted column
  std::span<const double> scale_;        // [columns_] or empty
};

// a * b. Splits over threads; the result does not depend on how many. To a matrix that is none of the factors: pages that
// it has are used again.
void Multiply(const GemmOperand& a, const GemmOperand& b, Eigen::MatrixXd* product);
Eigen::MatrixXd Multiply(const GemmOperand& a, const GemmOperand& b);
Eigen::MatrixXd Multiply(const Eigen::Ref<const Eigen::MatrixXd>& a,
                         const Eigen::Ref<const Eigen::MatrixXd>& b);
// The same of factors rounded to float32, 128 terms of a sum in float32 and these sums in float64: twice as fast, for what
// is rough anyway, or is small itself. Relative to |a| |b| it is off by about 1e-7.
void MultiplyFloats(const GemmOperand& a, const GemmOperand& b, Eigen::MatrixXd* product);
Eigen::MatrixXd MultiplyFloats(const GemmOperand& a, const GemmOperand& b);
// a * a^T, symmetric to the last bit.
Eigen::MatrixXd Gram(const GemmOperand& a);
// a^T * b
inline Eigen::MatrixXd TransposedProduct(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                         const Eigen::Ref<const Eigen::MatrixXd>& b) {
  return Multiply(GemmOperand::Dense(a).Transposed(), GemmOperand::Dense(b));
}
// rows * rows^T, and a * b^T: of values by poses.
inline Eigen::MatrixXd GramOf(const Eigen::MatrixXd& rows) { return Gram(GemmOperand::Dense(rows)); }
inline Eigen::MatrixXd CrossOf(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return Multiply(GemmOperand::Dense(a), GemmOperand::Dense(b).Transposed());
}

}  // namespace kpsa::engine
