#include "host/checks/playback_times.h"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <optional>

#include "base/parallel.h"
#include "host/bench/frame_times.h"
#include "host/bench/side.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/accelerate.h"
#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kPlaybackBlocks = 5, kPlaybackBlockFrames = 8;
constexpr int kPlaybackRuns = 5, kFewestRuns = 3;
constexpr double kEnoughSeconds = 0.25;  // of a block's runs: what takes longer is told well by few of them

// Sums over blocks.
struct PlaybackSums {
  std::size_t frames = 0, hits = 0;
  double full_ns = 0, hit_ns = 0;
};

// What the times of frames are to be multiplied with: a frame that is interrupted in every run keeps what it
// waited, and among so few frames one counts.
double WorkShare(const FrameTimes& times) {
  double all = 0;
  for (const std::vector<double>& runs : times.ns()) all = std::accumulate(runs.begin(), runs.end(), all);
  return times.cpu_ns() > 0 && all > times.cpu_ns() ? times.cpu_ns() / all : 1;
}

Status TimeBlock(const Rig& rig, const PlaybackPlans& plans, const std::vector<double>& times, bool light,
                 const Watch& watch, PlaybackSums* sums) {
  std::optional<ThreadLimit> limit;
  if (!light) limit.emplace(1);
  const SideOptions options{.parallel = light, .frames = times.size(), .cancel = watch.cancel};
  Side full(rig, plans.full, options), accelerated(rig, plans.accelerated, options);
  std::vector<char> hit(times.size());
  const auto begin = std::chrono::steady_clock::now();
  const auto enough = [&](int runs) {
    if (light) return runs >= 1;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return runs >= kPlaybackRuns || (runs >= kFewestRuns && seconds > kEnoughSeconds);
  };
  for (int run = 0; !enough(run); ++run) {
    full.StartAgain();
    KPSA_RETURN_IF_ERROR(full.Turn(times, 0, times.size()));
    // Hits are short: so few of them would be timed while the caches are still those of the full side
    accelerated.StartAgain();
    for (std::size_t f = 0; f < times.size(); ++f) {
      if (watch.cancelled()) return CancelledStatus();
      KPSA_RETURN_IF_ERROR(accelerated.Evaluate(times[f]));
      hit[f] = accelerated.evaluator->Get<double>(plans.full_weight) <= 0;
    }
    accelerated.StartAgain();
    KPSA_RETURN_IF_ERROR(accelerated.Turn(times, 0, times.size()));
  }
  full.times.Finish(), accelerated.times.Finish();
  const double full_share = WorkShare(full.times), accelerated_share = WorkShare(accelerated.times);
  for (std::size_t f = 1; f < times.size(); ++f) {
    ++sums->frames;
    sums->full_ns += full_share * Median(full.times.ns()[f]);
    if (!hit[f]) continue;
    ++sums->hits;
    sums->hit_ns += accelerated_share * Median(accelerated.times.ns()[f]);
  }
  return Status();
}

Result<PlaybackSums> TimeAt(double tolerance, const RigOpener& opener, const AccelerateEntry& entry,
                            const std::shared_ptr<const Subspace>& subspace,
                            const std::vector<TrainingClip>& clips, const Watch& watch) {
  PlaybackSums sums;
  // Light takes seconds a frame
  const bool light = subspace->of_light();
  std::unique_ptr<OpenRig> open;  // of the clip of the block before
  PlaybackPlans plans;
  std::size_t clip = clips.size();
  for (const PlaybackBlock& block :
       PlaybackBlocks(clips, light ? 1 : kPlaybackBlocks, light ? 1 : kPlaybackBlockFrames)) {
    if (block.clip != clip) {
      clip = block.clip;
      Result<std::unique_ptr<OpenRig>> loaded = opener.open({});
      if (!loaded.ok()) return loaded.status();
      open = std::move(*loaded);
      KPSA_RETURN_IF_ERROR(SetClip(&open->rig, clips[clip].name));
      Result<PlaybackPlans> made = MakePlaybackPlans(&open->rig, entry, subspace, tolerance);
      if (!made.ok()) return made.status();
      plans = std::move(*made);
    }
    if (plans.full->steps().empty()) continue;  // nothing moves
    const std::vector<double>& at = clips[clip].times;
    const std::vector<double> times(at.begin() + static_cast<std::ptrdiff_t>(block.first),
                                    at.begin() + static_cast<std::ptrdiff_t>(block.end));
    KPSA_RETURN_IF_ERROR(TimeBlock(open->rig, plans, times, light, watch, &sums));
  }
  return sums;
}

}  // namespace

