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
#include "view/handle_side.h"
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

struct FrameRequest {
  PoseRequest pose;
  EvaluateMode mode = EvaluateMode::kFull;
  bool handles = false;      // where they are is asked for
  std::optional<Drag> drag;  // moves controls of the pose
};

// What an evaluation gave. Points are [V, 3], metres, world space.
struct LiveFrame {
  const std::vector<float>*accelerated = nullptr,
        *full = nullptr;                                // null where it was not asked for, or failed
  std::optional<FrameDecision> decision;                // of the accelerated side
  std::optional<double> full_us, accelerated_us;        // microseconds
  std::optional<double> max_error, rms_error;           // metres, over all points
  std::vector<std::pair<std::string, double>> values;   // see LiveSide::Values
  std::vector<std::pair<std::string, double>> dragged;  // what a drag made of its handle's controls
  std::vector<Double3> handles;                         // where they are, if that was asked for and is known
  std::string problem;                                  // what failed, or ""
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
  const std::vector<Handle>& handles() const { return handles_->handles(); }
  // All that it was read from, subspaces among them.
  const std::vector<std::string>& files() const { return files_; }

  // Thread-safe; one at a time, and so is the call of `take`, which may use the frame. Errors: a request that names
  // what there is not, or drags what cannot be dragged.
  template <typename Take>
  Status Evaluate(const FrameRequest& request, const Take& take) {
    Result<LivePose> pose = FindPose(rest(), request.pose);
    if (!pose.ok()) return pose.status();
    const std::lock_guard<std::mutex> lock(evaluating_);
    std::vector<std::pair<std::string, double>> dragged;
    if (request.drag.has_value()) {
      auto set = handles_->DragTo(*request.drag, &*pose);
      if (!set.ok()) return set.status();
      dragged = std::move(*set);
    }
    LiveFrame frame = Evaluate(*pose, request);
    frame.dragged = std::move(dragged);
    take(frame);
    return Status();
  }
  LatestPose latest() const;

 private:
  LiveRig() = default;
  LiveFrame Evaluate(const LivePose& pose, const FrameRequest& request);
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
  std::unique_ptr<HandleSide> handles_;
  std::vector<float> full_points_, accelerated_points_;
  mutable std::mutex latest_mutex_;
  LatestPose latest_;
};

}  // namespace kpsa::engine
