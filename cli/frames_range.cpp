#include "cli/frames_range.h"

namespace kpsa::engine {

Status CheckTimeFlags(const Flags& flags) {
  if (flags.frames.has_value() && flags.times.has_value())
    return Status::Usage("--frames and --times: expected one of them");
  if (flags.frames.has_value()) {
    if (const auto frames = ParseFrames(*flags.frames); !frames.ok()) return frames.status();
  }
  if (flags.times.has_value()) {
    if (const auto times = ParseTimes(*flags.times); !times.ok()) return times.status();
  }
  return Status();
}

Result<std::vector<double>> SampleTimes(const Flags& flags, const OpenRig& open) {
  KPSA_RETURN_IF_ERROR(CheckTimeFlags(flags));
  if (flags.times.has_value()) return ParseTimes(*flags.times);
  const Rig& rig = open.rig;
  if (flags.frames.has_value()) {
    std::vector<double> times;
    const Result<std::vector<std::int64_t>> frames = ParseFrames(*flags.frames);
    for (std::int64_t frame : *frames) times.push_back(static_cast<double>(frame) / rig.fps);
    return times;
  }
  if (open.pose_time.has_value()) return std::vector<double>{*open.pose_time};
  Result<std::vector<double>> all = ClipTimes(rig);
  if (all.ok()) return all;
  return Status::Usage("{}: choose some with --frames", all.status().errors().front().message);
}

}  // namespace kpsa::engine
