// A version of the rig that is viewed: loaded, with its full and its accelerated side, and what the page shows of it.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "host/acceleration.h"
#include "host/open_rig.h"
#include "report/page_data.h"
#include "view/live_pose.h"
#include "view/live_side.h"

namespace kpsa::engine {

struct LiveOptions {
  RigOpener opener;                                // of the rig at rest
  std::optional<AccelerationChoice> acceleration;  // none: the full evaluation alone
  bool clips = true;                               // are offered
  std::optional<std::string> clip;                 // that is offered first
};

enum class EvaluateMode : std::uint8_t { kFull, kAccelerated, kBoth };

// What an evaluation gave. Points are [V, 3], metres, world space.
struct LiveFrame {
  const std::vector<float>*accelerated = nullptr,
        *full = nullptr;                               // null where it was not asked for, or failed
  std::optional<FrameDecision> decision;               // of the accelerated side
  std::optional<double> full_us, accelerated_us;       // microseconds
  std::optional<double> max_error, rms_error;          // metres, over all points
  std::vector<std::pair<std::string, double>> values;  // see LiveSide::Values
  std::string problem;                                 // what failed, or ""
};

// The pose that was evaluated last, for those who tell of it.
struct LatestPose {
  LivePose pose;
  std::vector<std::pair<std::string, double>> values;
};

class LiveRig {
 public:
  // `or_full`: where subspaces do not fit, the full evaluation alone is shown, and `warning` says why. Errors: those
  // of the rig's files and of the rest pose.
  static Result<std::shared_ptr<LiveRig>> Load(const LiveOptions& options, std::uint64_t generation,
                                               bool or_full);
  LiveRig(const LiveRig&) = delete;
  LiveRig& operator=(const LiveRig&) = delete;

  const Rig& rest() const { return open_->rig; }
  std::uint64_t generation() const { return generation_; }
  bool accelerated() const { return accelerated_ != nullptr; }
  std::size_t vertices() const { return vertices_; }
  const PageData& page() const { return page_; }
  const std::string& meta() const { return meta_; }
  const Status& warning() const { return warning_; }
  // All that it was read from, subspaces among them.
  const std::vector<std::string>& files() const { return files_; }

  // Thread-safe; one at a time, and so is the call of `take`, which may use the frame. Errors: a request that names
  // what there is not.
  template <typename Take>
  Status Evaluate(const PoseRequest& request, EvaluateMode mode, const Take& take) {
    const Result<LivePose> pose = FindPose(rest(), request);
    if (!pose.ok()) return pose.status();
    const std::lock_guard<std::mutex> lock(evaluating_);
    take(Evaluate(*pose, mode));
    return Status();
  }
  LatestPose latest() const;

 private:
  LiveRig() = default;
  LiveFrame Evaluate(const LivePose& pose, EvaluateMode mode);
  Status PutAll(const LiveOptions& options);
  Status PutGraph();

  std::unique_ptr<OpenRig> open_;
  std::uint64_t generation_ = 0;
  std::size_t vertices_ = 0;
  Status warning_;
  std::vector<std::string> files_;
  PageData page_;
  std::string meta_;
  std::mutex evaluating_;  // of what follows
  std::unique_ptr<LiveSide> full_, accelerated_;
  std::vector<float> full_points_, accelerated_points_;
  mutable std::mutex latest_mutex_;
  LatestPose latest_;
};

}  // namespace kpsa::engine
