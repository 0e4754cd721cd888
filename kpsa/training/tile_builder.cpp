// Lays the factors of all tiles out; see kpsa/tiles.h.
#include "kpsa/training/tile_builder.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>

#include "base/check.h"
#include "base/parallel.h"
#include "kpsa/training/tile_factorer.h"
#include "kpsa/training/tile_products.h"

namespace kpsa::engine {
namespace {

std::size_t Padded16(std::size_t count) { return (count + 15) / 16 * 16; }

// Byte column k of a row: the high bytes of the wide columns, their low bytes, the other columns.
int ByteOf(const TileFactors& f, Eigen::Index row, Eigen::Index k) {
  if (k >= 2 * f.wide) return static_cast<int>(f.u(row, k - f.wide));
  const int value = static_cast<int>(f.u(row, k % f.wide)),
            high = static_cast<int>(std::floor((value + 128) / 256.0));
  return k < f.wide ? high : value - 256 * high;
}

// U of a tile, panel after panel. Returns the end.
std::uint8_t* WriteColumns(const TileFactors& f, std::size_t components, std::size_t panels,
                           std::uint8_t* to) {
  const std::size_t rows = kPanelPoints * components;
  const Eigen::Index columns = f.u.cols() + f.wide, padded = (columns + 3) / 4 * 4;
  for (std::size_t panel = 0; panel < panels; ++panel) {
    for (std::size_t row = 0; row < rows; ++row) {
      const std::size_t point = panel * kPanelPoints + row % kPanelPoints;
      const auto i = static_cast<Eigen::Index>(point * components + row / kPanelPoints);
      for (Eigen::Index k = 0; k < padded; ++k) {
        // Bytes 0 and 2 of the four meet the first two inputs
        constexpr std::size_t kPlace[4] = {0, 2, 1, 3};
        const int value = i < f.u.rows() && k < columns ? ByteOf(f, i, k) : 0;
        to[(static_cast<std::size_t>(k / 4) * rows + row) * 4 + kPlace[k % 4]] =
            static_cast<std::uint8_t>(value + 128);
      }
    }
    to += static_cast<std::size_t>(padded) * rows;
  }
  return to;
}

// The products of all tiles; nothing where no tile has some.
void WriteProducts(const std::vector<TileFactors>& factors, const std::vector<TileProducts>& products,
                   TileData* data) {
  const auto put = [](const Eigen::MatrixXd& matrix, std::size_t rows, std::uint16_t* to) {
    for (Eigen::Index q = 0; q < matrix.cols(); ++q, to += rows) {
      for (Eigen::Index k = 0; k < matrix.rows(); ++k)
        to[k] = HalfFromFloat(static_cast<float>(matrix(k, q)));
    }
    return to;
  };
  std::size_t w = 0, doubt = 0, whitening = 0;
  for (std::size_t t = 0; t < factors.size(); ++t) {
    const std::size_t count = products[t].pairs.size() / 2;
    data->products.push_back(static_cast<std::uint32_t>(count));
    data->pairs.insert(data->pairs.end(), products[t].pairs.begin(), products[t].pairs.end());
    w += count * Padded16(static_cast<std::size_t>(factors[t].u.cols()));
    doubt += 16 * count, whitening += count > 0 ? 32 : 0;
  }
  if (data->pairs.empty()) return data->products.clear();
  data->whitening = AlignedArray<float>(whitening);
  data->w = AlignedArray<std::uint16_t>(w);
  data->doubt = AlignedArray<std::uint16_t>(doubt);
  std::uint16_t *w_to = data->w.data(), *doubt_to = data->doubt.data();
  float* whitening_to = data->whitening.data();
  for (std::size_t t = 0; t < factors.size(); ++t) {
    if (products[t].pairs.empty()) continue;
    for (std::size_t i = 0; i < kLatents; ++i)
      whitening_to[i] = static_cast<float>(products[t].whitening[static_cast<Eigen::Index>(i)]);
    for (std::size_t i = 16; i < 32; ++i) whitening_to[i] = static_cast<float>(products[t].doubt_scale);
    whitening_to += 32;
    w_to = put(products[t].w, Padded16(static_cast<std::size_t>(factors[t].u.cols())), w_to);
    doubt_to = put(products[t].doubt, 16, doubt_to);
  }
}

// The joints in whose spaces tiles lie, each once; nothing where there are none.
void WriteJoints(const std::vector<std::vector<std::uint32_t>>& rows_of_tile,
                 const std::vector<double>& scale_of_tile, const TileInputs& inputs, TileData* data) {
  std::map<std::vector<std::uint32_t>, std::uint32_t> number;
  std::vector<std::uint32_t> joints;
  for (std::size_t t = 0; t < rows_of_tile.size(); ++t) {
    const std::vector<std::uint32_t>& rows = rows_of_tile[t];
    if (rows.empty()) {
      joints.push_back(0);
      continue;
    }
    KPSA_CHECK_EQ(rows.size(), 12u);
    const auto [found, is_new] = number.emplace(rows, static_cast<std::uint32_t>(number.size() + 1));
    joints.push_back(found->second);
    if (!is_new) continue;
    for (std::size_t e = 0; e < rows.size(); ++e) {
      const double scale = e < 9 ? scale_of_tile[t] : 1;
      data->joint_rows.push_back(rows[e]);
      data->joint_mean.push_back(inputs.row_mean[rows[e]] / scale);
      data->joint_deviation.push_back(1 / inputs.row_scale[rows[e]] / scale);
    }
  }
  if (!number.empty()) data->joints = std::move(joints);
}

// What the poses are in some columns. [height x T]
Eigen::MatrixXd TargetOf(const PoseMatrix& poses, std::size_t first, std::size_t height) {
  Eigen::MatrixXd target(static_cast<Eigen::Index>(height), static_cast<Eigen::Index>(poses.poses()));
  for (std::size_t t = 0; t < poses.poses(); ++t) {
    target.col(static_cast<Eigen::Index>(t)) =
        Eigen::Map<const Eigen::VectorXf>(poses.row(t).data() + first, static_cast<Eigen::Index>(height))
            .cast<double>();
  }
  return target;
}

// Where more is left out anyway than the budget of a tile, that is the budget.
TileOptions OwnOptions(const TileOptions& options, const TileModel& model) {
  TileOptions own = options;
  own.rms_budget *= model.of_budget, own.max_budget *= model.of_budget;
  if (!(options.left_out_share > 0)) return own;
  const double least = own.rms_budget;
  own.rms_budget = std::max(least, options.left_out_share * std::sqrt(model.left_out));
  own.max_budget *= own.rms_budget / least;
  return own;
}

TileFactors FactorModel(const TileModel& model, const Eigen::MatrixXd& samples, int components,
                        const TileOptions& options, bool may_be_direct) {
  const bool all = samples.size() == 0 || samples.rows() == static_cast<Eigen::Index>(model.columns.size());
  TileFactors factors = FactorTile(model.gain, model.covariance,
                                   all ? samples : Eigen::MatrixXd(samples(model.columns, Eigen::all)),
                                   components, options, may_be_direct);
  for (std::uint32_t& column : factors.columns) column = model.columns[column];
  return factors;
}

}  // namespace

TileMap BuildTiles(const Eigen::MatrixXd& gain, const Eigen::VectorXd& mean, int components,
                   const TileInputs& inputs, const TileOptions& options, TileReport* report) {
  KPSA_CHECK(components == 1 || components == 3);
  KPSA_CHECK_EQ(gain.rows(), mean.size());
  KPSA_CHECK(inputs.left_out.size() == 0 || inputs.left_out.size() == gain.rows());
  const auto model = [&](std::size_t tile) {
    const auto tile_rows = static_cast<Eigen::Index>(kTilePoints) * components;
    const Eigen::Index first = static_cast<Eigen::Index>(tile) * tile_rows,
                       height = std::min(tile_rows, gain.rows() - first);
    TileModel all;
    all.columns.resize(static_cast<std::size_t>(gain.cols()));
    std::iota(all.columns.begin(), all.columns.end(), 0u);
    all.gain = gain.middleRows(first, height);
    all.covariance = inputs.covariance.size() > 0
                         ? inputs.covariance
                         : Eigen::MatrixXd(Eigen::MatrixXd::Identity(gain.cols(), gain.cols()));
    if (inputs.left_out.size() > 0)
      all.left_out = inputs.left_out.segment(first, height).sum() / static_cast<double>(height / components);
    return all;
  };
  return BuildTiles(model, mean, components, static_cast<std::size_t>(gain.cols()), inputs, options, report);
}

TileMap BuildTiles(const std::function<TileModel(std::size_t tile)>& models, const Eigen::VectorXd& mean,
                   int components, std::size_t inputs_count, const TileInputs& inputs,
                   const TileOptions& options, TileReport* report) {
  TileBuilder builder(components, inputs_count);
  const std::size_t points = static_cast<std::size_t>(mean.size()) / static_cast<std::size_t>(components);
  builder.Add((points + kTilePoints - 1) / kTilePoints, models, inputs, options);
  return builder.Finish(mean, inputs, report);
}

struct TileBuilder::Made {
  std::vector<TileFactors> factors;
  std::vector<TileProducts> products;
  std::vector<std::vector<std::uint32_t>> joint_rows;
  std::vector<double> joint_scales;
  std::vector<Eigen::VectorXd> means;
};

TileBuilder::TileBuilder(int components, std::size_t inputs_count)
    : components_(components), inputs_count_(inputs_count), made_(std::make_unique<Made>()) {}
TileBuilder::~TileBuilder() = default;

void TileBuilder::Add(std::size_t tiles, const std::function<TileModel(std::size_t tile)>& models,
                      const TileInputs& inputs, const TileOptions& options) {
  const std::size_t first = made_->factors.size();
  made_->factors.resize(first + tiles);
  made_->products.resize(first + tiles);
  made_->joint_rows.resize(first + tiles);
  made_->joint_scales.resize(first + tiles);
  made_->means.resize(first + tiles);
  ParallelFor(tiles, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const TileModel model = models(t);
      const TileOptions own = OwnOptions(options, model);
      TileFactors& factors = made_->factors[first + t];
      factors = FactorModel(model, inputs.samples, components_, own, true);
      made_->joint_rows[first + t] = model.joint_rows;
      made_->joint_scales[first + t] = model.joint_scale;
      made_->means[first + t] = model.mean;
      if (inputs.poses == nullptr || components_ != 3 || factors.columns.empty()) continue;
      TileFactors factored =
          factors.direct ? FactorModel(model, inputs.samples, components_, own, false) : factors;
      const Eigen::MatrixXd target =
          model.target.size() > 0
              ? Eigen::MatrixXd()
              : TargetOf(*inputs.poses,
                         inputs.first_column + t * kTilePoints * static_cast<std::size_t>(components_),
                         static_cast<std::size_t>(model.gain.rows()));
      TileProducts& products = made_->products[first + t];
      products = FitProducts(model.target.size() > 0 ? model.target : target, *inputs.measured,
                             inputs.clip_poses, own, &factored);
      if (!products.pairs.empty()) factors = std::move(factored);
    }
  });
}