std::vector<PlaybackBlock> PlaybackBlocks(const std::vector<TrainingClip>& clips, std::size_t count,
                                          std::size_t frames) {
  const std::size_t all =
      std::accumulate(clips.begin(), clips.end(), std::size_t{0},
                      [](std::size_t sum, const TrainingClip& clip) { return sum + clip.times.size(); });
  std::vector<PlaybackBlock> blocks;
  if (all == 0) return blocks;
  for (std::size_t b = 0; b < count; ++b) {
    // The middle of an equal part of all frames
    std::size_t clip = 0, middle = (2 * b + 1) * all / (2 * count);
    while (middle >= clips[clip].times.size()) middle -= clips[clip++].times.size();
    const std::size_t size = std::min(frames + 1, clips[clip].times.size());
    if (size < 2) continue;
    std::size_t first = std::min(middle - std::min(middle, size / 2), clips[clip].times.size() - size);
    // Of short clips, what is left of them
    if (!blocks.empty() && blocks.back().clip == clip) first = std::max(first, blocks.back().end - 1);
    const std::size_t end = std::min(first + size, clips[clip].times.size());
    if (end - first >= 2) blocks.push_back({clip, first, end});
  }
  return blocks;
}

Result<PlaybackPlans> MakePlaybackPlans(Rig* rig, const AccelerateEntry& entry,
                                        const std::shared_ptr<const Subspace>& subspace, double tolerance) {
  Request request;
  for (const AcceleratedPoints& points : entry.points) {
    if (points.colors) request.outputs.push_back({points.points, {}});
  }
  const bool colors = !request.outputs.empty();
  if (!colors) request = ShownPoints(*rig);
  request.varying = {rig->scene.time};
  PlaybackPlans plans;
  Compiler compiler;
  Result<std::shared_ptr<const Plan>> full = CompileFor(*rig, &compiler, request);
  if (!full.ok()) return full.status();
  plans.full = std::move(*full);

  AccelerateOptions options;
  options.tolerance = tolerance;
  const Result<Accelerated> accelerated =
      Accelerate(rig->graph.get(), &compiler, MakeTarget(*rig, entry), subspace,
                 rig->graph->FreeNodeName("playback_kpsa"), options);
  if (!accelerated.ok()) return accelerated.status();
  const NodeDef& def = rig->graph->def(accelerated->node);
  for (std::size_t p = 0; p < entry.points.size(); ++p) {
    for (RequestedOutput& output : request.outputs) {
      if (output.plug == entry.points[p].points)
        output.plug = {accelerated->node, def.FindAttribute("outPoints"), static_cast<int>(p), -1};
    }
  }
  plans.full_weight = static_cast<Index>(request.outputs.size());
  request.outputs.push_back({{accelerated->node, def.FindAttribute("fullWeight"), -1, -1}, {}});
  Result<std::shared_ptr<const Plan>> plan = CompileFor(*rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  plans.accelerated = std::move(*plan);
  return plans;
}

Result<PlaybackTimes> TimePlayback(const RigOpener& opener, const AccelerateEntry& entry,
                                   const std::shared_ptr<const Subspace>& subspace,
                                   const std::vector<TrainingClip>& clips, const Watch& watch) {
  Result<PlaybackSums> sums = TimeAt(subspace->tolerance, opener, entry, subspace, clips, watch);
  if (sums.ok() && sums->frames > 0 && sums->hits == 0)
    sums = TimeAt(kAnyError, opener, entry, subspace, clips, watch);
  if (!sums.ok()) return sums.status();
  PlaybackTimes times{sums->frames, sums->hits, 0, 0};
  if (sums->frames > 0) times.full_ms = sums->full_ns / static_cast<double>(sums->frames) / 1e6;
  if (sums->hits > 0) times.hit_ms = sums->hit_ns / static_cast<double>(sums->hits) / 1e6;
  return times;
}

}  // namespace kpsa::engine
