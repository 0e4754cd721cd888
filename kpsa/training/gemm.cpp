#include "kpsa/training/gemm.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/training/gemm.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

#ifndef KPSA_GEMM_CONSTANTS
#define KPSA_GEMM_CONSTANTS
namespace kpsa::engine {
namespace {
constexpr std::size_t kRowStep = 16;     // rows of a micro tile
constexpr std::size_t kColumnStep = 12;  // columns of a micro tile
}  // namespace
}  // namespace kpsa::engine
#endif

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// c[kRowStep x kCount] += a-panel [depth][kRowStep] times kCount columns of a b-panel [depth][kColumnStep].
template <int kCount, int kVectors>
HWY_INLINE void MicroTile(const double* HWY_RESTRICT a, const double* HWY_RESTRICT b, std::size_t depth,
                          double* HWY_RESTRICT c, std::size_t c_stride) {
  const hn::ScalableTag<double> d;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d);
  V sum[kCount][kVectors];
#pragma GCC unroll 16
  for (int j = 0; j < kCount; ++j) {
#pragma GCC unroll 16
    for (int v = 0; v < kVectors; ++v) sum[j][v] = hn::Zero(d);
  }
  for (std::size_t k = 0; k < depth; ++k) {
    V column[kVectors];
#pragma GCC unroll 16
    for (int v = 0; v < kVectors; ++v)
      column[v] = hn::LoadU(d, a + k * kRowStep + static_cast<std::size_t>(v) * lanes);
#pragma GCC unroll 16
    for (int j = 0; j < kCount; ++j) {
      const V factor = hn::Set(d, b[k * kColumnStep + static_cast<std::size_t>(j)]);
#pragma GCC unroll 16
      for (int v = 0; v < kVectors; ++v) sum[j][v] = hn::MulAdd(column[v], factor, sum[j][v]);
    }
  }
#pragma GCC unroll 16
  for (int j = 0; j < kCount; ++j) {
#pragma GCC unroll 16
    for (int v = 0; v < kVectors; ++v) {
      double* target = c + static_cast<std::size_t>(j) * c_stride + static_cast<std::size_t>(v) * lanes;
      hn::StoreU(hn::Add(hn::LoadU(d, target), sum[j][v]), d, target);
    }
  }
}

