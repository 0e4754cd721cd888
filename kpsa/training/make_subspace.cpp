#include "kpsa/training/make_subspace.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "kpsa/training/quantile.h"
#include "kpsa/training/tile_builder.h"

namespace kpsa::engine {
namespace {

constexpr double kQuantile = 0.99;
constexpr Eigen::Index kTileSamples = 400;

// Rows that span those of p = (coordinates) y, M <= r.
Eigen::MatrixXd OrthonormalRows(const Eigen::MatrixXd& coordinates) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(coordinates.transpose());
  const Eigen::MatrixXd q =
      qr.householderQ() * Eigen::MatrixXd::Identity(coordinates.cols(), coordinates.rows());
  return q.transpose();
}

// F in the layout of SoftCacheModel::factor.
AlignedArray<float> PackFactor(const Eigen::MatrixXd& matrix, bool lower, std::size_t size) {
  AlignedArray<float> factor(size);
  const Eigen::Index n = matrix.rows(), columns = matrix.cols(), all = (columns + 15) / 16;
  float* to = factor.data();
  for (Eigen::Index row = 0; row < n; row += 4) {
    const Eigen::Index groups = lower ? row / 16 + 1 : all;
    for (Eigen::Index group = 0; group < groups; ++group) {
      for (Eigen::Index i = row; i < row + 4; ++i) {
        for (Eigen::Index j = 16 * group; j < 16 * group + 16; ++j)
          *to++ = i < n && j < columns ? static_cast<float>(matrix(i, j)) : 0.0f;
      }
    }
  }
  return factor;
}

// Of the values that tiles are a linear map of: y, or where the estimator has no gain, latent coordinates.
TileInputs InputsOf(const Estimator& estimator, const Eigen::MatrixXd& training) {
  TileInputs inputs;
  inputs.covariance = estimator.covariance;
  inputs.samples = SampledColumns(training);
  if (estimator.gain.size() > 0) return inputs;
  const Eigen::MatrixXd& q = estimator.coordinates;
  inputs.covariance = q * estimator.covariance * q.transpose();
  inputs.samples = (q * inputs.samples).eval();
  return inputs;
}

// That map. [cN x r or M]
Eigen::Ref<const Eigen::MatrixXd> MapOf(const Pca& pca, const Estimator& estimator) {
  using Map = Eigen::Ref<const Eigen::MatrixXd>;
  return estimator.gain.size() == 0 ? Map(pca.output_modes()) : Map(estimator.gain);
}

}  // namespace

SoftCacheModel MakeSoftCacheModel(const Estimator& estimator, const CueSet& cues,
                                  const Eigen::MatrixXd& training) {
  KPSA_CHECK_EQ(training.rows(), cues.rows());
  SoftCacheModel model;
  model.mode = estimator.mode;
  model.offsets = cues.offsets;
  const bool map = model.mode == EstimatorMode::kMap;
  model.modes = static_cast<std::size_t>(estimator.coordinates.rows());
  model.factor = PackFactor(map ? estimator.whitening : OrthonormalRows(estimator.coordinates), map,
                            model.factor_size());
  for (std::size_t k = 0; k < cues.cues.size() && model.mode == EstimatorMode::kMap; ++k) {
    const auto begin = static_cast<Eigen::Index>(cues.offsets[k]);
    const Eigen::Index height = static_cast<Eigen::Index>(cues.offsets[k + 1]) - begin;
    Eigen::MatrixXd block = estimator.judge.block(begin, begin, height, height);
    block = block.llt().solve(Eigen::MatrixXd::Identity(height, height)).eval();
    // The error of a scalar counts by the displacement it stands for, so that all cues speak of lengths
    if (cues.cues[k].kind == CueKind::kScalar) block *= estimator.reach[begin];
    for (Eigen::Index i = 0; i < block.size(); ++i)
      model.leave_one_out.push_back(static_cast<float>(block.data()[i]));
  }

  // Quantiles over the training poses; the floors keep a score of pure rounding from becoming a large one
  std::vector<double> scores1, scores2;
  std::vector<float> y(model.padded_rows()), g(model.padded_rows());
  for (Eigen::Index t = 0; t < training.cols(); ++t) {
    for (Eigen::Index j = 0; j < training.rows(); ++j)
      y[static_cast<std::size_t>(j)] = static_cast<float>(training(j, t));
    const RawScores raw = ComputeRawScores(model, y, g);
    scores1.push_back(raw.score1);
    scores2.push_back(raw.score2);
  }
  const double noise = cues.rows() == 0 ? 0 : std::sqrt(cues.noise.minCoeff());
  const double floor1 =
      model.mode == EstimatorMode::kPaper ? noise : 1e-6 * static_cast<double>(model.rows());
  model.quantile1 = std::max(
      {scores1.empty() ? 0 : Quantile(scores1, kQuantile), floor1, std::numeric_limits<double>::min()});
  model.quantile2 = std::max(
      {scores2.empty() ? 0 : Quantile(scores2, kQuantile), noise, std::numeric_limits<double>::min()});
  return model;
}

