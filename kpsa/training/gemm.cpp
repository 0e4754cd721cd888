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

// target[lanes] += sum
HWY_INLINE void AddTo(hn::Vec<hn::ScalableTag<double>> sum, double* HWY_RESTRICT target) {
  const hn::ScalableTag<double> d;
  hn::StoreU(hn::Add(hn::LoadU(d, target), sum), d, target);
}
HWY_INLINE void AddTo(hn::Vec<hn::ScalableTag<float>> sum, double* HWY_RESTRICT target) {
#if HWY_TARGET == HWY_SCALAR
  *target += static_cast<double>(hn::GetLane(sum));
#else
  const hn::ScalableTag<double> d;
  const hn::Rebind<float, decltype(d)> half;
  const hn::ScalableTag<float> whole;
  AddTo(hn::PromoteTo(d, hn::LowerHalf(half, sum)), target);
  AddTo(hn::PromoteTo(d, hn::UpperHalf(half, sum)), target + hn::Lanes(whole) / 2);
#endif
}

// c[kRowStep x kCount] += a-panel [depth][kRowStep] times kCount columns of a b-panel [depth][kColumnStep].
template <int kCount, int kVectors, typename Number>
HWY_INLINE void MicroTile(const Number* HWY_RESTRICT a, const Number* HWY_RESTRICT b, std::size_t depth,
                          double* HWY_RESTRICT c, std::size_t c_stride) {
  const hn::ScalableTag<Number> d;
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
      AddTo(sum[j][v], c + static_cast<std::size_t>(j) * c_stride + static_cast<std::size_t>(v) * lanes);
    }
  }
}

