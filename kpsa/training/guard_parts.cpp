#include "kpsa/training/guard_parts.h"

#include <algorithm>
#include <bit>
#include <map>
#include <numeric>
#include <set>

namespace kpsa::engine {
namespace {

// A guard of more than this part of the patches is of all: what moves much of a character and leaves its
// range is seldom alone, and the promise has to hold for the rest, too.
constexpr std::size_t kPart = 4;

// What a patch needs: points of stages of meshes, and values.
struct PatchNeeds {
  std::map<std::pair<std::size_t, std::size_t>, std::set<Index>> points;  // by mesh and stage
  std::set<std::size_t> signals;
};

class NeedFinder {
 public:
  NeedFinder(const TrainingRig& rig, std::span<const Signal> signals, const Subspace& subspace)
      : rig_(rig), signals_(signals), subspace_(subspace) {
    for (std::size_t s = 0; s < signals.size(); ++s) by_name_.emplace(signals[s].name, s);
  }

  // By patch.
  std::vector<PatchNeeds> Run() const {
    std::vector<PatchNeeds> needs;
    for (std::size_t m = 0; m < subspace_.outputs.size(); ++m) {
      const TileData& data = subspace_.tiles[m].data();
      const std::size_t together = subspace_.patches.tiles, tiles = subspace_.tiles[m].tiles();
      std::size_t column = 0;
      for (std::size_t t = 0; t < tiles; ++t) {
        if (t % together == 0) needs.emplace_back();
        PatchNeeds* patch = &needs.back();
        const auto [first, end] = subspace_.outputs[m].stepped.PointsOf(t, subspace_.outputs[m].points);
        std::set<Index>& own = patch->points[{m, rig_.target.meshes[m].stages.size() - 1}];
        for (Index point = first; point < end; ++point) own.insert(point);
        for (std::size_t i = 0; i < data.counts[t]; ++i) AddRow(data.columns[column++], patch);
        if (data.joints.empty() || data.joints[t] == 0) continue;
        for (std::size_t e = 0; e < 12; ++e) AddRow(data.joint_rows[12 * (data.joints[t] - 1) + e], patch);
      }
    }
    return needs;
  }

 private:
  void AddRow(Index row, PatchNeeds* patch) const {
    const std::vector<Index>& offsets = subspace_.soft_cache.offsets;
    const auto cue = static_cast<std::size_t>(std::ranges::upper_bound(offsets, row) - offsets.begin() - 1);
    AddCue(subspace_.cues[cue], patch);
  }
  void AddCue(const CueDescription& cue, PatchNeeds* patch) const {
    AddSignal(cue.joint, patch);
    AddSignal(SplitEntryName(cue.plug).signal, patch);
    for (const CueDescription::Factor& factor : cue.factors)
      AddSignal(SplitEntryName(factor.plug).signal, patch);
    if (cue.kind != CueDescription::Kind::kPoint) return;
    const auto& stages = rig_.target.meshes[cue.mesh].stages;
    const auto stage = std::ranges::find(stages, cue.stage, &AccelerationTarget::Stage::name);
    if (stage != stages.end())
      patch->points[{cue.mesh, static_cast<std::size_t>(stage - stages.begin())}].insert(cue.point);
  }
  void AddSignal(const std::string& name, PatchNeeds* patch) const {
    if (const auto found = by_name_.find(name); found != by_name_.end()) patch->signals.insert(found->second);
  }

  const TrainingRig& rig_;
  std::span<const Signal> signals_;
  const Subspace& subspace_;
  std::map<std::string, std::size_t> by_name_;
};

}  // namespace

Result<std::vector<std::uint64_t>> FindGuardedPatches(const TrainingRig& rig, Compiler* compiler,
                                                      const std::vector<TrainingClip>& clips,
                                                      std::span<const Signal> signals, std::size_t guards,
                                                      const Subspace& subspace) {
  const std::vector<PatchNeeds> needs = NeedFinder(rig, signals, subspace).Run();
  std::multimap<Index, std::size_t> by_node;  // guards
  for (std::size_t s = 0; s < guards; ++s) by_node.emplace(signals[s].plug.node.index, s);
  std::vector<std::uint64_t> patches(guards, 0);
  for (int clip = -1; clip < static_cast<int>(clips.size()); ++clip) {
    KPSA_RETURN_IF_ERROR(rig.Play(clips, clip));
    Request request;
    request.varying = rig.Varying(clip >= 0);
    for (std::size_t p = 0; p < needs.size(); ++p) {
      request.outputs.clear();
      for (const auto& [place, points] : needs[p].points) {
        request.outputs.push_back({rig.target.meshes[place.first].stages[place.second].points,
                                   PointSet::Of(std::vector<Index>(points.begin(), points.end()),
                                                static_cast<Index>(subspace.outputs[place.first].points))});
      }
      for (const std::size_t s : needs[p].signals) request.outputs.push_back({signals[s].plug, {}});
      for (const PlugRef& space : rig.target.space) request.outputs.push_back({space, {}});
      const Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*rig.graph, request);
      if (!plan.ok()) return plan.status();
      const std::uint64_t bit = std::uint64_t{1} << p;
      for (const Plan::StepInfo& info : (*plan)->infos()) {
        const auto [first, end] = by_node.equal_range(info.node.index);
        for (auto it = first; it != end; ++it) patches[it->second] |= bit;
      }
      for (const std::size_t s : needs[p].signals) {
        if (s < guards) patches[s] |= bit;
      }
    }
  }
  KPSA_RETURN_IF_ERROR(rig.set_clip(std::nullopt));
  for (std::uint64_t& of_guard : patches) {
    const auto count = static_cast<std::size_t>(std::popcount(of_guard));
    if (count == 0 || count > needs.size() / kPart) of_guard = kAllPatches;
  }
  return patches;
}

}  // namespace kpsa::engine
