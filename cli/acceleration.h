// A rig with subspaces in the place of its stacks, as --accelerate and --kpsa ask for.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/common.h"
#include "graph/compiler.h"
#include "kpsa/calibration.h"

namespace kpsa {

class KpsaConfig;
struct Subspace;

struct AccelerationFlags {
  bool accelerate = false;
  std::optional<std::string> kpsa, stale, tolerance, violation_rate;
  bool every_frame = false;  // reconstruct every frame, whatever SoftCache and trained ranges say (no flag)
  bool with_modes = false;   // Subspace::kept_modes as well, which SplitFrames needs (no flag)
  bool wanted() const { return accelerate || kpsa.has_value(); }
};
// --accelerate --kpsa --tolerance and the shared ones.
void AddAccelerationFlags(CLI::App* command, AccelerationFlags* flags);
// --stale --violation-rate
void AddSharedAccelerationFlags(CLI::App* command, AccelerationFlags* flags);
// All refusals that need no rig. Where nothing is accelerated, the other flags are refused.
Status CheckAccelerationFlags(const AccelerationFlags& flags, bool wanted);

// "0.2mm" as metres, "any" as kAnyError (kpsa/kpsa_node.h), "1%" or "0.01" as a share.
Result<double> ParseLength(const std::string& what, const std::string& text);
Result<double> ParseTolerance(const std::string& text);
Result<double> ParseRate(const std::string& text);

// What an entry accelerates, as its subspace calls it: "head_mesh@mush" without the namespace of a reference,
// or the plug of colours.
std::vector<std::string> PointNames(const Rig& rig, const Acceleration& entry);

// One accelerate entry of the rig with its subspace in place.
struct AppliedSubspace {
  std::string name;  // of the entry
  std::string path;  // of the subspace file
  Acceleration entry;
  std::shared_ptr<const Subspace> subspace;
  NodeId node;                               // the KPSA node
  std::shared_ptr<const KpsaConfig> config;  // of the node
  std::vector<std::string> notes;            // what may surprise
  double tolerance = 0, violation_rate = 0;  // in force
  // What takes the place of entry.points[p].
  PlugRef Output(const Graph& graph, std::size_t p) const {
    return {node, graph.def(node).FindAttribute("outPoints"), static_cast<int>(p), -1};
  }
};

// Rewrites the rig's graph; final points that are accelerated are then those of the KPSA node
// (CharacterMesh::points). Call it with the clip and the settings in place that will be evaluated. --kpsa M
// replaces the file of the entry that has the same points; a rig without entries gets one from the subspace.
// Errors: no such file (and which command makes it), a stale subspace (unless `stale` is "miss").
Result<std::vector<AppliedSubspace>> ApplyAcceleration(Rig* rig, Compiler* compiler,
                                                       const AccelerationFlags& flags);

// Colours that an entry accelerates are asked of its node instead.
void ReadColorsFrom(const std::vector<AppliedSubspace>& applied, const Graph& graph, Request* request);

// The thresholds that the node of an entry works with, and what they promise.
Calibration CalibrationInForce(const AppliedSubspace& applied);

}  // namespace kpsa