TileMap TileBuilder::Finish(const Eigen::VectorXd& mean, const TileInputs& inputs, TileReport* report) {
  const std::vector<TileFactors>& factors = made_->factors;
  const std::vector<Eigen::VectorXd>& means = made_->means;
  TileData data;
  const auto c = static_cast<std::size_t>(components_);
  data.points = static_cast<std::size_t>(mean.size()) / c;
  data.components = components_;
  data.inputs = inputs_count_;
  const std::size_t tiles = factors.size(), rows = kPanelPoints * c;
  KPSA_CHECK_EQ(tiles, (data.points + kTilePoints - 1) / kTilePoints);
  const auto panels = [&](std::size_t tile) {
    return (std::min(kTilePoints, data.points - tile * kTilePoints) + kPanelPoints - 1) / kPanelPoints;
  };

  // Sizes, then the layout
  std::size_t scales = 0, v_size = 0, u_size = 0;
  double squared_error = 0;
  TileReport found;
  for (std::size_t t = 0; t < tiles; ++t) {
    const TileFactors& f = factors[t];
    const auto rank = static_cast<std::size_t>(f.u.cols()), wide = static_cast<std::size_t>(f.wide);
    const std::size_t points = std::min(kTilePoints, data.points - t * kTilePoints);
    data.ranks.push_back(static_cast<std::uint32_t>(rank));
    data.wide.push_back(static_cast<std::uint32_t>(wide));
    data.counts.push_back(static_cast<std::uint32_t>(f.columns.size()));
    data.direct.push_back(f.direct ? 1 : 0);
    data.columns.insert(data.columns.end(), f.columns.begin(), f.columns.end());
    scales += Padded16(rank);
    v_size += f.direct ? 0 : f.columns.size() * Padded16(rank);
    u_size += panels(t) * ((rank + wide + 3) / 4 * 4) * rows;
    squared_error += f.squared_error;
    found.worst_tile_rms =
        std::max(found.worst_tile_rms, std::sqrt(f.squared_error / static_cast<double>(points)));
    found.largest = std::max(found.largest, f.largest);
    found.direct_tiles += f.direct ? 1 : 0;
  }
  found.rms = data.points == 0 ? 0 : std::sqrt(squared_error / static_cast<double>(data.points));
  data.scale = AlignedArray<float>(scales);
  data.v = AlignedArray<std::uint16_t>(v_size);
  data.u = AlignedArray<std::uint8_t>(u_size);
  data.mean = AlignedArray<float>((data.points + kPanelPoints - 1) / kPanelPoints * rows);
  for (std::size_t i = 0; i < data.points * c; ++i) {
    const std::size_t point = i / c;
    data.mean.data()[point / kPanelPoints * rows + i % c * kPanelPoints + point % kPanelPoints] =
        static_cast<float>(means[point / kTilePoints].size() > 0
                               ? means[point / kTilePoints][static_cast<Eigen::Index>(i % (kTilePoints * c))]
                               : mean[static_cast<Eigen::Index>(i)]);
  }
  float* scale = data.scale.data();
  std::uint16_t* v = data.v.data();
  std::uint8_t* u = data.u.data();
  for (std::size_t t = 0; t < tiles; ++t) {
    const TileFactors& f = factors[t];
    const std::size_t k16 = Padded16(static_cast<std::size_t>(f.u.cols()));
    for (Eigen::Index k = 0; k < f.u.cols(); ++k) {
      scale[k] = static_cast<float>(f.scale[k]);
      for (Eigen::Index j = 0; j < f.v.cols(); ++j)
        v[static_cast<std::size_t>(j) * k16 + static_cast<std::size_t>(k)] =
            HalfFromFloat(static_cast<float>(f.v(k, j)));
    }
    scale += k16;
    v += static_cast<std::size_t>(f.v.cols()) * k16;
    u = WriteColumns(f, c, panels(t), u);
  }
  WriteProducts(factors, made_->products, &data);
  WriteJoints(made_->joint_rows, made_->joint_scales, inputs, &data);
  if (report != nullptr) *report = found;
  Result<TileMap> map = TileMap::Make(std::move(data), "tiles");
  KPSA_CHECK(map.ok());
  return std::move(*map);
}

