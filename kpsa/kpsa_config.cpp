#include "kpsa/kpsa_node.h"

namespace kpsa::engine {

KpsaConfig::KpsaConfig(Data data) : data_(std::move(data)) {
  Hasher hasher;
  const Subspace& s = *data_.subspace;
  hasher.Add(std::string_view(s.rig_hash));
  hasher.Add(std::string_view(s.training));
  hasher.AddLong(std::span<const double>(s.cue_mean));
  hasher.AddLong(std::span<const float>(s.soft_cache.factor.span()));
  hasher.AddLong(std::span<const float>(s.latent));
  for (const TileMap& tiles : s.tiles) hasher.Add(tiles.digest());
  for (const SubspaceOutput& output : s.outputs) {
    hasher.Add(output.inner);
    hasher.AddLong(std::span<const Index>(output.stepped.points));
    hasher.AddLong(std::span<const Index>(output.stepped.starts));
  }
  for (const TileMend& mend : s.mends) {
    hasher.Add(mend.output);
    hasher.Add(mend.tile);
    hasher.AddLong(std::span<const Index>(mend.points));
    hasher.AddLong(std::span<const float>(mend.mean));
    hasher.AddLong(std::span<const float>(mend.map));
  }
  for (const PointCues& cues : data_.cues) {
    hasher.AddLong(std::span<const Index>(cues.points));
    hasher.Add(cues.in_space);
    hasher.Add(cues.near);
  }
  for (const Row& row : data_.rows) {
    hasher.Add(row.kind);
    hasher.Add(row.input);
    hasher.Add(row.element);
    hasher.Add(row.joint);
  }
  for (const Product& product : data_.products) {
    for (const Row* row : {&product.a, &product.b}) {
      hasher.Add(row->kind);
      hasher.Add(row->input);
      hasher.Add(row->element);
    }
    for (const ProductCurve* curve : {&product.of_a, &product.of_b}) {
      hasher.Add(curve->centre);
      hasher.Add(curve->scale);
      hasher.Add(curve->hinge);
    }
    hasher.Add(product.lo);
    hasher.Add(product.hi);
  }
  hasher.AddLong(std::span<const Index>(data_.joints));
  hasher.Add(s.activity_limit);
  for (const auto* range : {&data_.matrix_lo, &data_.matrix_hi, &data_.matrix_ramp, &data_.scalar_lo,
                            &data_.scalar_hi, &data_.scalar_ramp, &data_.matrix_rest, &data_.matrix_per_reach,
                            &data_.scalar_rest, &data_.scalar_per_reach})
    hasher.AddLong(std::span<const double>(*range));
  for (const auto* patches : {&data_.matrix_patches, &data_.scalar_patches})
    hasher.AddLong(std::span<const std::uint64_t>(*patches));
  std::size_t numbers = 0;
  for (const CalibrationPair& pair : s.calibration) numbers += 6 + 3 * pair.patches.size();
  std::vector<double> calibration;
  calibration.reserve(numbers);
  for (const CalibrationPair& pair : s.calibration) {
    for (const double number : {pair.score, pair.error, pair.guard, pair.middle,
                                static_cast<double>(pair.kind), static_cast<double>(pair.patches.size())})
      calibration.push_back(number);
    for (const PatchPair& patch : pair.patches) {
      for (const double number : {patch.score, patch.error, patch.guard}) calibration.push_back(number);
    }
  }
  hasher.AddLong(std::span<const double>(calibration));
  hasher.Add(s.patches.tiles);
  hasher.Add(s.patches.share);
  hasher.Add(s.patches.blends_only);
  hasher.AddLong(std::span<const double>(s.patches.costs));
  for (const PatchPoints& patch : data_.patches) {
    hasher.Add(patch.output);
    hasher.AddLong(std::span<const Index>(patch.points));
    hasher.AddLong(std::span<const float>(patch.weights));
  }
  hasher.AddLong(std::span<const double>(s.inverse_rest_stretch.m));
  hasher.Add(s.extent);
  hasher.Add(s.score.measured);
  hasher.Add(s.score.doubt);
  for (const double place : {data_.rest_origin.x, data_.rest_origin.y, data_.rest_origin.z})
    hasher.Add(place);
  hasher.Add(data_.has_space);
  hasher.Add(data_.space_scales);
  hasher.AddLong(std::span<const char>(data_.outputs_in_space));
  hasher.AddLong(std::span<const char>(data_.relative));
  hasher.Add(data_.always_miss);
  hasher.Add(std::string_view(data_.always_miss_reason));
  digest_ = hasher.Finish();
}

std::string MissText(const KpsaConfig& config, MissReason reason, Index offender) {
  const KpsaConfig::Data& data = config.data();
  switch (reason) {
    case MissReason::kNone:
      return "hit";
    case MissReason::kNeverHit:
      return data.always_miss ? data.always_miss_reason : "the tolerance allows no hit";
    case MissReason::kOutOfRange:
      return fmt::format("{} is outside its trained range",
                         offender < data.guard_names.size() ? data.guard_names[offender] : "a control");
    case MissReason::kDoubt: {
      Index tile = offender;
      for (std::size_t m = 0; m < data.subspace->tiles.size(); ++m) {
        const auto tiles = static_cast<Index>(data.subspace->tiles[m].tiles());
        if (tile < tiles)
          return fmt::format(
              "bent farther than the trained poses (most at {}, points from {} on)",
              data.subspace->outputs[m].name,
              data.subspace->outputs[m].stepped.PointsOf(tile, data.subspace->outputs[m].points).begin);
        tile -= tiles;
      }
      return "bent farther than the trained poses";
    }
    case MissReason::kManyAtOnce:
      return "more is far from rest at once than in poses that frames are like";
    case MissReason::kSpace:
      return fmt::format("{} is stretched, mirrored or scaled as it was not in training", data.stretched);
    case MissReason::kNotFinite:
    case MissReason::kScore: {
      std::string cue = "a cue";
      if (offender < data.subspace->cues.size()) {
        const CueDescription& d = data.subspace->cues[offender];
        cue = CueName(*data.subspace, d);
        if (d.kind == CueDescription::Kind::kPoint) cue += fmt::format(" point {}", d.point);
      }
      return reason == MissReason::kScore
                 ? fmt::format("unlike the trained poses (most at {})", cue)
                 : fmt::format("{} is not a number, or far beyond anything that training had", cue);
    }
  }
  return "";
}

}  // namespace kpsa::engine
