#include "cli/acceleration.h"

#include "cli/frames_range.h"
#include "cli/options.h"
#include "files/quantity.h"
#include "kpsa/kpsa_node.h"

namespace kpsa::engine {

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

Result<double> ParseSpeedup(const std::string& text) {
  const Result<double> value = ParseQuantity(text, Unit::kNone, FileUnits());
  if (!value.ok() || !(*value > 0))
    return Status::Usage("--speedup \"{}\": expected a number above 0, as in 10", text);
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

AccelerationChoice ChoiceOf(const AccelerationFlags& flags) {
  AccelerationChoice choice;
  choice.subspace = flags.kpsa.value_or("");
  choice.subspace_option = "--kpsa";
  if (flags.tolerance.has_value()) choice.tolerance = *ParseTolerance(*flags.tolerance);
  if (flags.violation_rate.has_value()) choice.violation_rate = *ParseRate(*flags.violation_rate);
  choice.stale_is_miss = flags.stale == "miss";
  choice.stale_option = "--stale miss";
  choice.every_frame = flags.every_frame;
  choice.with_modes = flags.with_modes;
  return choice;
}

Result<std::vector<AppliedSubspace>> ApplyAcceleration(Rig* rig, Compiler* compiler,
                                                       const AccelerationFlags& flags) {
  return ApplyAcceleration(rig, compiler, ChoiceOf(flags));
}

}  // namespace kpsa::engine
