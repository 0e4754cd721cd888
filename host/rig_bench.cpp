// Rig::Bench.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "host/bench/bench.h"
#include "host/face_impl.h"
#include "host/node_type.h"
#include "host/open_rig.h"
#include "host/problems.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "kpsa/bench.h"
#include "kpsa/kpsa_node.h"

namespace kpsa {
namespace {

engine::Status CheckNumbers(const BenchOptions& options) {
  if (options.runs < 1 || options.runs > 1000) return engine::Status::Usage("runs: expected 1 to 1,000");
  if (options.threads < 1 || options.threads > 1024)
    return engine::Status::Usage("threads: expected 1 to 1,024");
  return engine::Status();
}

engine::Status CheckThreads(const BenchOptions& options, const engine::Rig& rig) {
  const std::string name = engine::PrototypeNodeOf(*rig.graph);
  if (options.threads == 1 || name.empty()) return engine::Status();
  return engine::Status::Usage("\"{}\" is computed by a function of this program: expected 1 thread, got {}",
                               name, options.threads)
      .OfNode(name);
}

// The rig's test clips; its first clip where it names none, or its rest ("").
std::vector<std::string> ClipsOf(const engine::Rig& rig) {
  std::vector<std::string> clips = engine::TestClips(rig);
  if (clips.empty()) clips.push_back(rig.scene.clips.empty() ? "" : rig.scene.clips.front().id);
  return clips;
}

// Copies of a rig; a clip that it lacks is refused.
engine::RigOpener CopiesOf(const engine::Rig& rest) {
  engine::RigOpener opener;
  opener.path = rest.path;
  opener.open = [&rest](const engine::RigChange& change) -> engine::Result<std::unique_ptr<engine::OpenRig>> {
    auto open = std::make_unique<engine::OpenRig>();
    open->rig = rest;
    if (change.clip.has_value()) {
      if (engine::Status set = engine::SetClip(&open->rig, *change.clip); !set.ok())
        return std::move(set).At({rest.path});
    }
    return open;
  };
  opener.times = [](const engine::OpenRig& open) { return engine::ClipTimes(open.rig); };
  return opener;
}

BenchReport ReportOf(engine::BenchResult result) {
  BenchReport report;
  report.clips = std::move(result.clips);
  report.frames = result.frames;
  report.hits = result.hits, report.blends = result.blends;
  report.most_frequent_reason = std::move(result.most_frequent_reason);
  report.full_ms = result.full_ms, report.accelerated_ms = result.accelerated_ms;
  const auto known = [](double ratio) { return std::isfinite(ratio) ? ratio : 0; };
  report.speedup = known(result.speedup());
  if (result.hits > 0) report.speedup_on_hits = known(result.speedup_on_hits());
  report.error_rms = result.error_rms, report.error_max = result.error_max;
  report.tolerance =
      result.promise.promised() ? result.promise.tolerance : std::numeric_limits<double>::infinity();
  report.violation_rate = result.promise.rate;
  report.beyond_tolerance = result.promise.promised() ? result.promise.beyond : 0;
  report.promise_kept = result.promise.kept();
  report.notes = std::move(result.notes);
  return report;
}

}  // namespace

Result<BenchReport> Rig::Bench(const BenchOptions& options) const {
  const auto failed = [&](const engine::Status& status) {
    return engine::ProblemsOf(engine::Status(status).At({path()}));
  };
  if (!is_accelerated())
    return failed(engine::Status::Usage(
        "this rig is not accelerated: there is nothing to compare; expected what Rig::Accelerated "
        "(rig.accelerated() in Python) gives"));
  if (const engine::Status numbers = CheckNumbers(options); !numbers.ok()) return failed(numbers);
  if (const engine::Status threads = CheckThreads(options, impl_->rest); !threads.ok())
    return failed(threads);
  engine::BenchOptions bench;
  bench.runs = options.runs;
  bench.threads = options.threads;
  std::atomic<bool> cancel = false;
  engine::Watch watch;
  watch.cancel = &cancel;
  if (options.progress) {
    watch.progress = [&](std::size_t done, std::size_t) {
      if (!cancel && !options.progress(done)) cancel = true;
    };
  }
  engine::Result<std::vector<engine::BenchResult>> results =
      engine::RunBench(CopiesOf(impl_->rest), {*impl_->acceleration},
                       options.clips.empty() ? ClipsOf(impl_->rest) : options.clips, bench, watch);
  if (!results.ok()) return failed(results.status());
  return ReportOf(std::move(results->front()));
}

}  // namespace kpsa
