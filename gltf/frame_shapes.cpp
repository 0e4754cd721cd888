#include "gltf/frame_shapes.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>

#include "files/cache_normals.h"

namespace kpsa::engine {
namespace {

using Matrix = Eigen::MatrixXd;

constexpr Eigen::Index kExactSide = 512;  // beyond, cubes of it cost more than all else

Matrix Orthonormal(const Matrix& columns) {
  const Eigen::HouseholderQR<Matrix> qr(columns);
  return qr.householderQ() * Matrix::Identity(columns.rows(), std::min(columns.rows(), columns.cols()));
}

// An orthonormal basis of what the columns of `centered` span most of: random mixtures of them, with one power iteration
// (Halko, Martinsson and Tropp 2011, algorithm 4.4). Linear in frames and in vertices; the same for the same frames.
Matrix RangeOf(const Matrix& centered, Eigen::Index size) {
  std::mt19937 random(1);
  Matrix mixtures(centered.cols(), size);
  for (double& x : mixtures.reshaped()) x = static_cast<double>(random()) / 2147483648.0 - 1;
  const Matrix of_frames = Orthonormal(centered.transpose() * Orthonormal(centered * mixtures));
  return Orthonormal(centered * of_frames);
}

// The left singular vectors of `centered` (3V x T), strongest first, through the Gram matrix of its smaller
// side; of a basis of what it spans where both sides are large.
Matrix SingularVectors(const Matrix& centered, Eigen::Index most) {
  constexpr Eigen::Index kMore = 16;  // than are wanted, as the paper advises
  if (std::min(centered.rows(), centered.cols()) > std::max(kExactSide, most + kMore)) {
    const Matrix basis = RangeOf(centered, most + kMore);
    return basis * SingularVectors(basis.transpose() * centered, most);
  }
  const bool tall = centered.rows() >= centered.cols();
  const Matrix gram =
      tall ? Matrix(centered.transpose() * centered) : Matrix(centered * centered.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(gram);
  const Eigen::VectorXd values = solver.eigenvalues().reverse();
  const double floor = values.size() == 0 ? 0 : 1e-14 * std::max(values[0], 0.0);
  Eigen::Index rank = 0;
  while (rank < std::min(most, values.size()) && values[rank] > floor) ++rank;
  Matrix vectors = solver.eigenvectors().rowwise().reverse().leftCols(rank);
  if (tall) {
    vectors = centered * vectors;
    vectors.colwise().normalize();
  }
  return vectors;
}

// The largest distance and the sum of squares of a residual, per vertex.
void Measure(const Matrix& residual, double* max, double* square_sum) {
  double largest = 0;
  for (Eigen::Index t = 0; t < residual.cols(); ++t) {
    for (Eigen::Index i = 0; i < residual.rows(); i += 3)
      largest = std::max(largest, residual.block<3, 1>(i, t).squaredNorm());
  }
  *max = std::sqrt(largest);
  *square_sum = residual.squaredNorm();
}

std::vector<float> Floats(const Eigen::VectorXf& values) { return {values.begin(), values.end()}; }

}  // namespace

FrameShapes ShapesOfFrames(const PointCacheMesh& mesh, std::size_t frame_count, double tolerance,
                           int max_shapes) {
  const auto rows = static_cast<Eigen::Index>(3 * mesh.vertex_count),
             cols = static_cast<Eigen::Index>(frame_count);
  const Matrix frames = Eigen::Map<const Eigen::MatrixXf>(mesh.frames.data(), rows, cols).cast<double>();
  FrameShapes result;
  Eigen::VectorXf rest = frames.rowwise().mean().cast<float>();
  Matrix residual = frames.colwise() - rest.cast<double>();
  const Matrix vectors = SingularVectors(residual, max_shapes);
  std::vector<Eigen::VectorXf> all_weights;
  Measure(residual, &result.max_residual, &result.square_sum);
  Eigen::Index count = 0;
  for (; count < vectors.cols() && result.max_residual > tolerance; ++count) {
    Eigen::VectorXd weights = residual.transpose() * vectors.col(count);
    double low = weights.minCoeff(), range = weights.maxCoeff() - low;
    if (range == 0) break;
    if (weights[0] - low > range / 2) low += range, range = -range;
    // Subtract what is written, in float32, so that later shapes mend its rounding
    const Eigen::VectorXf moved = (rest.cast<double>() + low * vectors.col(count)).cast<float>();
    const Eigen::VectorXf shape = (range * vectors.col(count)).cast<float>();
    all_weights.push_back(((weights.array() - low) / range).cwiseMax(0).cwiseMin(1).cast<float>());
    residual.colwise() -= moved.cast<double>() - rest.cast<double>();
    residual -= shape.cast<double>() * all_weights.back().cast<double>().transpose();
    result.shapes.push_back(Floats(shape));
    rest = moved;
    Measure(residual, &result.max_residual, &result.square_sum);
  }
  result.rest = Floats(rest);
  for (Eigen::Index t = 0; t < cols; ++t) {
    for (const Eigen::VectorXf& weights : all_weights) result.weights.push_back(weights[t]);
  }
  return result;
}

FrameNormals NormalsOfFrames(const PointCacheMesh& mesh, const FrameShapes& shapes) {
  FrameNormals result;
  if (mesh.triangles.empty()) return result;
  const auto rows = static_cast<Eigen::Index>(shapes.rest.size()),
             frames = static_cast<Eigen::Index>(mesh.frames.size()) / rows,
             count = static_cast<Eigen::Index>(shapes.shapes.size());
  Matrix normals(frames, rows);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const std::vector<float> normal = CacheNormals(mesh, static_cast<std::size_t>(t));
    normals.row(t) = Eigen::Map<const Eigen::RowVectorXf>(normal.data(), rows).cast<double>();
  }
  Matrix weights(frames, count + 1);
  weights << Eigen::VectorXd::Ones(frames),
      Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          shapes.weights.data(), frames, count)
          .cast<double>();
  Matrix fit = Eigen::CompleteOrthogonalDecomposition<Matrix>(weights).solve(normals);
  for (Eigen::Index i = 0; i < rows; i += 3) {
    const double length = fit.block<1, 3>(0, i).norm();
    constexpr double kShortest = 1e-3;
    if (length > kShortest) {
      fit.middleCols(i, 3) /= length;
    } else {  // what points nowhere where all weights are 0 starts from the first frame's
      fit.block<1, 3>(0, i) = normals.block<1, 3>(0, i);
    }
  }
  result.rest = Floats(fit.row(0).transpose().cast<float>());
  for (Eigen::Index k = 0; k < count; ++k)
    result.shapes.push_back(Floats(fit.row(k + 1).transpose().cast<float>()));
  return result;
}

}  // namespace kpsa::engine
