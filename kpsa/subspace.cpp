#include "kpsa/subspace.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "base/check.h"

namespace kpsa::engine {
namespace {

template <typename T>
bool AllFinite(std::span<const T> values) {
  return std::all_of(values.begin(), values.end(), [](T value) { return std::isfinite(value); });
}

Status CheckProduct(const CueDescription& cue, std::size_t k, std::size_t height) {
  if (cue.factors.empty() || cue.factors.size() > 2 || height != 1)
    return Status::Invalid("cue {} is a product of {} factors with {} rows, expected 1 or 2 factors, 1 row",
                           k, cue.factors.size(), height);
  bool sound = std::isfinite(cue.lo) && std::isfinite(cue.hi) && cue.lo <= cue.hi;
  for (const CueDescription::Factor& factor : cue.factors)
    sound &= !factor.plug.empty() && std::isfinite(factor.curve.centre) && std::isfinite(factor.curve.scale);
  return sound ? Status() : Status::Invalid("cue {} is a product with a factor or a range that is none", k);
}

Status CheckPatches(const Subspace& s) {
  const PatchLayout& patches = s.patches;
  if (patches.tiles == 0 && patches.costs.empty())
    return patches.blends_only ? Status::Invalid("patches miss in blends, but there are none") : Status();
  const PatchLayout made = MakePatchLayout(s.tiles_of_outputs());
  if (patches.tiles != made.tiles || patches.regions != made.regions ||
      patches.costs.size() != made.regions.size())
    return Status::Invalid("the {} costs of patches of {} tiles are not those of {} outputs",
                           patches.costs.size(), patches.tiles, s.outputs.size());
  if (s.score.doubt == 0 || s.of_light())
    return Status::Invalid("patches miss by themselves, but the score counts no doubts");
  if (!(patches.share > 0 && patches.share <= 1))
    return Status::Invalid("patches miss from {} of the largest doubt on, expected a share", patches.share);
  for (const double cost : patches.costs) {
    if (!(cost >= 0) || !std::isfinite(cost)) return Status::Invalid("a patch costs {}", cost);
  }
  return {};
}
Status CheckPatches(const CalibrationPair& pair) {
  if (!(pair.middle >= 0) || std::isinf(pair.middle))
    return Status::Invalid("half of a calibration pose has score {}", pair.middle);
  for (const PatchPair& patch : pair.patches) {
    if (!(patch.score >= 0) || !(patch.error >= 0) || !(patch.guard >= 0 && patch.guard < 1))
      return Status::Invalid("a patch of a calibration pose has score {}, error {} and guard {}", patch.score,
                             patch.error, patch.guard);
  }
  return {};
}

}  // namespace

bool SubspaceOutput::HoldsInner(std::size_t tile) const {
  if (inner == 0 || stepped.empty()) return inner > 0;
  const SteppedPoints::Range of = stepped.PointsOf(tile, points);
  if (of.end - of.begin < std::min(kTilePoints, inner - tile * kTilePoints)) return true;
  const auto found = std::ranges::lower_bound(stepped.points, of.begin);
  return found != stepped.points.end() && *found < of.end;
}

std::string CueName(const Subspace& subspace, const CueDescription& cue) {
  if (cue.kind == CueDescription::Kind::kScalar) return cue.plug;
  if (cue.kind == CueDescription::Kind::kProduct) {
    std::string name;
    for (const CueDescription::Factor& factor : cue.factors)
      name += (name.empty() ? "" : " * ") + factor.plug;
    return name;
  }
  const SubspaceOutput& output = subspace.outputs[cue.mesh];
  const std::size_t suffix = output.stage.empty() ? 0 : output.stage.size() + 1;
  return output.name.substr(0, output.name.size() - suffix) + "@" + cue.stage;
}

Status ValidateSubspace(const Subspace& s) {
  const std::size_t rows = s.rows();
  std::size_t counted = 0;
  std::set<std::string_view> joints;
  for (const CueDescription& cue : s.cues) {
    if (!cue.joint.empty()) joints.insert(cue.joint);
  }
  if (joints.size() > kMaxCueJoints)
    return Status::Invalid("cues are measured in the spaces of {} joints, expected at most {}", joints.size(),
                           kMaxCueJoints);
  for (std::size_t k = 0; k < s.cues.size(); ++k) {
    const CueDescription& cue = s.cues[k];
    const std::size_t height =
        k + 1 < s.soft_cache.offsets.size() ? s.soft_cache.offsets[k + 1] - s.soft_cache.offsets[k] : 0;
    if (height != 1 && height != 3) return Status::Invalid("cue {} has {} rows, expected 1 or 3", k, height);
    counted += height;
    if (cue.kind == CueDescription::Kind::kScalar) {
      if (cue.plug.empty() || height != 1)
        return Status::Invalid("cue {} is a scalar, but names no plug or has 3 rows", k);
    } else if (cue.kind == CueDescription::Kind::kProduct) {
      KPSA_RETURN_IF_ERROR(CheckProduct(cue, k, height));
    } else if (height != 3) {
      return Status::Invalid("cue {} is a point, but has {} rows, expected 3", k, height);
    } else if (cue.mesh >= s.outputs.size()) {
      return Status::Invalid("cue {} lies on mesh {}, there are {}", k, cue.mesh, s.outputs.size());
    } else if (cue.point >= s.outputs[cue.mesh].points) {
      return Status::Invalid("cue {} is point {} of \"{}\", which has {}", k, cue.point,
                             s.outputs[cue.mesh].name, s.outputs[cue.mesh].points);
    }
  }
  if (s.soft_cache.cues() != s.cues.size() || counted != rows || s.soft_cache.rows() != rows ||
      s.cue_scale.size() != rows) {
    return Status::Invalid("the {} cues have {} rows, but {} means and {} scales", s.cues.size(), counted,
                           rows, s.cue_scale.size());
  }
  // Where the tiles' doubts alone are the score, SoftCache's own may be missing
  const bool has_score = s.score.measured > 0 || s.soft_cache.factor.size() > 0;
  if (s.soft_cache.mode != s.mode || s.soft_cache.modes != s.modes ||
      s.soft_cache.factor.size() != (has_score ? s.soft_cache.factor_size() : 0)) {
    return Status::Invalid("the factor of the cues has {} entries, expected {}", s.soft_cache.factor.size(),
                           s.soft_cache.factor_size());
  }
  if (s.mode == EstimatorMode::kPaper && s.modes > rows)
    return Status::Invalid("{} measured values cannot determine {} modes", rows, s.modes);
  std::size_t blocks = 0;
  for (std::size_t k = 0; k < s.cues.size() && s.mode == EstimatorMode::kMap && has_score; ++k) {
    const std::size_t height = s.soft_cache.offsets[k + 1] - s.soft_cache.offsets[k];
    blocks += height * height;
  }
  if (s.soft_cache.leave_one_out.size() != blocks) {
    return Status::Invalid("the leave-one-out blocks have {} entries, expected {}",
                           s.soft_cache.leave_one_out.size(), blocks);
  }
  if (!(s.score.measured >= 0) || !(s.score.doubt >= 0) || !(s.score.measured + s.score.doubt > 0) ||
      !std::isfinite(s.score.measured + s.score.doubt)) {
    return Status::Invalid("the score counts {} of the measurement and {} of the doubt", s.score.measured,
                           s.score.doubt);
  }
  if (s.score.doubt > 0 && (s.doubt_inputs() == 0 || !s.latent.empty()))
    return Status::Invalid("the score counts doubts, but no tile has products");
  KPSA_RETURN_IF_ERROR(CheckPatches(s));
  if (!(s.activity_limit > 0))
    return Status::Invalid("the limit of activity is {}, expected a positive number", s.activity_limit);
  if (!s.latent.empty() && (rows == 0 || s.latent.size() % rows != 0 || !AllFinite<float>(s.latent)))
    return Status::Invalid("the {} latent factors of {} rows make no sense", s.latent.size(), rows);
  if (!AllFinite<double>(s.cue_mean) || !AllFinite<double>(s.cue_scale) ||
      !AllFinite<float>(s.soft_cache.factor.span()) || !AllFinite<float>(s.soft_cache.leave_one_out)) {
    return Status::Invalid("the data of the cues hold a NaN or an infinity");
  }
  if (!(s.soft_cache.quantile1 > 0) || !(s.soft_cache.quantile2 > 0) ||
      !std::isfinite(s.soft_cache.quantile1) || !std::isfinite(s.soft_cache.quantile2)) {
    return Status::Invalid("the quantiles of the scores are {} and {}, expected positive numbers",
                           s.soft_cache.quantile1, s.soft_cache.quantile2);
  }
  if (s.tiles.size() != s.outputs.size())
    return Status::Invalid("{} outputs, but {} sets of tiles", s.outputs.size(), s.tiles.size());
  for (const SubspaceOutput& output : s.outputs) {
    if (!output.stage.empty() && !output.name.ends_with("@" + output.stage))
      return Status::Invalid("output \"{}\" is not at the stage \"{}\"", output.name, output.stage);
  }
  for (std::size_t i = 0; i < s.outputs.size(); ++i) {
    // What a patch holds comes out of its own tiles
    const bool apart = s.patches.tiles == 0 || !s.outputs[i].stepped.starts.empty();
    if (s.outputs[i].inner > 0 && (s.outputs[i].inner < s.outputs[i].points || s.components != 3 || !apart)) {
      return Status::Invalid("output \"{}\" has {} points, and {} inner ones of {} components in {} patches",
                             s.outputs[i].name, s.outputs[i].points, s.outputs[i].inner, s.components,
                             s.patches.tiles);
    }
    const SteppedPoints& stepped = s.outputs[i].stepped;
    const std::size_t tiles = (s.outputs[i].inner + kTilePoints - 1) / kTilePoints;
    if (!stepped.empty() && (s.outputs[i].inner == 0 || !stepped.Fit(s.outputs[i].points) ||
                             (!stepped.starts.empty() && stepped.starts.size() != tiles))) {
      return Status::Invalid(
          "output \"{}\": the points that a last step is of should count up and be below {}, tiles begin at "
          "multiples of "
          "{} and have no more than {} points, and there should be inner points",
          s.outputs[i].name, s.outputs[i].points, SteppedPoints::kStartsAt, kTilePoints);
    }
    if (s.tiles[i].points() != s.outputs[i].reconstructed() || s.tiles[i].inputs() != s.tile_inputs() ||
        s.tiles[i].data().components != s.components) {
      return Status::Invalid("output \"{}\" has {} points of {} components, its tiles {} of {}",
                             s.outputs[i].name, s.outputs[i].reconstructed(), s.components,
                             s.tiles[i].points(), s.tiles[i].data().components);
    }
  }
  KPSA_RETURN_IF_ERROR(CheckMends(s.mends, s.tiles));
  for (std::size_t i = 0; i < s.mends.size(); ++i) {
    const TileMend& mend = s.mends[i];
    if (s.outputs[mend.output].inner > 0 || s.of_light() || !s.latent.empty() ||
        (i > 0 && std::pair(mend.output, mend.tile) <= std::pair(s.mends[i - 1].output, s.mends[i - 1].tile)))
      return Status::Invalid("tile {} of output {} is mended twice, or out of order, or without a last step",
                             mend.tile, mend.output);
  }
  if (!s.kept_modes.values.empty()) {
    const ModeMatrix& kept = s.kept_modes;
    std::size_t points = 0;
    for (const SubspaceOutput& output : s.outputs) points += output.reconstructed();
    if (kept.rows != points * static_cast<std::size_t>(s.components) || kept.columns != s.modes ||
        kept.values.size() != kept.rows * kept.columns || !AllFinite(std::span(kept.values))) {
      return Status::Invalid("the kept modes are {} x {}, or not finite; expected {} x {}", kept.rows,
                             kept.columns, points * static_cast<std::size_t>(s.components), s.modes);
    }
  }
  for (const TrainedRange& range : s.ranges) {
    if (range.plug.empty() || !(range.lo <= range.hi) || !(range.ramp >= 0) || !std::isfinite(range.rest) ||
        !(range.reach >= 0)) {
      return Status::Invalid("the trained range of \"{}\" is [{}, {}], with a ramp of {}", range.plug,
                             range.lo, range.hi, range.ramp);
    }
    if (range.patches != kAllPatches && range.patches >> std::min(s.patches.patches, kMaxPatches) != 0)
      return Status::Invalid("the trained range of \"{}\" speaks of patches that there are not", range.plug);
  }
  for (const CalibrationPair& pair : s.calibration) {
    KPSA_RETURN_IF_ERROR(CheckPatches(pair));
    if (!(pair.score >= 0) || !(pair.error >= 0) || !(pair.guard >= 0 && pair.guard <= 1) || pair.kind < 0)
      return Status::Invalid("a calibration pose of kind {} has score {}, error {} and guard {}", pair.kind,
                             pair.score, pair.error, pair.guard);
  }
  if (!(s.extent >= 0)) return Status::Invalid("the extent of the points is {}", s.extent);
  for (const double entry : s.inverse_rest_stretch.m) {
    if (!std::isfinite(entry)) return Status::Invalid("the stretch of the space is not finite");
  }
  if (!(s.blend_start > 0 && s.blend_start <= 1) || !(s.tolerance >= 0) || !(s.violation_rate >= 0)) {
    return Status::Invalid("tolerance {}, violation rate {} or blend start {} make no sense", s.tolerance,
                           s.violation_rate, s.blend_start);
  }
  return {};
}

SubspaceScratch::SubspaceScratch(const Subspace& subspace)
    : y(subspace.soft_cache.padded_rows()),
      g(subspace.soft_cache.padded_rows()),
      t(subspace.doubt_inputs()),
      z(subspace.latent.empty() ? 0 : subspace.tile_inputs()) {}

void ToLatent(const Subspace& subspace, std::span<const float> y, std::span<float> z) {
  const std::size_t modes = subspace.tile_inputs();
  const float* q = subspace.latent.data();
  for (std::size_t i = 0; i < modes; ++i) z[i] = 0;
  for (std::size_t j = 0; j < subspace.rows(); ++j, q += modes) {
    for (std::size_t i = 0; i < modes; ++i) z[i] = z[i] + q[i] * y[j];
  }
}

void Normalize(const Subspace& subspace, std::span<const double> raw, std::span<float> y) {
  for (std::size_t j = 0; j < raw.size(); ++j)
    y[j] = static_cast<float>((raw[j] - subspace.cue_mean[j]) * subspace.cue_scale[j]);
}

void Measure(const Subspace& subspace, std::span<const double> raw, SubspaceScratch* scratch) {
  KPSA_CHECK_EQ(raw.size(), subspace.rows());
  Normalize(subspace, raw, scratch->y.span());
  if (scratch->z.size() > 0) ToLatent(subspace, scratch->y.span(), scratch->z.span());
}

std::size_t Subspace::doubt_inputs() const {
  std::size_t all = 0;
  bool products = false;
  for (const TileMap& map : tiles) all += map.input_size(), products = products || map.has_products();
  return products ? all : 0;
}

bool Subspace::of_inner() const {
  return std::ranges::any_of(outputs, [](const SubspaceOutput& output) { return output.inner > 0; });
}

std::size_t Subspace::tile_count() const {
  std::size_t all = 0;
  for (const TileMap& map : tiles) all += map.tiles();
  return all;
}
std::vector<std::size_t> Subspace::tiles_of_outputs() const {
  std::vector<std::size_t> counts;
  for (const TileMap& map : tiles) counts.push_back(map.tiles());
  return counts;
}

Doubt LargestDoubt(const Subspace& subspace, std::span<const float> y, std::span<float> inputs,
                   std::span<float> doubts) {
  Doubt doubt;
  Index first = 0;
  for (const TileMap& tiles : subspace.tiles) {
    const Doubt of = tiles.ComputeInputs(y, inputs.first(tiles.input_size()),
                                         doubts.empty() ? doubts : doubts.subspan(first, tiles.tiles()));
    inputs = inputs.subspan(tiles.input_size());
    if (of.largest > doubt.largest) doubt = {of.largest, first + of.tile};
    first += static_cast<Index>(tiles.tiles());
  }
  return doubt;
}

void LargestOfPatches(const Subspace& subspace, std::span<const float> of_tiles, std::span<double> patches) {
  std::size_t tile = 0, patch = 0;
  for (const TileMap& tiles : subspace.tiles) {
    for (std::size_t t = 0; t < tiles.tiles(); t += subspace.patches.tiles, ++patch) {
      float largest = 0;
      for (std::size_t i = t; i < std::min(t + subspace.patches.tiles, tiles.tiles()); ++i)
        largest = std::max(largest, of_tiles[tile++]);
      patches[patch] = static_cast<double>(largest);
    }
  }
}

Verdict JudgePatches(const Subspace& subspace, const SoftCacheThreshold& threshold, std::span<const float> y,
                     std::span<float> g, std::span<float> inputs, std::span<float> doubts,
                     std::span<double> scores) {
  const ScoreMix& mix = subspace.score;
  std::fill(scores.begin(), scores.end(), 0.0);
  if (mix.doubt == 0) return Judge(subspace.soft_cache, threshold, y, g, mix.measured);
  // The doubt is a number whatever y is: SoftCache looks at that
  Verdict verdict = mix.measured > 0 ? Judge(subspace.soft_cache, threshold, y, g, mix.measured)
                                     : JudgeFinite(subspace.soft_cache, y);
  if (verdict.reason == MissReason::kNotFinite) return verdict;
  const double measured = verdict.score;
  const Doubt doubt = LargestDoubt(subspace, y, inputs, doubts);
  if (!scores.empty()) LargestOfPatches(subspace, doubts, scores);
  const double score = mix.doubt * static_cast<double>(doubt.largest);
  for (double& patch : scores)
    patch = subspace.patches.blends_only
                ? PatchScoreInBlend(mix.doubt * patch, std::max(measured, score), threshold)
                : std::max(measured, mix.doubt * PatchDoubt(subspace.patches, patch,
                                                            static_cast<double>(doubt.largest)));
  if (mix.measured > 0 && !(score > measured)) return verdict;
  verdict.score = score;
  verdict.full_weight = FullWeight(score, threshold);
  verdict.hit = verdict.full_weight == 0;
  if (!verdict.hit) {
    verdict.reason = threshold.tau > 0 ? MissReason::kDoubt : MissReason::kNeverHit;
    verdict.offender = doubt.tile;
  }
  return verdict;
}
Verdict Judge(const Subspace& subspace, const SoftCacheThreshold& threshold, std::span<const float> y,
              std::span<float> g, std::span<float> inputs) {
  return JudgePatches(subspace, threshold, y, g, inputs, {}, {});
}
Verdict Judge(const Subspace& subspace, const SoftCacheThreshold& threshold, SubspaceScratch* scratch) {
  return Judge(subspace, threshold, scratch->y.span(), scratch->g.span(), scratch->t.span());
}

void BlendPoints(double full_weight, ConstPointsView full, PointsView points) {
  KPSA_CHECK_EQ(full.count, points.count);
  const auto weight = static_cast<float>(full_weight);
  const float* sources[3] = {full.x, full.y, full.z};
  float* targets[3] = {points.x, points.y, points.z};
  for (int c = 0; c < 3 && targets[c] != nullptr; ++c) {
    for (std::size_t i = 0; i < points.count; ++i)
      targets[c][i] = targets[c][i] + weight * (sources[c][i] - targets[c][i]);
  }
}

}  // namespace kpsa::engine
