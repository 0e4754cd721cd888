#include "host/acceleration.h"

#include <algorithm>
#include <filesystem>
#include <limits>

#include "host/mesh_stage.h"
#include "host/rig_training.h"
#include "kpsa/accelerate.h"

namespace kpsa::engine {
namespace {

std::vector<std::string> PointNames(const Subspace& subspace) {
  std::vector<std::string> names;
  for (const SubspaceOutput& output : subspace.outputs) names.push_back(output.name);
  return names;
}

// An entry for a rig that has none: what the subspace says of itself.
Result<AccelerateEntry> EntryOf(const Rig& rig, const Subspace& subspace, const std::string& path) {
  AccelerateEntry entry;
  entry.name = std::filesystem::path(path).stem().string();
  for (const SubspaceOutput& output : subspace.outputs) {
    if (const Result<PlugRef> plug = rig.graph->FindPlug(output.name);
        plug.ok() && rig.graph->PlugType(*plug) == Type::kColors) {
      entry.points.push_back({0, 0, *plug, true});
      continue;
    }
    const Result<MeshStage> found = FindMeshStage(rig, output.name);
    if (!found.ok())
      return Status::Invalid("the subspace is for {}; {}", output.name,
                             found.status().errors().front().message)
          .At({path});
    AcceleratedPoints points;
    points.mesh = static_cast<std::size_t>(found->mesh - rig.scene.meshes.data());
    points.points = found->points;
    const std::vector<Stage>& stages = found->mesh->stages;
    while (points.stage < stages.size() && !(stages[points.stage].points == found->points)) ++points.stage;
    if (points.stage == stages.size())
      return Status::Invalid("the subspace is for {}, which is no stage of this rig", output.name).At({path});
    entry.points.push_back(points);
  }
  if (!subspace.space.empty()) {
    const Result<NodeId> space = rig.graph->FindNode(subspace.space);
    if (!space.ok()) return Status(space.status()).At({path});
    entry.space = *space;
  }
  return entry;
}

// `rig`: the path of the one that is trained for it.
Result<std::shared_ptr<const Subspace>> LoadSubspace(const std::string& rig, const std::string& path,
                                                     const AccelerationChoice& choice) {
  const auto known = std::ranges::find(choice.loaded, path, [](const auto& one) { return one.first; });
  if (known != choice.loaded.end() && !choice.with_modes) return known->second;
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return Status::Invalid("no such file; kpsa train {} writes it", rig).At({path});
  Result<Subspace> subspace = ReadSubspace(path, choice.with_modes ? KeptModes::kRead : KeptModes::kSkip);
  if (!subspace.ok()) return subspace.status();
  return std::make_shared<const Subspace>(std::move(*subspace));
}

// "; OPTION names a subspace"
std::string OtherWay(const AccelerationChoice& choice, const char* what) {
  return choice.subspace_option.empty() ? "" : fmt::format("; {} names {}", choice.subspace_option, what);
}

}  // namespace

std::vector<std::string> PointNames(const Rig& rig, const AccelerateEntry& entry) {
  std::vector<std::string> names;
  for (const AccelerationTarget::MeshPoints& points : MakeTarget(rig, entry).meshes)
    names.push_back(points.name);
  return names;
}

Result<std::vector<AppliedSubspace>> ApplyAcceleration(Rig* rig, Compiler* compiler,
                                                       const AccelerationChoice& choice) {
  std::vector<AppliedSubspace> applied;
  if (!choice.subspace.empty()) {
    const auto subspace = LoadSubspace(rig->path, choice.subspace, choice);
    if (!subspace.ok()) return subspace.status();
    AppliedSubspace one;
    one.subspace = *subspace;
    one.path = choice.subspace;
    const auto found = std::find_if(
        rig->accelerate.begin(), rig->accelerate.end(),
        [&](const AccelerateEntry& entry) { return PointNames(*rig, entry) == PointNames(**subspace); });
    if (found != rig->accelerate.end()) {
      one.entry = *found;
    } else {
      Result<AccelerateEntry> entry = EntryOf(*rig, **subspace, choice.subspace);
      if (!entry.ok()) return entry.status();
      one.entry = std::move(*entry);
    }
    applied.push_back(std::move(one));
  } else {
    if (rig->accelerate.empty())
      return Status::Invalid("has no accelerate section, so nothing to accelerate{}",
                             OtherWay(choice, "a subspace"))
          .At({rig->path});
    for (const AccelerateEntry& entry : rig->accelerate) {
      if (entry.subspace.empty())
        return Status::Invalid("accelerate: \"{}\" names no subspace file{}", entry.name,
                               OtherWay(choice, "one"))
            .At(entry.where);
      const auto subspace = LoadSubspace(
          entry.reference < 0 ? rig->path : rig->references[static_cast<std::size_t>(entry.reference)].file,
          entry.subspace, choice);
      if (!subspace.ok()) return subspace.status();
      AppliedSubspace one;
      one.path = entry.subspace;
      one.entry = entry;
      one.subspace = *subspace;
      applied.push_back(std::move(one));
    }
  }
  Accelerator accelerator(rig->graph.get(), compiler);
  for (AppliedSubspace& one : applied) {
    one.name = one.entry.name;
    AccelerateOptions options;
    options.stale_is_miss = choice.stale_is_miss;
    options.stale_option = choice.stale_option;
    if (choice.tolerance.has_value()) options.tolerance = *choice.tolerance;
    if (choice.violation_rate.has_value()) options.violation_rate = *choice.violation_rate;
    one.tolerance = options.tolerance < 0 ? one.subspace->tolerance : options.tolerance;
    if (choice.every_frame) options.tolerance = kAnyError;
    one.violation_rate = options.violation_rate < 0 ? one.subspace->violation_rate : options.violation_rate;
    KPSA_RETURN_IF_ERROR(accelerator
                             .Add(MakeTarget(*rig, one.entry), one.subspace,
                                  rig->graph->FreeNodeName(one.name + "_kpsa"), options)
                             .At({one.path}));
  }
  Result<std::vector<Accelerated>> accelerated = accelerator.Apply();
  if (!accelerated.ok()) return Status(accelerated.status()).At({rig->path});
  for (std::size_t e = 0; e < applied.size(); ++e) {
    AppliedSubspace& one = applied[e];
    one.node = (*accelerated)[e].node;
    one.config = (*accelerated)[e].config;
    one.notes = std::move((*accelerated)[e].notes);
    const NodeDef& def = rig->graph->def(one.node);
    for (std::size_t p = 0; p < one.entry.points.size(); ++p) {
      if (one.entry.points[p].colors) continue;
      CharacterMesh& mesh = rig->scene.meshes[one.entry.points[p].mesh];
      if (mesh.points == mesh.stages[one.entry.points[p].stage].points) {
        mesh.points = {one.node, def.FindAttribute("outPoints"), static_cast<int>(p), -1};
      }
    }
  }
  return applied;
}

void ReadColorsFrom(const std::vector<AppliedSubspace>& applied, const Graph& graph, Request* request) {
  for (const AppliedSubspace& one : applied) {
    for (std::size_t p = 0; p < one.entry.points.size(); ++p) {
      if (!one.entry.points[p].colors) continue;
      for (RequestedOutput& output : request->outputs) {
        if (output.plug == one.entry.points[p].points) output.plug = one.Output(graph, p);
      }
    }
  }
}

Calibration CalibrationInForce(const AppliedSubspace& applied) {
  const Subspace& s = *applied.subspace;
  const double tolerance =
      applied.tolerance >= kAnyError ? std::numeric_limits<double>::infinity() : applied.tolerance;
  return Calibrate(s.calibration, tolerance, applied.violation_rate, s.blend_start);
}

}  // namespace kpsa::engine
