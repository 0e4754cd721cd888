#include "kpsa/training/tile_candidates.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "kpsa/training/mode_choice.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostPlans = 2500;  // of all tiles; neighbours share one where there are more tiles

constexpr std::size_t kOwnPoints = 40, kNearPoints = 24;  // candidates in a tile, and about it
constexpr std::size_t kNearProbes = 12;                   // points of a tile that say what is near

// For each tile of each mesh, in their order: which of the signals are relative matrices of transforms that
// its points need, as indices, ascending.
Result<std::vector<std::vector<Index>>> FindTileMovers(const TrainingRig& rig, Compiler* compiler,
                                                       const std::vector<TrainingClip>& clips,
                                                       std::span<const Index> totals,
                                                       std::span<const Signal> signals) {
  std::map<Index, Index> matrices;  // node -> signal
  for (std::size_t s = 0; s < signals.size(); ++s) {
    if (signals[s].relative) matrices.emplace(signals[s].plug.node.index, static_cast<Index>(s));
  }
  std::size_t tiles = 0;
  for (std::size_t m = 0; m < totals.size(); ++m)
    tiles += (rig.rows(m, totals[m]) + kTilePoints - 1) / kTilePoints;
  const std::size_t together = (tiles * (clips.size() + 1) + kMostPlans - 1) / kMostPlans;
  std::vector<std::set<Index>> movers(tiles);
  std::vector<char> moves(signals.size(), 0);
  for (int clip = -1; clip < static_cast<int>(clips.size()); ++clip) {
    KPSA_RETURN_IF_ERROR(rig.Play(clips, clip));
    std::size_t first_tile = 0;
    for (std::size_t m = 0; m < totals.size(); ++m) {
      const std::size_t rows = rig.rows(m, totals[m]), count = (rows + kTilePoints - 1) / kTilePoints;
      for (std::size_t t = 0; t < count; t += together) {
        const std::size_t first = t * kTilePoints;
        std::vector<Index> points(std::min(together * kTilePoints, rows - first));
        std::iota(points.begin(), points.end(), static_cast<Index>(first));
        const LastStep* const step = rig.step(m);
        for (Index& point : points) point = step == nullptr ? rig.PointOf(m, point) : step->PointOf(point);
        Request request;
        request.outputs.push_back(
            {rig.target.meshes[m].stages.back().points, PointSet::Of(points, totals[m])});
        request.varying = rig.Varying(clip >= 0);
        const Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
        if (!plan.ok()) return plan.status();
        for (const Plan::StepInfo& info : (*plan)->infos()) {
          const auto found = matrices.find(info.node.index);
          if (found == matrices.end()) continue;
          moves[static_cast<std::size_t>(found->second)] = 1;
          for (std::size_t i = t; i < std::min(t + together, count); ++i)
            movers[first_tile + i].insert(found->second);
        }
      }
      first_tile += count;
    }
  }
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  for (const auto& [node, signal] : matrices) {  // what stands still in the world moves in the space
    for (std::set<Index>& of_tile : movers) {
      if (!moves[static_cast<std::size_t>(signal)]) of_tile.insert(signal);
    }
  }
  std::vector<std::vector<Index>> result;
  for (const std::set<Index>& of_tile : movers) result.emplace_back(of_tile.begin(), of_tile.end());
  return result;
}

struct NearPoint {
  CueRef cue;
  Index point = 0;  // of the mesh, or the row before it among those that are trained on
  Double3 at;
};

// The candidates of each mesh, by point.
std::vector<std::vector<NearPoint>> ByMesh(const TrainingRig& rig, const TileCandidateOptions& options) {
  std::vector<std::vector<NearPoint>> result(options.totals.size());
  for (const CueRef& cue : options.points) {
    Index rest = cue.index;
    if (cue.kind == CueKind::kOutput) {
      std::size_t mesh = 0;
      for (; rest >= rig.rows(mesh, options.totals[mesh]); ++mesh)
        rest -= rig.rows(mesh, options.totals[mesh]);
      result[mesh].push_back({cue, rest, options.positions[cue.index]});
      continue;
    }
    std::size_t stage = 0;
    while (rest >= options.stages[stage].points.size())
      rest -= static_cast<Index>(options.stages[stage++].points.size());
    result[options.stages[stage].mesh].push_back({cue, options.stages[stage].points[rest] / rig.every,
                                                  options.positions[options.layout.points + cue.index]});
  }
  for (auto& points : result) std::ranges::sort(points, {}, &NearPoint::point);
  return result;
}

// rows: whose point each row of the tile is.
void AddPoints(const std::vector<NearPoint>& points, std::span<const Double3> positions,
               std::vector<Index> rows, std::size_t most_own, TileCandidates* tile) {
  const std::size_t count = rows.size();
  std::ranges::sort(rows);
  std::vector<const NearPoint*> own, other;
  for (const NearPoint& point : points)
    (std::ranges::binary_search(rows, point.point) ? own : other).push_back(&point);
  for (const Index i : EvenSpread(own.size(), std::min(own.size(), most_own)))
    tile->points.push_back(own[i]->cue);
  tile->own_points = tile->points.size();
  std::vector<std::pair<double, const NearPoint*>> distances;
  for (const NearPoint* point : other) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Index i : EvenSpread(count, std::min<std::size_t>(count, kNearProbes))) {
      const Double3 d = positions[i] - point->at;
      nearest = std::min(nearest, Dot(d, d));
    }
    distances.emplace_back(nearest, point);
  }
  const std::size_t near = std::min(distances.size(), kNearPoints);
  std::partial_sort(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(near), distances.end(),
                    [](const auto& a, const auto& b) {
                      return std::pair(a.first, a.second->point) < std::pair(b.first, b.second->point);
                    });
  for (std::size_t i = 0; i < near; ++i) tile->points.push_back(distances[i].second->cue);
}

}  // namespace

Result<std::vector<TileCandidates>> FindTileCandidates(const TrainingRig& rig, Compiler* compiler,
                                                       const std::vector<TrainingClip>& clips,
                                                       const TileCandidateOptions& options) {
  const Result<std::vector<std::vector<Index>>> movers =
      FindTileMovers(rig, compiler, clips, options.totals, options.signals);
  if (!movers.ok()) return movers.status();
  const std::vector<Index> first_entry = FirstScalars(options.signals, options.layout);
  const std::vector<std::vector<NearPoint>> points = ByMesh(rig, options);
  std::vector<TileCandidates> tiles;
  Index mesh_begin = 0;
  for (std::size_t m = 0; m < options.totals.size(); ++m) {
    const Index rows = rig.rows(m, options.totals[m]);
    for (Index first = 0; first < rows; first += kTilePoints) {
      const Index count = std::min<Index>(kTilePoints, rows - first);
      TileCandidates& tile = tiles.emplace_back();
      tile.first_column = 3 * static_cast<std::size_t>(mesh_begin + first);
      tile.height = 3 * static_cast<std::size_t>(count);
      for (const Index signal : (*movers)[tiles.size() - 1]) {
        tile.joints.push_back(first_entry[signal]);
      }
      std::vector<Index> of_rows(count);
      std::iota(of_rows.begin(), of_rows.end(), first);
      const LastStep* const step = rig.step(m);
      for (Index& row : of_rows) row = step == nullptr ? row : step->PointOf(row);
      AddPoints(points[m], options.positions.subspan(mesh_begin + first, count), std::move(of_rows),
                rig.stepped.empty() ? kOwnPoints : kTilePoints, &tile);
    }
    mesh_begin += rows;
  }
  return tiles;
}

}  // namespace kpsa::engine
