#include "kpsa/subspace.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "kpsa/gemm.h"

namespace kpsa {
namespace {

bool AllFinite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

// What Measure leaves of the whitened cues: entries that do not fit a float become infinite, which Judge has seen in y.
void Whiten(const Subspace& subspace, SubspaceScratch* scratch, std::size_t frame) {
  const std::size_t rows = subspace.rows();
  MultiplyVector(subspace.whitening, scratch->y, true, scratch->w);
  float* target = scratch->whitened.data() + frame * rows;
  for (std::size_t j = 0; j < rows; ++j) target[j] = static_cast<float>(scratch->w[j]);
}

}  // namespace

Status ValidateSubspace(const Subspace& s) {
  const std::size_t rows = s.rows();
  std::size_t counted = 0;
  for (std::size_t k = 0; k < s.cues.size(); ++k) {
    const CueDescription& cue = s.cues[k];
    const std::size_t height = k + 1 < s.soft_cache.offsets.size() ? s.soft_cache.offsets[k + 1] - s.soft_cache.offsets[k] : 0;
    if (height != 1 && height != 3) return Status::Invalid("cue {} has {} rows, expected 1 or 3", k, height);
    counted += height;
    if (cue.kind == CueDescription::Kind::kScalar) {
      if (cue.plug.empty() || height != 1) return Status::Invalid("cue {} is a scalar, but names no plug or has 3 rows", k);
    } else if (cue.mesh >= s.outputs.size()) {
      return Status::Invalid("cue {} lies on mesh {}, there are {}", k, cue.mesh, s.outputs.size());
    } else if (cue.point >= s.outputs[cue.mesh].points) {
      return Status::Invalid("cue {} is point {} of \"{}\", which has {}", k, cue.point, s.outputs[cue.mesh].name, s.outputs[cue.mesh].points);
    }
  }
  if (s.soft_cache.cues() != s.cues.size() || counted != rows || s.soft_cache.rows() != rows || s.cue_scale.size() != rows) {
    return Status::Invalid("the {} cues have {} rows, but {} means and {} scales", s.cues.size(), counted, rows, s.cue_scale.size());
  }
  if (s.whitening.size() != rows * rows || s.soft_cache.judge.size() != rows * rows) {
    return Status::Invalid("the matrices of the cues have {} and {} entries, expected {}", s.whitening.size(),
                           s.soft_cache.judge.size(), rows * rows);
  }
  std::size_t blocks = 0;
  for (std::size_t k = 0; k < s.cues.size() && s.mode == EstimatorMode::kMap; ++k) {
    const std::size_t height = s.soft_cache.offsets[k + 1] - s.soft_cache.offsets[k];
    blocks += height * height;
  }
  if (s.soft_cache.mode != s.mode || s.soft_cache.leave_one_out.size() != blocks) {
    return Status::Invalid("the leave-one-out blocks have {} entries, expected {}", s.soft_cache.leave_one_out.size(), blocks);
  }
  if (!AllFinite(s.cue_mean) || !AllFinite(s.cue_scale) || !AllFinite(s.whitening) || !AllFinite(s.soft_cache.judge) ||
      !AllFinite(s.soft_cache.leave_one_out)) {
    return Status::Invalid("the data of the cues hold a NaN or an infinity");
  }
  if (!(s.soft_cache.quantile1 > 0) || !(s.soft_cache.quantile2 > 0) || !std::isfinite(s.soft_cache.quantile1) ||
      !std::isfinite(s.soft_cache.quantile2)) {
    return Status::Invalid("the quantiles of the scores are {} and {}, expected positive numbers", s.soft_cache.quantile1, s.soft_cache.quantile2);
  }
  if (s.tiles.size() != s.outputs.size()) return Status::Invalid("{} outputs, but {} sets of tiles", s.outputs.size(), s.tiles.size());
  for (std::size_t i = 0; i < s.outputs.size(); ++i) {
    if (s.tiles[i].points() != s.outputs[i].points || s.tiles[i].inputs() != rows || s.tiles[i].data().components != s.components) {
      return Status::Invalid("output \"{}\" has {} points of {} components, its tiles {} of {}", s.outputs[i].name, s.outputs[i].points,
                             s.components, s.tiles[i].points(), s.tiles[i].data().components);
    }
  }
  for (const TrainedRange& range : s.ranges) {
    if (range.plug.empty() || !(range.lo <= range.hi)) {
      return Status::Invalid("the trained range of \"{}\" is [{}, {}]", range.plug, range.lo, range.hi);
    }
  }
  for (const CalibrationPair& pair : s.calibration) {
    if (!(pair.score >= 0) || !(pair.error >= 0)) return Status::Invalid("a calibration pose has score {} and error {}", pair.score, pair.error);
  }
  if (!(s.blend_start > 0 && s.blend_start <= 1) || !(s.tolerance >= 0) || !(s.violation_rate >= 0)) {
    return Status::Invalid("tolerance {}, violation rate {} or blend start {} make no sense", s.tolerance, s.violation_rate, s.blend_start);
  }
  return {};
}

Subspace MakeSubspace(const Pca& pca, const CueSet& cues, const Estimator& estimator, const Eigen::MatrixXd& training,
                      std::vector<SubspaceOutput> outputs, const TileOptions& options) {
  Subspace s;
  s.mode = estimator.mode;
  s.components = pca.layout.components;
  s.modes = static_cast<std::size_t>(pca.mode_count());
  s.outputs = std::move(outputs);
  s.cue_mean.assign(cues.mean.data(), cues.mean.data() + cues.mean.size());
  s.cue_scale.assign(cues.scale.data(), cues.scale.data() + cues.scale.size());
  s.whitening.assign(estimator.whitening.data(), estimator.whitening.data() + estimator.whitening.size());
  s.soft_cache = MakeSoftCacheModel(estimator, cues, training);

  // B W^-1: W is the inverse Cholesky factor of G, so W^-1 = G W^T
  const Eigen::MatrixXd unwhiten = Multiply(estimator.covariance, estimator.whitening.transpose());
  const Eigen::MatrixXd gain = Multiply(estimator.gain, unwhiten);
  Eigen::Index first = 0;
  for (const SubspaceOutput& output : s.outputs) {
    const auto rows = static_cast<Eigen::Index>(output.points * static_cast<std::size_t>(s.components));
    KPSA_CHECK_LE(first + rows, gain.rows());
    s.tiles.push_back(BuildTiles(gain.middleRows(first, rows), pca.mean.segment(first, rows), s.components, options));
    first += rows;
  }
  KPSA_CHECK_EQ(first, gain.rows());
  return s;
}

SubspaceScratch::SubspaceScratch(const Subspace& subspace, std::size_t frames)
    : y(subspace.rows()), g(subspace.rows()), w(subspace.rows()), whitened(frames * subspace.rows()) {
  std::size_t floats = 0;
  for (const TileMap& map : subspace.tiles) floats = std::max(floats, map.scratch_floats(frames));
  tiles = AlignedFloats(floats);
}

void Measure(const Subspace& subspace, std::span<const double> raw, SubspaceScratch* scratch, std::size_t frame) {
  KPSA_CHECK_EQ(raw.size(), subspace.rows());
  KPSA_CHECK_LE((frame + 1) * subspace.rows(), scratch->whitened.size());
  for (std::size_t j = 0; j < raw.size(); ++j) scratch->y[j] = (raw[j] - subspace.cue_mean[j]) * subspace.cue_scale[j];
  Whiten(subspace, scratch, frame);
}

Verdict Judge(const Subspace& subspace, const SoftCacheThreshold& threshold, SubspaceScratch* scratch) {
  return Judge(subspace.soft_cache, threshold, scratch->y, scratch->g);
}

void ReconstructOutput(const Subspace& subspace, std::size_t output, SubspaceScratch* scratch, PointsView points) {
  subspace.tiles[output].Reconstruct(scratch->whitened.span(), scratch->tiles.span(), points);
}

void ReconstructOutputTiles(const Subspace& subspace, std::size_t output, std::span<const Index> tiles,
                            SubspaceScratch* scratch, PointsView points) {
  subspace.tiles[output].ReconstructTiles(scratch->whitened.span(), tiles, scratch->tiles.span(), points);
}

void ReconstructOutputBlock(const Subspace& subspace, std::size_t output, std::span<const Index> tiles,
                            SubspaceScratch* scratch, std::span<const PointsView> outs) {
  subspace.tiles[output].ReconstructBlock(scratch->whitened.span(), outs, tiles, scratch->tiles.span());
}

void BlendPoints(double full_weight, ConstPointsView full, PointsView points) {
  KPSA_CHECK_EQ(full.count, points.count);
  const auto weight = static_cast<float>(full_weight);
  const float* sources[3] = {full.x, full.y, full.z};
  float* targets[3] = {points.x, points.y, points.z};
  for (int c = 0; c < 3 && targets[c] != nullptr; ++c) {
    for (std::size_t i = 0; i < points.count; ++i) targets[c][i] = targets[c][i] + weight * (sources[c][i] - targets[c][i]);
  }
}

}  // namespace kpsa
