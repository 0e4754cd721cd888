#include "kpsa/training/selection_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kpsa/training/selection_kernel.cpp"
#include "hwy/foreach_target.h"

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

// Sum of all lanes; the order differs between targets, which selection may do.
template <class V>
HWY_INLINE double Total(V v) {
  const hn::DFromV<V> d;
  HWY_ALIGN double lanes[HWY_MAX_BYTES / sizeof(double)];
  hn::Store(v, d, lanes);
  double sum = 0;
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) sum += lanes[i];
  return sum;
}

// One row of C against `ranks` rows of the update, then its row of H: h += sum_b sign p_b u_b. p [ranks].
template <int kRanks>
HWY_INLINE void CorrectRow(const float* HWY_RESTRICT c, std::size_t stride, const double* HWY_RESTRICT update,
                           const double* HWY_RESTRICT root_update, double sign, double* HWY_RESTRICT h,
                           double* p) {
  const hn::ScalableTag<double> d;
  const hn::Rebind<float, decltype(d)> df;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d);
  V dot[kRanks], factor[kRanks];
  for (int b = 0; b < kRanks; ++b) dot[b] = hn::Zero(d);
  for (std::size_t k = 0; k < stride; k += lanes) {
    const V value = hn::PromoteTo(d, hn::LoadU(df, c + k));
    for (int b = 0; b < kRanks; ++b)
      dot[b] = hn::MulAdd(value, hn::Load(d, update + static_cast<std::size_t>(b) * stride + k), dot[b]);
  }
  for (int b = 0; b < kRanks; ++b) {
    p[b] = Total(dot[b]);
    factor[b] = hn::Set(d, sign * p[b]);
  }
  for (std::size_t k = 0; k < stride; k += lanes) {
    V value = hn::Load(d, h + k);
    for (int b = 0; b < kRanks; ++b)
      value =
          hn::MulAdd(factor[b], hn::Load(d, root_update + static_cast<std::size_t>(b) * stride + k), value);
    hn::Store(value, d, h + k);
  }
}

void CorrectRows(const float* c, std::size_t rows, std::size_t stride, const double* update,
                 const double* root_update, std::size_t ranks, double sign, double* h, double* p) {
  for (std::size_t row = 0; row < rows; ++row) {
    const float* c_row = c + row * stride;
    double* h_row = h + row * stride;
    double* p_row = p + row * 3;
    if (ranks == 1) CorrectRow<1>(c_row, stride, update, root_update, sign, h_row, p_row);
    if (ranks == 2) CorrectRow<2>(c_row, stride, update, root_update, sign, h_row, p_row);
    if (ranks == 3) CorrectRow<3>(c_row, stride, update, root_update, sign, h_row, p_row);
  }
}

