#include "view/live_rig.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "host/control_reach.h"
#include "host/cue_marks.h"
#include "host/node_outline.h"
#include "report/page_fields.h"
#include "report/page_graph.h"
#include "report/page_rig.h"
#include "view/live_meta.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kReachPoints = 2'000'000;  // some half second

// The largest distance of two points, and the root of the mean square, metres.
std::pair<double, double> ErrorsOf(const std::vector<float>& a, const std::vector<float>& b) {
  double most = 0, sum = 0;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3) {
    double square = 0;
    for (std::size_t c = i; c < i + 3; ++c) {
      const double difference = static_cast<double>(a[c]) - static_cast<double>(b[c]);
      square += difference * difference;
    }
    most = std::max(most, square), sum += square;
  }
  return {std::sqrt(most), a.empty() ? 0 : std::sqrt(sum / static_cast<double>(a.size() / 3))};
}

}  // namespace

Result<std::shared_ptr<LiveRig>> LiveRig::Load(const LiveOptions& options, std::uint64_t generation,
                                               bool or_full) {
  std::shared_ptr<LiveRig> live(new LiveRig);
  Result<std::unique_ptr<OpenRig>> open = options.opener.open({});
  if (!open.ok()) return open.status();
  live->open_ = std::move(*open);
  live->generation_ = generation;
  const Rig& rig = live->rest();
  live->files_ = rig.files;
  live->vertices_ = StackedVertices(rig);
  live->full_points_.resize(3 * live->vertices_);
  live->full_ = std::make_unique<LiveSide>(rig, std::nullopt);
  KPSA_RETURN_IF_ERROR(live->full_->Evaluate({}));
  KPSA_RETURN_IF_ERROR(live->full_->CopyPoints(live->full_points_));
  if (options.acceleration.has_value()) {
    live->accelerated_points_.resize(3 * live->vertices_);
    live->accelerated_ = std::make_unique<LiveSide>(rig, options.acceleration);
    const Status status = live->accelerated_->Evaluate({});
    if (!status.ok() && !or_full) return status;
    if (!status.ok()) live->accelerated_ = nullptr;
    live->warning_ = status;
    // Whether they fit by now or not, they are looked at
    if (!options.acceleration->subspace.empty()) live->files_.push_back(options.acceleration->subspace);
    for (const AccelerateEntry& entry : rig.accelerate) {
      if (options.acceleration->subspace.empty() && !entry.subspace.empty())
        live->files_.push_back(entry.subspace);
    }
  }
  Result<std::unique_ptr<HandleSide>> handles = HandleSide::Make(rig);
  if (!handles.ok()) return handles.status();
  live->handles_ = std::move(*handles);
  KPSA_RETURN_IF_ERROR(live->PutAll(options));
  return live;
}

Status LiveRig::PutAll(const LiveOptions& options) {
  PutRigNames(rest(), &page_);
  page_.Put("generation", std::to_string(generation_));
  PutMeshes(rest(), full_points_, &page_);
  page_.Put("accelerated", accelerated() ? "true" : "false");
  if (accelerated()) PutTolerance(accelerated_->playing().applied(), &page_);
  if (options.clips) KPSA_RETURN_IF_ERROR(PutClipTimes(rest(), options.clip, &page_));
  // What each control moves is worth a moment, and no more: two evaluations each
  std::vector<ControlReach> reaches;
  if (2 * vertices() * rest().controls.size() <= kReachPoints) {
    Result<std::vector<ControlReach>> reached = ReachOfControls(rest(), {});
    if (reached.ok()) reaches = std::move(*reached);
  }
  PutControls(rest(), &page_, reaches);
  if (const Result<std::vector<Double3>> places = handles_->Places({}); places.ok())
    PutHandles(rest(), handles(), *places, &page_);
  PutFields(rest(), &page_);
  KPSA_RETURN_IF_ERROR(PutGraph());
  meta_ = page_.Meta();
  return Status();
}

// The nodes of both sides, and where subspaces measure.
Status LiveRig::PutGraph() {
  if (!accelerated()) {
    PutNodes(OutlineNodes(*full_->playing().rig().graph, full_->plan(), nullptr, {}), false, {}, {}, &page_);
    return Status();
  }
  const Playing& playing = accelerated_->playing();
  PutNodes(OutlineNodes(*playing.rig().graph, full_->plan(), &accelerated_->plan(), playing.applied()), true,
           {}, {}, &page_);
  const Result<std::vector<CueMark>> cues = MarkCues(playing.rig(), playing.applied(), full_points_);
  if (!cues.ok()) return cues.status();
  PutCues(*cues, {}, &page_);
  return Status();
}

LiveFrame LiveRig::Evaluate(const LivePose& pose, const FrameRequest& request) {
  const EvaluateMode mode = request.mode;
  LiveFrame frame;
  Status failed;
  const auto told = [&](LiveSide& side, std::vector<float>* points, std::optional<double>* us) {
    Status status = side.Evaluate(pose);
    if (status.ok()) status = side.CopyPoints(*points);
    if (status.ok()) {
      *us = side.microseconds();
      if (!frame.values.empty()) return true;  // the same on both sides
      if (auto values = side.Values(); values.ok()) frame.values = std::move(*values);
      return true;
    }
    if (failed.ok()) failed = status;
    return false;
  };
  if (mode != EvaluateMode::kFull && accelerated() &&
      told(*accelerated_, &accelerated_points_, &frame.accelerated_us)) {
    frame.accelerated = &accelerated_points_;
    frame.decision = accelerated_->Decision();
  }
  if ((mode != EvaluateMode::kAccelerated || !accelerated()) && failed.ok() &&
      told(*full_, &full_points_, &frame.full_us))
    frame.full = &full_points_;
  if (!failed.ok()) {
    frame.accelerated = frame.full = nullptr;
    frame.problem = failed.ToString();
  }
  if (request.handles) {
    if (Result<std::vector<Double3>> places = handles_->Places(pose); places.ok())
      frame.handles = std::move(*places);
  }
  if (frame.accelerated != nullptr && frame.full != nullptr)
    std::tie(frame.max_error, frame.rms_error) = ErrorsOf(full_points_, accelerated_points_);
  const std::lock_guard<std::mutex> lock(latest_mutex_);
  latest_ = {pose, frame.values};
  return frame;
}

LatestPose LiveRig::latest() const {
  const std::lock_guard<std::mutex> lock(latest_mutex_);
  return latest_;
}

}  // namespace kpsa::engine
