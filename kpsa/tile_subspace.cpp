#include "kpsa/tile_subspace.h"

#include <algorithm>
#include <map>

#include "base/check.h"
#include "kpsa/cue_values.h"

namespace kpsa {
namespace {

// The cues of some rows of a set.
CueSet Subset(const CueSet& set, const std::vector<std::size_t>& kept) {
  CueSet subset;
  std::vector<Eigen::Index> rows;
  subset.offsets.push_back(0);
  for (const std::size_t k : kept) {
    subset.cues.push_back(set.cues[k]);
    for (Index j = set.offsets[k]; j < set.offsets[k + 1]; ++j) rows.push_back(j);
    subset.offsets.push_back(static_cast<Index>(rows.size()));
  }
  subset.mean = set.mean(rows), subset.scale = set.scale(rows);
  return subset;
}

// Leaves out what no tile reads.
void DropUnread(TileSubspace* made) {
  std::vector<char> read(static_cast<std::size_t>(made->cues.rows()), 0);
  for (const TileMap& map : made->subspace.tiles) {
    for (const auto* columns : {&map.data().columns, &map.data().joint_rows}) {
      for (const std::uint32_t column : *columns) read[column] = 1;
    }
  }
  std::vector<std::size_t> kept;
  std::vector<std::uint32_t> now(read.size(), 0);
  std::uint32_t rows = 0;
  for (std::size_t k = 0; k < made->cues.cues.size(); ++k) {
    const Index begin = made->cues.offsets[k], end = made->cues.offsets[k + 1];
    if (std::none_of(read.begin() + begin, read.begin() + end, [](char r) { return r != 0; })) continue;
    kept.push_back(k);
    for (Index j = begin; j < end; ++j) now[j] = rows++;
  }
  for (TileMap& map : made->subspace.tiles) {
    TileData data = map.data();
    data.inputs = rows;
    for (auto* columns : {&data.columns, &data.joint_rows}) {
      for (std::uint32_t& column : *columns) column = now[column];
    }
    Result<TileMap> fewer = TileMap::Make(std::move(data), "tiles");
    KPSA_CHECK(fewer.ok());
    map = std::move(*fewer);
  }
  made->cues = Subset(made->cues, kept);
}

}  // namespace

TileSubspace MakeTileSubspace(const Eigen::VectorXd& mean, const PoseMatrix& poses, std::size_t clip_poses,
                              std::span<const TileCandidates> candidates, const TileCueOptions& cue_options,
                              std::vector<SubspaceOutput> outputs, const TileOptions& options) {
  TileSubspace made;
  Subspace& s = made.subspace;
  s.outputs = std::move(outputs);
  s.components = poses.layout().components;
  const TileCues chosen = ChooseTileCues(poses, candidates, cue_options);
  Eigen::MatrixXd measured;
  made.cues = MeasureCues(poses, mean, chosen.cues, &measured);
  const CueSet& cues = made.cues;

  TileInputs inputs;
  inputs.samples = SampledColumns(measured);
  inputs.poses = &poses, inputs.measured = &measured, inputs.clip_poses = clip_poses;
  inputs.row_mean = cues.mean, inputs.row_scale = cues.scale;
  std::map<Index, std::uint32_t> row_of;  // of scalars
  for (std::size_t k = 0; k < cues.cues.size(); ++k) {
    if (cues.cues[k].kind == CueKind::kScalar && cues.cues[k].joint == kNoIndex)
      row_of.emplace(cues.cues[k].index, cues.offsets[k]);
  }
  std::size_t tile = 0, first = 0;
  for (const SubspaceOutput& output : s.outputs) {
    const auto model = [&](std::size_t t) {
      std::vector<std::uint32_t> columns;
      for (const std::uint32_t cue : chosen.of_tile[tile + t]) {
        for (Index j = cues.offsets[cue]; j < cues.offsets[cue + 1]; ++j) columns.push_back(j);
      }
      const Index joint = chosen.joint[tile + t];
      TileModel fitted =
          FitTile(poses, measured, cues, cue_options, candidates[tile + t], joint, std::move(columns));
      for (Index e = 0; e < 12 && joint != kNoIndex; ++e) fitted.joint_rows.push_back(row_of.at(joint + e));
      return fitted;
    };
    const std::size_t height = output.points * static_cast<std::size_t>(s.components);
    inputs.first_column = first;
    s.tiles.push_back(
        BuildTiles(model, mean.segment(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(height)),
                   s.components, static_cast<std::size_t>(cues.rows()), inputs, options));
    tile += s.tiles.back().tiles();
    first += height;
  }
  KPSA_CHECK_EQ(tile, candidates.size());
  DropUnread(&made);
  s.cue_mean.assign(cues.mean.data(), cues.mean.data() + cues.mean.size());
  s.cue_scale.assign(cues.scale.data(), cues.scale.data() + cues.scale.size());
  s.soft_cache.offsets = cues.offsets;
  s.score = {0, 1};
  return made;
}

}  // namespace kpsa