// Lower triangle of H_i H_i^T for the rows of one candidate.
void RowProducts(const double* h, std::size_t rows, std::size_t stride, double* products) {
  const hn::ScalableTag<double> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      auto sum = hn::Zero(d);
      for (std::size_t k = 0; k < stride; k += lanes)
        sum = hn::MulAdd(hn::Load(d, h + i * stride + k), hn::Load(d, h + j * stride + k), sum);
      products[3 * i + j] = products[3 * j + i] = Total(sum);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <Eigen/Cholesky>
#include <algorithm>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/training/gemm.h"

namespace kpsa::engine {

HWY_EXPORT(CorrectRows);
HWY_EXPORT(RowProducts);

namespace {

constexpr std::size_t kGrain = 256;  // candidates a task

double* Doubles(AlignedFloats& floats) { return reinterpret_cast<double*>(floats.data()); }

}  // namespace

CandidateGains::CandidateGains(std::vector<Index> offsets, std::vector<float> loadings,
                               std::vector<double> noise, Eigen::MatrixXd output_root)
    : offsets_(std::move(offsets)), noise_(std::move(noise)), output_root_(std::move(output_root)) {
  const std::size_t rows = noise_.size();
  KPSA_CHECK_EQ(static_cast<std::size_t>(offsets_.back()), rows);
  modes_ = rows == 0 ? 0 : loadings.size() / rows;
  KPSA_CHECK_EQ(modes_ * rows, loadings.size());
  stride_ = (modes_ + 15) / 16 * 16;
  loadings_.assign(rows * stride_, 0.0f);
  for (std::size_t row = 0; row < rows; ++row)
    std::copy_n(loadings.data() + row * modes_, modes_, loadings_.data() + row * stride_);
  products_ = AlignedFloats(2 * rows * stride_);
  blocks_.resize(3 * rows);
  gains_.resize(count());
}

Eigen::MatrixXd CandidateGains::Loadings(std::size_t candidate) const {
  const auto height = static_cast<Eigen::Index>(offsets_[candidate + 1] - offsets_[candidate]);
  Eigen::MatrixXd rows(height, static_cast<Eigen::Index>(modes_));
  for (Eigen::Index i = 0; i < height; ++i) {
    const float* row = loadings_.data() + (offsets_[candidate] + static_cast<std::size_t>(i)) * stride_;
    for (std::size_t k = 0; k < modes_; ++k)
      rows(i, static_cast<Eigen::Index>(k)) = static_cast<double>(row[k]);
  }
  return rows;
}

Eigen::VectorXd CandidateGains::Noise(std::size_t candidate) const {
  const auto height = static_cast<Eigen::Index>(offsets_[candidate + 1] - offsets_[candidate]);
  return Eigen::Map<const Eigen::VectorXd>(noise_.data() + offsets_[candidate], height);
}

void CandidateGains::UpdateGain(std::size_t candidate) {
  const std::size_t begin = offsets_[candidate], height = offsets_[candidate + 1] - begin;
  double products[9];
  HWY_DYNAMIC_DISPATCH(RowProducts)(Doubles(products_) + begin * stride_, height, stride_, products);
  const auto h = static_cast<Eigen::Index>(height);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3, 3> g(h, h), n(h, h);
  for (Eigen::Index i = 0; i < h; ++i) {
    for (Eigen::Index j = 0; j < h; ++j) {
      g(i, j) = blocks_[(begin + static_cast<std::size_t>(i)) * 3 + static_cast<std::size_t>(j)];
      n(i, j) = products[3 * i + j];
    }
    g(i, i) = std::max(g(i, i), 0.0) + noise_[begin + static_cast<std::size_t>(i)];
  }
  const double gain = g.llt().solve(n).trace();
  gains_[candidate] = gain > 0 ? gain : 0;
}

void CandidateGains::Reset(const Eigen::MatrixXd& sigma) {
  const Eigen::MatrixXd root = output_root_.size() == 0 ? sigma : Multiply(sigma, output_root_.transpose());
  constexpr std::size_t kChunk = 1024;  // candidates at a time: bounds the copy in float64
  for (std::size_t first = 0; first < count(); first += kChunk) {
    const std::size_t last = std::min(first + kChunk, count());
    const std::size_t begin = offsets_[first], rows = offsets_[last] - begin;
    Eigen::MatrixXd c(static_cast<Eigen::Index>(modes_),
                      static_cast<Eigen::Index>(rows));  // C^T of the chunk
    for (std::size_t row = 0; row < rows; ++row) {
      const Eigen::Map<const Eigen::VectorXf> source(loadings_.data() + (begin + row) * stride_,
                                                     static_cast<Eigen::Index>(modes_));
      c.col(static_cast<Eigen::Index>(row)) = source.cast<double>();
    }
    const Eigen::MatrixXd h =
        Multiply(GemmOperand::Dense(root).Transposed(), GemmOperand::Dense(c));  // [M x rows]
    const Eigen::MatrixXd t = output_root_.size() == 0 ? h : Multiply(sigma, c);
    for (std::size_t row = 0; row < rows; ++row) {
      std::copy_n(h.col(static_cast<Eigen::Index>(row)).data(), modes_,
                  Doubles(products_) + (begin + row) * stride_);
    }
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t a = offsets_[i]; a < offsets_[i + 1]; ++a) {
        for (std::size_t b = offsets_[i]; b < offsets_[i + 1]; ++b) {
          blocks_[a * 3 + b - offsets_[i]] =
              t.col(static_cast<Eigen::Index>(a - begin)).dot(c.col(static_cast<Eigen::Index>(b - begin)));
        }
      }
    }
  }
  ParallelFor(count(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) UpdateGain(i);
  });
}

void CandidateGains::Apply(const Eigen::MatrixXd& update, double sign) {
  const auto ranks = static_cast<std::size_t>(update.rows());
  KPSA_CHECK_LE(ranks, std::size_t{3});
  const Eigen::MatrixXd root =
      output_root_.size() == 0 ? update : Eigen::MatrixXd(update * output_root_.transpose());
  AlignedFloats storage(2 * 2 * 3 * stride_);
  double* rows = Doubles(storage);
  double* root_rows = rows + 3 * stride_;
  for (std::size_t b = 0; b < ranks; ++b) {
    for (std::size_t k = 0; k < modes_; ++k) {
      rows[b * stride_ + k] = update(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(k));
      root_rows[b * stride_ + k] = root(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(k));
    }
  }
  ParallelFor(count(), kGrain, [&](std::size_t begin, std::size_t end) {
    double p[9];
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t first = offsets_[i], height = offsets_[i + 1] - first;
      HWY_DYNAMIC_DISPATCH(CorrectRows)
      (loadings_.data() + first * stride_, height, stride_, rows, root_rows, ranks, sign,
       Doubles(products_) + first * stride_, p);
      for (std::size_t a = 0; a < height; ++a) {
        for (std::size_t b = 0; b < height; ++b) {
          double sum = 0;
          for (std::size_t k = 0; k < ranks; ++k) sum += p[3 * a + k] * p[3 * b + k];
          blocks_[(first + a) * 3 + b] += sign * sum;
        }
      }
      UpdateGain(i);
    }
  });
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