Eigen::MatrixXd SampledColumns(const Eigen::MatrixXd& training) {
  const Eigen::Index count = std::min<Eigen::Index>(training.cols(), kTileSamples);
  Eigen::MatrixXd samples(training.rows(), count);
  for (Eigen::Index i = 0; i < count; ++i)
    samples.col(i) = training.col((2 * i + 1) * training.cols() / (2 * count));
  return samples;
}

Subspace MakeSubspace(const Pca& pca, const CueSet& cues, const Estimator& estimator,
                      const Eigen::MatrixXd& training, std::vector<SubspaceOutput> outputs,
                      const TileOptions& options, const PoseMatrix* poses, std::size_t clip_poses) {
  Subspace s;
  s.mode = estimator.mode;
  s.components = pca.layout.components;
  s.modes = static_cast<std::size_t>(pca.mode_count());
  s.outputs = std::move(outputs);
  s.cue_mean.assign(cues.mean.data(), cues.mean.data() + cues.mean.size());
  s.cue_scale.assign(cues.scale.data(), cues.scale.data() + cues.scale.size());
  s.soft_cache = MakeSoftCacheModel(estimator, cues, training);

  TileInputs inputs = InputsOf(estimator, training);
  const bool latent = estimator.gain.size() == 0;
  const Eigen::Ref<const Eigen::MatrixXd> maps = MapOf(pca, estimator);
  for (Eigen::Index i = 0; latent && i < estimator.coordinates.size(); ++i)
    s.latent.push_back(static_cast<float>(estimator.coordinates.data()[i]));
  Eigen::Index first = 0;
  for (const SubspaceOutput& output : s.outputs) {
    const auto height =
        static_cast<Eigen::Index>(output.reconstructed() * static_cast<std::size_t>(s.components));
    KPSA_CHECK_LE(first + height, maps.rows());
    inputs.left_out = pca.row_residual.segment(first, height);
    if (poses != nullptr && !latent) {
      inputs.poses = poses, inputs.measured = &training, inputs.clip_poses = clip_poses;
      inputs.first_column = static_cast<std::size_t>(first);
    }
    s.tiles.push_back(BuildTiles(maps.middleRows(first, height), pca.mean.segment(first, height),
                                 s.components, inputs, options));
    first += height;
  }
  KPSA_CHECK_EQ(first, maps.rows());
  return s;
}

double BytesOfTiles(const Pca& pca, const Estimator& estimator, const Eigen::MatrixXd& training,
                    const std::vector<SubspaceOutput>& outputs, const TileOptions& options,
                    const PoseMatrix* poses, std::size_t clip_poses, std::size_t every) {
  const auto components = static_cast<std::size_t>(pca.layout.components), height = kTilePoints * components;
  std::vector<Eigen::Index> rows;  // of whole tiles
  std::size_t first = 0, tiles = 0;
  for (const SubspaceOutput& output : outputs) {
    const std::size_t end = first + output.reconstructed() * components;
    for (std::size_t at = first; at < end; at += height, ++tiles) {
      if (tiles % every != every / 2 || at + height > end) continue;
      for (std::size_t row = at; row < at + height; ++row) rows.push_back(static_cast<Eigen::Index>(row));
    }
    first = end;
  }
  if (rows.empty()) return 0;
  TileInputs inputs = InputsOf(estimator, training);
  inputs.left_out = pca.row_residual(rows);
  PoseMatrix of_rows({.points = rows.size() / components, .components = pca.layout.components});
  if (poses != nullptr && estimator.gain.size() > 0) {
    for (std::size_t t = 0; t < poses->poses(); ++t) {
      const std::span<float> to = of_rows.AddPose();
      for (std::size_t i = 0; i < rows.size(); ++i) to[i] = poses->row(t)[static_cast<std::size_t>(rows[i])];
    }
    inputs.poses = &of_rows, inputs.measured = &training, inputs.clip_poses = clip_poses;
  }
  const TileMap some = BuildTiles(MapOf(pca, estimator)(rows, Eigen::all), pca.mean(rows),
                                  pca.layout.components, inputs, options);
  return static_cast<double>(some.bytes() * tiles * height) / static_cast<double>(rows.size());
}

ModeMatrix KeptModesOf(const Pca& pca) {
  const Eigen::MatrixXf modes = pca.output_modes().cast<float>();
  return {static_cast<std::size_t>(modes.rows()), static_cast<std::size_t>(modes.cols()),
          std::vector<float>(modes.data(), modes.data() + modes.size())};
}

}  // namespace kpsa::engine
