// Every frame of clips, as points: fully evaluated and, where subspaces are in place, accelerated.
//
// V vertices: those of all meshes that are shown, one mesh after the other, each in its file's order.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "graph/evaluator.h"
#include "host/acceleration.h"
#include "host/open_rig.h"
#include "host/watch.h"

namespace kpsa::engine {

struct ClipRecord {
  std::string name;   // as Contender calls it; "(rest)" where none plays
  bool test = false;  // an entry of the rig names it as one that is never trained on
  double fps = 0;
  std::vector<double> times;             // [frames] seconds, 1 / fps apart
  std::size_t width = 0;                 // 3V
  std::vector<float> full, accelerated;  // [frames, V, 3] metres, world space; empty: nothing is accelerated
  std::span<const float> FullAt(std::size_t frame) const {
    return std::span(full).subspan(frame * width, width);
  }
  std::span<const float> AcceleratedAt(std::size_t frame) const {
    return std::span(accelerated).subspan(frame * width, width);
  }
};

struct ClipRecordOptions {
  std::optional<AccelerationChoice> acceleration;  // unset: full alone
  int threads = 0;                                 // 0: all
  Watch watch;                                     // of frames of the clip, both evaluations
};

// The clip ("": the one that the opener chooses). Errors: of the rig, its subspaces and its evaluation; a point
// that is not finite; more than kMostRecordBytes.
Result<ClipRecord> RecordClip(const RigOpener& opener, const std::string& clip,
                              const ClipRecordOptions& options);
inline constexpr double kMostRecordBytes = 2e9;  // of one clip

// [V, 3] of the first outputs of an evaluator, which are the points of the meshes that are shown.
void ReadVertices(const Rig& rig, const Evaluator& evaluator, std::span<float> xyz);
std::size_t ShownVertices(const Rig& rig);  // V

}  // namespace kpsa::engine
