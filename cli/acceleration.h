// Flags that ask for subspaces in the place of a rig's stacks: --accelerate, --kpsa and their kin.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/common.h"
#include "host/acceleration.h"

namespace kpsa::engine {

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
// "--speedup 10" as a number. Errors: none above 0.
Result<double> ParseSpeedup(const std::string& text);

// As the flags say, which CheckAccelerationFlags found fit.
AccelerationChoice ChoiceOf(const AccelerationFlags& flags);
Result<std::vector<AppliedSubspace>> ApplyAcceleration(Rig* rig, Compiler* compiler,
                                                       const AccelerationFlags& flags);

}  // namespace kpsa::engine