// c [row panels * 16 x column panels * 12], column-major, += packed a times packed b.
template <typename Number>
HWY_INLINE void Panels(const Number* a, const Number* b, std::size_t depth, std::size_t row_panels,
                       std::size_t column_panels, double* c, std::size_t c_stride) {
  constexpr std::size_t kLanes = HWY_LANES(Number);
  constexpr int kVectors = static_cast<int>(kRowStep / kLanes);
  // As many sums as the registers hold
  constexpr int kCount = kLanes * sizeof(Number) == 64 ? 12 : kVectors == 2 ? 6 : kVectors == 4 ? 3 : 1;
  for (std::size_t j = 0; j < column_panels; ++j) {
    for (std::size_t i = 0; i < row_panels; ++i) {
      for (std::size_t part = 0; part < kColumnStep; part += kCount) {
        MicroTile<kCount, kVectors>(a + i * depth * kRowStep, b + j * depth * kColumnStep + part, depth,
                                    c + (j * kColumnStep + part) * c_stride + i * kRowStep, c_stride);
      }
    }
  }
}
void PackedProduct(const double* a, const double* b, std::size_t depth, std::size_t row_panels,
                   std::size_t column_panels, double* c, std::size_t c_stride) {
  Panels(a, b, depth, row_panels, column_panels, c, c_stride);
}
void PackedProductOfFloats(const float* a, const float* b, std::size_t depth, std::size_t row_panels,
                           std::size_t column_panels, double* c, std::size_t c_stride) {
  Panels(a, b, depth, row_panels, column_panels, c, c_stride);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "base/cancel.h"
#include "base/check.h"
#include "base/fresh_pages.h"
#include "base/parallel.h"

namespace kpsa::engine {

HWY_EXPORT(PackedProduct);
HWY_EXPORT(PackedProductOfFloats);

namespace {

// Columns of a panel, [width][kStep]: of(k, i) is column k of row i, of which there are `count`.
template <std::size_t kStep, typename Number, typename Of>
void PackPanel(std::size_t count, std::size_t width, Number* to, const Of& of) {
  if (count == kStep) {  // a number that the compiler knows
    for (std::size_t k = 0; k < width; ++k, to += kStep) {
      for (std::size_t i = 0; i < kStep; ++i) to[i] = static_cast<Number>(of(k, i));
    }
    return;
  }
  std::fill_n(to, kStep * width, Number{0});
  for (std::size_t k = 0; k < width; ++k, to += kStep) {
    for (std::size_t i = 0; i < count; ++i) to[i] = static_cast<Number>(of(k, i));
  }
}

}  // namespace

template <std::size_t kStep, typename Number>
void GemmOperand::Pack(std::size_t row, std::size_t height, std::size_t column, std::size_t width,
                       Number* out) const {
  const auto of_poses = [&](std::size_t count, Number* to, const auto& value, const auto& scaled_by) {
    if (scale_.empty()) return PackPanel<kStep>(count, width, to, value);
    PackPanel<kStep>(count, width, to, [&](std::size_t k, std::size_t i) {
      return static_cast<double>(value(k, i)) * scale_[scaled_by(k, i)];
    });
  };
  for (std::size_t panel = 0; panel * kStep < height; ++panel) {
    Number* const to = out + panel * kStep * width;
    const std::size_t first = row + panel * kStep, count = std::min(kStep, height - panel * kStep);
    if (dense_ != nullptr && !transposed_) {
      const double* const from = dense_ + column * leading_ + first;
      PackPanel<kStep>(count, width, to,
                       [&](std::size_t k, std::size_t i) { return from[k * leading_ + i]; });
    } else if (dense_ != nullptr) {
      const double* const from = dense_ + first * leading_ + column;
      PackPanel<kStep>(count, width, to,
                       [&](std::size_t k, std::size_t i) { return from[i * leading_ + k]; });
    } else if (!transposed_) {
      const float* const* const from = pose_rows_.data() + first;
      of_poses(
          count, to, [&](std::size_t k, std::size_t i) { return from[i][column + k]; },
          [&](std::size_t k, std::size_t) { return column + k; });
    } else {
      const float* const* const from = pose_rows_.data() + column;
      of_poses(
          count, to, [&](std::size_t k, std::size_t i) { return from[k][first + i]; },
          [&](std::size_t, std::size_t i) { return first + i; });
    }
  }
}

namespace {

constexpr std::size_t kTile = 384;   // rows and columns of C that one task computes: a multiple of 16 and 12
constexpr std::size_t kDepth = 128;  // columns of A packed at a time; a panel of them stays in the L1 cache
// Where C has fewer tiles than this, its depth is split into so many parts at most, of so many columns at least
constexpr std::size_t kFewTiles = 4, kMostParts = 8, kPartDepth = 8 * kDepth;

// At a 64-byte boundary: vectors that straddle cache lines cost a third of the speed.
template <typename Number>
class AlignedNumbers {
 public:
  explicit AlignedNumbers(std::size_t size)
      : floats_(AlignedFloats::Uninitialized(sizeof(Number) / sizeof(float) * size)) {}
  Number* data() { return reinterpret_cast<Number*>(floats_.data()); }

 private:
  AlignedFloats floats_;
};

std::size_t RoundUp(std::size_t count, std::size_t step) { return (count + step - 1) / step * step; }

// What tiles of a product are computed in, one after the other.
template <typename Number>
struct Workspace {
  Workspace(std::size_t rows, std::size_t columns, std::size_t depth)
      : a(rows * depth), b(columns * depth), tile(rows * columns) {}
  AlignedNumbers<Number> a, b;
  AlignedNumbers<double> tile;
};

void MultiplyPacked(Workspace<double>* of, std::size_t depth, std::size_t row_panels,
                    std::size_t column_panels) {
  HWY_DYNAMIC_DISPATCH(PackedProduct)
  (of->a.data(), of->b.data(), depth, row_panels, column_panels, of->tile.data(), row_panels * kRowStep);
}
void MultiplyPacked(Workspace<float>* of, std::size_t depth, std::size_t row_panels,
                    std::size_t column_panels) {
  HWY_DYNAMIC_DISPATCH(PackedProductOfFloats)
  (of->a.data(), of->b.data(), depth, row_panels, column_panels, of->tile.data(), row_panels * kRowStep);
}

// A tile of C and what columns of A it is summed over.
struct Task {
  std::size_t row, column, begin, end;
};

// One tile of C, accumulated over the columns of A in a fixed order.
template <typename Number>
void ComputeTile(const GemmOperand& a, const GemmOperand& b_transposed, const Task& task,
                 Workspace<Number>* workspace, Eigen::MatrixXd* c) {
  const std::size_t height = std::min(kTile, a.rows() - task.row),
                    width = std::min(kTile, b_transposed.rows() - task.column);
  const std::size_t row_panels = (height + kRowStep - 1) / kRowStep;
  const std::size_t column_panels = (width + kColumnStep - 1) / kColumnStep;
  double* const tile = workspace->tile.data();
  std::fill_n(tile, row_panels * kRowStep * column_panels * kColumnStep, 0.0);
  for (std::size_t k = task.begin; k < task.end; k += kDepth) {
    ThrowIfCancelled();
    const std::size_t depth = std::min(kDepth, task.end - k);
    a.Pack<kRowStep>(task.row, height, k, depth, workspace->a.data());
    b_transposed.Pack<kColumnStep>(task.column, width, k, depth, workspace->b.data());
    MultiplyPacked(workspace, depth, row_panels, column_panels);
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

template <typename Number>
void Product(const GemmOperand& a, const GemmOperand& b_transposed, bool symmetric, Eigen::MatrixXd* c) {
  KPSA_CHECK_EQ(a.columns(), b_transposed.columns());
  const std::size_t m = a.rows(), n = b_transposed.rows(), depth = a.columns();
  c->resize(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(n));
  if (m == 0 || n == 0) return;
  if (depth == 0) {
    c->setZero();
    return;
  }
  FetchPages(c->data(), m * n * sizeof(double));
  std::vector<Task> tiles;
  for (std::size_t j = 0; j < n; j += kTile) {
    for (std::size_t i = symmetric ? j : 0; i < m; i += kTile) tiles.push_back({i, j, 0, depth});
  }
  const std::size_t parts = PartsOf(tiles.size(), depth);
  std::vector<Eigen::MatrixXd> sums(parts - 1, Eigen::MatrixXd(parts > 1 ? c->rows() : 0, c->cols()));
  ParallelFor(tiles.size() * parts, 1, [&](std::size_t begin, std::size_t end) {
    Workspace<Number> workspace(RoundUp(std::min(m, kTile), kRowStep),
                                RoundUp(std::min(n, kTile), kColumnStep), std::min(depth, kDepth));
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

void Multiply(const GemmOperand& a, const GemmOperand& b, Eigen::MatrixXd* product) {
  Product<double>(a, b.Transposed(), false, product);
}

void MultiplyFloats(const GemmOperand& a, const GemmOperand& b, Eigen::MatrixXd* product) {
  Product<float>(a, b.Transposed(), false, product);
}

Eigen::MatrixXd MultiplyFloats(const GemmOperand& a, const GemmOperand& b) {
  Eigen::MatrixXd product;
  MultiplyFloats(a, b, &product);
  return product;
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
  Product<double>(a, a, true, &gram);
  return gram;
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