std::uint16_t HalfFromFloat(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, 4);
  const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000u);
  bits &= 0x7fffffffu;
  if (bits >= 0x7f800000u) return static_cast<std::uint16_t>(sign | (bits > 0x7f800000u ? 0x7e00u : 0x7c00u));
  if (bits < 0x38800000u) {  // below 2^-14: a multiple of 2^-24
    float magnitude;
    std::memcpy(&magnitude, &bits, 4);
    return static_cast<std::uint16_t>(sign |
                                      static_cast<std::uint16_t>(std::nearbyint(magnitude * 16777216.0f)));
  }
  bits += 0xfffu + (bits >> 13 & 1u);  // to nearest, ties to even; the carry may raise the exponent
  const std::uint32_t half = (bits - 0x38000000u) >> 13;
  return static_cast<std::uint16_t>(sign | (half >= 0x7c00u ? 0x7c00u : half));
}

float FloatFromHalf(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16, exponent = half >> 10 & 0x1fu, fraction = half & 0x3ffu;
  std::uint32_t bits;
  if (exponent == 0) {
    const float magnitude = static_cast<float>(fraction) / 16777216.0f;
    std::memcpy(&bits, &magnitude, 4);
  } else {
    bits = ((exponent == 31 ? 255u : exponent + 112u) << 23) | fraction << 13;
  }
  bits |= sign;
  float value;
  std::memcpy(&value, &bits, 4);
  return value;
}

}  // namespace kpsa::engine
