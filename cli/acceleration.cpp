#include "cli/acceleration.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/frames_range.h"
#include "cli/options.h"
#include "cli/request.h"
#include "cli/rig_training.h"
#include "io/quantity.h"
#include "kpsa/accelerate.h"

namespace kpsa {
namespace {

std::vector<std::string> PointNames(const Subspace& subspace) {
  std::vector<std::string> names;
  for (const SubspaceOutput& output : subspace.outputs) names.push_back(output.name);
  return names;
}

// An entry for a rig that has none: what the subspace says of itself.
Result<Acceleration> EntryOf(const Rig& rig, const Subspace& subspace, const std::string& path) {
  Acceleration entry;
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
    while (!(found->mesh->stages[points.stage].points == found->points)) ++points.stage;
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
                                                     bool with_modes) {
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return Status::Invalid("no such file; kpsa train {} writes it", rig).At({path});
  Result<Subspace> subspace = ReadSubspace(path, with_modes ? KeptModes::kRead : KeptModes::kSkip);
  if (!subspace.ok()) return subspace.status();
  return std::make_shared<const Subspace>(std::move(*subspace));
}

}  // namespace

std::vector<std::string> PointNames(const Rig& rig, const Acceleration& entry) {
  std::vector<std::string> names;
  for (const AccelerationTarget::MeshPoints& points : MakeTarget(rig, entry).meshes)
    names.push_back(points.name);
  return names;
}

void AddAccelerationFlags(CLI::App* command, AccelerationFlags* flags) {
  AddSwitch(command, "--accelerate", &flags->accelerate, "with the rig's own subspaces");
  AddOption(command, "--kpsa", "FILE.kpsa", &flags->kpsa, "with this subspace");
  AddOption(command, "--tolerance", "LENGTH", &flags->tolerance,
            "the largest error of a point, as in 0.2mm; any: accept every frame; the subspace's own if not "
            "given");
  AddSharedAccelerationFlags(command, flags);
}

void AddSharedAccelerationFlags(CLI::App* command, AccelerationFlags* flags) {
  AddOption(command, "--stale", "refuse|miss", &flags->stale,
            "a subspace that was trained on another version of the rig: refuse it (if not given), or miss: "
            "evaluate everything fully");
  AddOption(command, "--violation-rate", "SHARE", &flags->violation_rate,
            "share of frames that may exceed it, as in 1%; the subspace's own if not given");
}

Result<double> ParseLength(const std::string& what, const std::string& text) {
  const Result<double> value = ParseQuantity(text, Unit::kLength, FileUnits());
  if (!value.ok() || *value < 0)
    return Status::Usage("{} \"{}\": expected a length of 0 or more, as in 0.2mm (a bare number is metres)",
                         what, text);
  return value;
}

Result<double> ParseTolerance(const std::string& text) {
  if (text == "any") return kAnyError;
  const Result<double> value = ParseLength("--tolerance", text);
  if (!value.ok()) return Status::Usage("{}, or any", value.status().errors().front().message);
  return value;
}

Result<double> ParseRate(const std::string& text) {
  const Result<double> value = ParseQuantity(text, Unit::kNone, FileUnits());
  if (!value.ok() || *value < 0 || *value > 1)
    return Status::Usage("--violation-rate \"{}\": expected a share from 0 to 1, as in 1%", text);
  return value;
}

Status CheckAccelerationFlags(const AccelerationFlags& flags, bool wanted) {
  if (flags.accelerate && flags.kpsa.has_value())
    return Status::Usage("--accelerate and --kpsa {}: expected one of them", *flags.kpsa);
  if (!wanted) {
    const char* const given = flags.stale.has_value()            ? "--stale"
                              : flags.tolerance.has_value()      ? "--tolerance"
                              : flags.violation_rate.has_value() ? "--violation-rate"
                                                                 : nullptr;
    if (given != nullptr) return Status::Usage("{} is of no use without --accelerate or --kpsa", given);
  }
  if (flags.stale.has_value() && *flags.stale != "refuse" && *flags.stale != "miss")
    return Status::Usage("--stale {}: expected refuse or miss", *flags.stale);
  if (flags.tolerance.has_value()) KPSA_RETURN_IF_ERROR(ParseTolerance(*flags.tolerance).status());
  if (flags.violation_rate.has_value()) KPSA_RETURN_IF_ERROR(ParseRate(*flags.violation_rate).status());
  return Status();
}

std::shared_ptr<const Subspace> WithOpenRanges(const Subspace& subspace) {
  auto open = std::make_shared<Subspace>(subspace);
  for (TrainedRange& range : open->ranges)
    range.lo = -std::numeric_limits<double>::infinity(), range.hi = -range.lo;
  return open;
}

Result<std::vector<AppliedSubspace>> ApplyAcceleration(Rig* rig, Compiler* compiler,
                                                       const AccelerationFlags& flags) {
  std::vector<AppliedSubspace> applied;
  if (flags.kpsa.has_value()) {
    const auto subspace = LoadSubspace(rig->path, *flags.kpsa, flags.with_modes);
    if (!subspace.ok()) return subspace.status();
    AppliedSubspace one;
    one.subspace = *subspace;
    one.path = *flags.kpsa;
    const auto found = std::find_if(
        rig->accelerate.begin(), rig->accelerate.end(),
        [&](const Acceleration& entry) { return PointNames(*rig, entry) == PointNames(**subspace); });
    if (found != rig->accelerate.end()) {
      one.entry = *found;
    } else {
      Result<Acceleration> entry = EntryOf(*rig, **subspace, *flags.kpsa);
      if (!entry.ok()) return entry.status();
      one.entry = std::move(*entry);
    }
    applied.push_back(std::move(one));
  } else {
    if (rig->accelerate.empty())
      return Status::Invalid("has no accelerate section, so nothing to accelerate; --kpsa names a subspace")
          .At({rig->path});
    for (const Acceleration& entry : rig->accelerate) {
      if (entry.subspace.empty())
        return Status::Invalid("accelerate: \"{}\" names no subspace file; --kpsa names one", entry.name)
            .At(entry.where);
      const auto subspace = LoadSubspace(
          entry.reference < 0 ? rig->path : rig->references[static_cast<std::size_t>(entry.reference)].file,
          entry.subspace, flags.with_modes);
      if (!subspace.ok()) return subspace.status();
      AppliedSubspace one;
      one.path = entry.subspace;
      one.entry = entry;
      one.subspace = *subspace;
      applied.push_back(std::move(one));
    }
  }
  for (AppliedSubspace& one : applied) {
    one.name = one.entry.name;
    AccelerateOptions options;
    if (flags.every_frame) one.subspace = WithOpenRanges(*one.subspace);
    options.stale_is_miss = flags.stale.has_value() && *flags.stale == "miss";
    if (flags.tolerance.has_value()) options.tolerance = *ParseTolerance(*flags.tolerance);
    if (flags.violation_rate.has_value()) options.violation_rate = *ParseRate(*flags.violation_rate);
    one.tolerance = options.tolerance < 0 ? one.subspace->tolerance : options.tolerance;
    if (flags.every_frame) options.tolerance = kAnyError;
    one.violation_rate = options.violation_rate < 0 ? one.subspace->violation_rate : options.violation_rate;
    std::string node_name = one.name + "_kpsa";
    while (rig->graph->FindNode(node_name).ok()) node_name += "_";
    Result<Accelerated> accelerated =
        Accelerate(rig->graph.get(), compiler, MakeTarget(*rig, one.entry), one.subspace, node_name, options);
    if (!accelerated.ok()) return Status(accelerated.status()).At({one.path});
    one.node = accelerated->node;
    one.config = accelerated->config;
    one.notes = std::move(accelerated->notes);
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

}  // namespace kpsa
