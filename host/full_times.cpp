#include "host/full_times.h"

#include <algorithm>
#include <map>

#include "base/parallel.h"
#include "host/bench/side.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

// Sums over clips.
struct Sums {
  std::map<std::string, BenchNode> nodes;  // ms_per_frame: nanoseconds of all frames
  std::size_t frames = 0;
};

void AddNodes(const Plan& plan, const RecordedSteps& recorded, double scale, Sums* sums) {
  for (Index s = 0; s < plan.steps().size(); ++s) {
    BenchNode& node = sums->nodes[plan.step_name(s)];
    node.name = plan.step_name(s), node.type = plan.step_type(s);
    node.ms_per_frame += recorded.self_ns[s] * scale;
    node.points = std::max(node.points, plan.infos()[s].points);
  }
}

Status TimeClip(const RigOpener& opener, const std::string& clip, int runs, bool parallel, const Watch& watch,
                std::size_t* done, FullTimes* times, Sums* sums) {
  RigChange change;
  if (!clip.empty()) change.clip = clip;
  const Result<std::unique_ptr<OpenRig>> open = opener.open(change);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  const Result<std::vector<double>> at = opener.times(**open);
  if (!at.ok()) return at.status();
  Compiler compiler;
  const auto plan = CompileFor(rig, &compiler, ShownPoints(rig));
  if (!plan.ok()) return plan.status();
  Side side(rig, *plan, {.parallel = parallel, .frames = at->size(), .cancel = watch.cancel});
  for (int run = 0; run < runs; ++run) {
    side.StartAgain();
    for (std::size_t first = 0; first < at->size(); first += kTurnFrames) {
      const std::size_t end = std::min(first + kTurnFrames, at->size());
      KPSA_RETURN_IF_ERROR(side.Turn(*at, first, end));
      watch.Done(*done += end - first, 0);
    }
  }
  std::vector<double>& frames = times->frame_us.emplace_back();
  double all_ns = 0;
  for (const std::vector<double>& of_runs : side.times.Finish()) {
    frames.push_back(Median(of_runs) / 1e3);
    all_ns += frames.back() * 1e3;
  }
  times->cpu_times = side.times.cpu_ns() > 0;
  RecordedSteps recorded;
  side.StartAgain();
  for (std::size_t first = 0; first < at->size(); first += kTurnFrames)
    KPSA_RETURN_IF_ERROR(side.RecordTurn(*at, first, std::min(first + kTurnFrames, at->size()), &recorded));
  double steps_ns = 0;
  for (const double ns : recorded.self_ns) steps_ns += ns;
  AddNodes(**plan, recorded, all_ns / std::max({1.0, recorded.wall_ns, steps_ns}), sums);
  sums->frames += at->size();
  return Status();
}

}  // namespace

double FullTimes::MeanMs() const {
  double sum = 0;
  std::size_t frames = 0;
  for (const std::vector<double>& clip : frame_us) {
    for (const double us : clip) sum += us / 1e3;
    frames += clip.size();
  }
  return frames == 0 ? 0 : sum / static_cast<double>(frames);
}

Result<FullTimes> TimeFull(const RigOpener& opener, const std::vector<std::string>& clips, int runs,
                           int threads, const Watch& watch) {
  const ThreadLimit limit(threads);
  FullTimes times;
  Sums sums;
  std::size_t done = 0;
  for (const std::string& clip : clips)
    KPSA_RETURN_IF_ERROR(TimeClip(opener, clip, runs, threads > 1, watch, &done, &times, &sums));
  for (auto& [name, node] : sums.nodes) {
    node.ms_per_frame /= 1e6 * static_cast<double>(std::max<std::size_t>(1, sums.frames));
    times.nodes.push_back(node);
  }
  std::ranges::stable_sort(times.nodes, std::greater(), &BenchNode::ms_per_frame);
  return times;
}

}  // namespace kpsa::engine
