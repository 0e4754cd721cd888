// A rig with subspaces in the place of its stacks.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "graph/compiler.h"
#include "kpsa/calibration.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

class KpsaConfig;
struct Subspace;

// Which subspaces, and what is asked of them.
struct AccelerationChoice {
  std::string subspace;         // a file; "": those that the rig names
  std::string subspace_option;  // what people call `subspace` where they choose it, for errors; or ""
  std::optional<double>
      tolerance;  // metres; kAnyError (kpsa/kpsa_node.h): every frame; unset: the subspace's own
  std::optional<double> violation_rate;
  bool stale_is_miss = false;     // else a subspace of another version of the rig is refused
  std::string stale_option = {};  // what people call `stale_is_miss` where they choose it, likewise
  bool every_frame = false;       // reconstruct every frame, whatever SoftCache and trained ranges say
  bool with_modes = false;        // Subspace::kept_modes as well, which SplitFrames needs
  // Files that were read before (without modes), by path: they are not read again.
  std::vector<std::pair<std::string, std::shared_ptr<const Subspace>>> loaded = {};
};

// What an entry accelerates, as its subspace calls it: "head_mesh@mush" without the namespace of a reference,
// or the plug of colours.
std::vector<std::string> PointNames(const Rig& rig, const AccelerateEntry& entry);

// One accelerate entry of the rig with its subspace in place.
struct AppliedSubspace {
  std::string name;  // of the entry
  std::string path;  // of the subspace file
  AccelerateEntry entry;
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
// (CharacterMesh::points). Call it with the clip and the settings in place that will be evaluated. A subspace
// that is named replaces the file of the entry that has the same points; a rig without entries gets one from
// it. Errors: no such file (and which command makes it), a stale subspace (unless `stale` is "miss").
Result<std::vector<AppliedSubspace>> ApplyAcceleration(Rig* rig, Compiler* compiler,
                                                       const AccelerationChoice& choice);

// Colours that an entry accelerates are asked of its node instead.
void ReadColorsFrom(const std::vector<AppliedSubspace>& applied, const Graph& graph, Request* request);

// The thresholds that the node of an entry works with, and what they promise.
Calibration CalibrationInForce(const AppliedSubspace& applied);

}  // namespace kpsa::engine