// c [row panels * 16 x column panels * 12], column-major, += packed a times packed b.
void PackedProduct(const double* a, const double* b, std::size_t depth, std::size_t row_panels,
                   std::size_t column_panels, double* c, std::size_t c_stride) {
  constexpr std::size_t kLanes = HWY_LANES(double);
  constexpr int kVectors = static_cast<int>(kRowStep / kLanes);
  constexpr int kCount = kLanes >= 8 ? 12 : kLanes == 4 ? 3 : 1;  // as many sums as the registers hold
  for (std::size_t j = 0; j < column_panels; ++j) {
    for (std::size_t i = 0; i < row_panels; ++i) {
      for (std::size_t part = 0; part < kColumnStep; part += kCount) {
        MicroTile<kCount, kVectors>(a + i * depth * kRowStep, b + j * depth * kColumnStep + part, depth,
                                    c + (j * kColumnStep + part) * c_stride + i * kRowStep, c_stride);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "base/cancel.h"
#include "base/check.h"
#include "base/parallel.h"

namespace kpsa::engine {

HWY_EXPORT(PackedProduct);

namespace {

constexpr std::size_t kTile = 384;   // rows and columns of C that one task computes: a multiple of 16 and 12
constexpr std::size_t kDepth = 128;  // columns of A packed at a time; a panel of them stays in the L1 cache
// Where C has fewer tiles than this, its depth is split into so many parts at most, of so many columns at least
constexpr std::size_t kFewTiles = 4, kMostParts = 8, kPartDepth = 8 * kDepth;

// At a 64-byte boundary: vectors that straddle cache lines cost a third of the speed.
class AlignedDoubles {
 public:
  explicit AlignedDoubles(std::size_t size) : floats_(AlignedFloats::Uninitialized(2 * size)) {}
  double* data() { return reinterpret_cast<double*>(floats_.data()); }

 private:
  AlignedFloats floats_;
};

std::size_t RoundUp(std::size_t count, std::size_t step) { return (count + step - 1) / step * step; }

// What tiles of a product are computed in, one after the other.
struct Workspace {
  Workspace(std::size_t rows, std::size_t columns, std::size_t depth)
      : a(rows * depth), b(columns * depth), tile(rows * columns) {}
  AlignedDoubles a, b, tile;
};

// A tile of C and what columns of A it is summed over.
struct Task {
  std::size_t row, column, begin, end;
};

// One tile of C, accumulated over the columns of A in a fixed order.
void ComputeTile(const GemmOperand& a, const GemmOperand& b_transposed, const Task& task,
                 Workspace* workspace, Eigen::MatrixXd* c) {
  const std::size_t height = std::min(kTile, a.rows() - task.row),
                    width = std::min(kTile, b_transposed.rows() - task.column);
  const std::size_t row_panels = (height + kRowStep - 1) / kRowStep;
  const std::size_t column_panels = (width + kColumnStep - 1) / kColumnStep;
  double* const tile = workspace->tile.data();
  std::fill_n(tile, row_panels * kRowStep * column_panels * kColumnStep, 0.0);
  for (std::size_t k = task.begin; k < task.end; k += kDepth) {
    ThrowIfCancelled();
    const std::size_t depth = std::min(kDepth, task.end - k);
    a.Pack(task.row, height, k, depth, kRowStep, workspace->a.data());
    b_transposed.Pack(task.column, width, k, depth, kColumnStep, workspace->b.data());
    HWY_DYNAMIC_DISPATCH(PackedProduct)
    (workspace->a.data(), workspace->b.data(), depth, row_panels, column_panels, tile, row_panels * kRowStep);
  }
  for (std::size_t j = 0; j < width; ++j) {
    std::copy_n(tile + j * row_panels * kRowStep, height,
                c->data() + (task.column + j) * static_cast<std::size_t>(c->rows()) + task.row);
  }
}

// How many parts a depth is split into; by the shape alone, so that the bits do not depend on the threads.
std::size_t PartsOf(std::size_t tiles, std::size_t depth) {
  return tiles >= kFewTiles ? 1 : std::clamp<std::size_t>(depth / kPartDepth, 1, kMostParts);
}

void Product(const GemmOperand& a, const GemmOperand& b_transposed, bool symmetric, Eigen::MatrixXd* c) {
  KPSA_CHECK_EQ(a.columns(), b_transposed.columns());
  const std::size_t m = a.rows(), n = b_transposed.rows(), depth = a.columns();
  c->resize(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(n));
  if (m == 0 || n == 0) return;
  if (depth == 0) {
    c->setZero();
    return;
  }
  std::vector<Task> tiles;
  for (std::size_t j = 0; j < n; j += kTile) {
    for (std::size_t i = symmetric ? j : 0; i < m; i += kTile) tiles.push_back({i, j, 0, depth});
  }
  const std::size_t parts = PartsOf(tiles.size(), depth);
  std::vector<Eigen::MatrixXd> sums(parts - 1, Eigen::MatrixXd(parts > 1 ? c->rows() : 0, c->cols()));
  ParallelFor(tiles.size() * parts, 1, [&](std::size_t begin, std::size_t end) {
    Workspace workspace(RoundUp(std::min(m, kTile), kRowStep), RoundUp(std::min(n, kTile), kColumnStep),
                        std::min(depth, kDepth));
    for (std::size_t t = begin; t < end; ++t) {
      Task task = tiles[t / parts];
      const std::size_t part = t % parts;
      task.begin = depth * part / parts, task.end = depth * (part + 1) / parts;
      ComputeTile(a, b_transposed, task, &workspace, part == 0 ? c : &sums[part - 1]);
    }
  });
  // Above the diagonal a symmetric one has nothing yet, or anything
  for (const Eigen::MatrixXd& sum : sums) *c += sum;
  if (symmetric) {
    for (Eigen::Index j = 0; j < c->cols(); ++j) {
      for (Eigen::Index i = 0; i < j; ++i) (*c)(i, j) = (*c)(j, i);
    }
  }
}

}  // namespace

GemmOperand GemmOperand::Dense(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  GemmOperand operand;
  operand.rows_ = static_cast<std::size_t>(matrix.rows());
  operand.columns_ = static_cast<std::size_t>(matrix.cols());
  operand.dense_ = matrix.data();
  operand.leading_ = static_cast<std::size_t>(matrix.outerStride());
  return operand;
}

GemmOperand GemmOperand::Poses(const PoseMatrix& poses, std::size_t first, std::size_t count,
                               std::size_t begin, std::size_t end, std::span<const double> column_scale) {
  KPSA_CHECK_LE(first + count, poses.poses());
  KPSA_CHECK_LE(end, poses.columns());
  GemmOperand operand;
  operand.rows_ = count;
  operand.columns_ = end - begin;
  operand.pose_rows_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) operand.pose_rows_.push_back(poses.row(first + i).data() + begin);
  if (!column_scale.empty()) operand.scale_ = column_scale.subspan(begin, end - begin);
  return operand;
}

GemmOperand GemmOperand::Transposed() const {
  GemmOperand operand = *this;
  operand.transposed_ = !transposed_;
  return operand;
}

void GemmOperand::Pack(std::size_t row, std::size_t height, std::size_t column, std::size_t width,
                       std::size_t step, double* out) const {
  for (std::size_t panel = 0; panel * step < height; ++panel) {
    double* target = out + panel * step * width;  // [width][step]
    const std::size_t first = row + panel * step, count = std::min(step, height - panel * step);
    if (count < step) std::fill_n(target, step * width, 0.0);
    if (dense_ != nullptr && !transposed_) {
      for (std::size_t k = 0; k < width; ++k)
        std::copy_n(dense_ + (column + k) * leading_ + first, count, target + k * step);
    } else if (dense_ != nullptr) {
      for (std::size_t i = 0; i < count; ++i) {
        const double* source = dense_ + (first + i) * leading_ + column;
        for (std::size_t k = 0; k < width; ++k) target[k * step + i] = source[k];
      }
    } else if (!transposed_) {
      const float* sources[kRowStep];
      for (std::size_t i = 0; i < count; ++i) sources[i] = pose_rows_[first + i] + column;
      for (std::size_t k = 0; k < width; ++k) {
        const double scale = scale_.empty() ? 1.0 : scale_[column + k];
        for (std::size_t i = 0; i < count; ++i)
          target[k * step + i] = static_cast<double>(sources[i][k]) * scale;
      }
    } else {
      for (std::size_t k = 0; k < width; ++k) {
        const float* source = pose_rows_[column + k] + first;
        for (std::size_t i = 0; i < count; ++i) target[k * step + i] = static_cast<double>(source[i]);
        if (!scale_.empty()) {
          for (std::size_t i = 0; i < count; ++i) target[k * step + i] *= scale_[first + i];
        }
      }
    }
  }
}

void Multiply(const GemmOperand& a, const GemmOperand& b, Eigen::MatrixXd* product) {
  Product(a, b.Transposed(), false, product);
}

Eigen::MatrixXd Multiply(const GemmOperand& a, const GemmOperand& b) {
  Eigen::MatrixXd product;
  Multiply(a, b, &product);
  return product;
}

Eigen::MatrixXd Multiply(const Eigen::Ref<const Eigen::MatrixXd>& a,
                         const Eigen::Ref<const Eigen::MatrixXd>& b) {
  return Multiply(GemmOperand::Dense(a), GemmOperand::Dense(b));
}

Eigen::MatrixXd Gram(const GemmOperand& a) {
  Eigen::MatrixXd gram;
  Product(a, a, true, &gram);
  return gram;
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
