#include "host/bench/bench.h"

#include <algorithm>
#include <deque>
#include <memory>

#include "base/parallel.h"
#include "host/bench/contender.h"
#include "host/rig_frames.h"
#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

class Bench {
 public:
  Bench(const RigOpener& opener, const std::vector<AccelerationChoice>& sides, const BenchOptions& options,
        const Watch& watch)
      : opener_(opener), options_(options), watch_(watch), reference_(options.reference, options.rival) {
    contenders_.resize(sides.size());
    for (std::size_t i = 0; i < sides.size(); ++i) {
      contenders_[i].choice = sides[i];
    }
  }

  Status RunClip(const std::string& name) {
    RigChange clip;
    if (!name.empty()) clip.clip = name;
    const Result<std::unique_ptr<OpenRig>> open = opener_.open(clip);
    if (!open.ok()) return open.status();
    const Rig& rig = (*open)->rig;
    const Result<std::vector<double>> sampled = opener_.times(**open);
    if (!sampled.ok()) return sampled.status();
    const std::vector<double>& times = *sampled;
    SideOptions side_options{
        .parallel = options_.threads > 1, .frames = times.size(), .cancel = watch_.cancel};
    Result<std::shared_ptr<const Plan>> full_plan = LoadSides(clip, rig, side_options);
    if (!full_plan.ok()) return full_plan.status();
    const bool still = side_options.still = (*full_plan)->steps().empty();
    if (still) full_plan = LoadSides(clip, rig, side_options);
    if (!full_plan.ok()) return full_plan.status();
    if ((*full_plan)->steps().empty())
      return Status::Invalid("nothing moves and there are no controls, so there is nothing to time")
          .At({rig.path});
    Side full(rig, *full_plan, side_options);
    std::vector<Side*> sides{&full};
    for (Contender& contender : contenders_) {
      contender.Describe();
      sides.push_back(contender.side.get());
    }
    KPSA_RETURN_IF_ERROR(reference_.Load(opener_, clip, **full_plan, side_options));
    if (still) {
      contenders_.front().result.notes.push_back(
          "nothing moves: timed is the evaluation of this pose from its controls, all of it every time");
    }
    // Points
    for (std::size_t f = 0; f < times.size(); ++f) {
      if (watch_.cancelled()) return CancelledStatus();
      watch_.Done(done_++, 0);
      for (Side* side : sides) {
        if (Status status = side->Evaluate(times[f]); !status.ok()) return std::move(status).At({rig.path});
      }
      const std::int64_t number = FrameNumber(times[f], rig.fps);
      for (Contender& contender : contenders_) {
        contender.Compare(number, *full.evaluator, rig.scene.clip.value_or("(rest)"));
        KPSA_RETURN_IF_ERROR(contender.tolerances.AddFrame(times[f], number, *full.evaluator).At({rig.path}));
      }
      KPSA_RETURN_IF_ERROR(reference_.AddFrame(times[f], sides).At({rig.path}));
    }
    for (Contender& contender : contenders_) {
      contender.NoteClip(rig.scene.clip.value_or("(rest)"), still);
      contender.errors.Merge(contender.clip_errors);
      contender.result.frames += times.size();
    }

    // Times. The sides take turns by blocks of frames: each keeps its caches as in playback, and all see the
    // same machine
    std::vector<Side*> timed = sides;
    if (reference_.rival() != nullptr) timed.push_back(reference_.rival());
    for (int run = 0; run < options_.runs; ++run) {
      for (Side* side : timed) side->StartAgain();
      for (std::size_t first = 0, block = 0; first < times.size(); first += kTurnFrames, ++block) {
        const std::size_t end = std::min(first + kTurnFrames, times.size());
        for (std::size_t turn = 0; turn < timed.size(); ++turn) {
          Side* const side = timed[(static_cast<std::size_t>(run) + block + turn) % timed.size()];
          if (Status status = side->Turn(times, first, end); !status.ok())
            return std::move(status).At({rig.path});
        }
        for (std::size_t f = first; f < end && !watch_.cancelled(); ++f) watch_.Done(done_++, 0);
      }
    }
    for (Side* side : timed) {
      const auto of = std::ranges::find(contenders_, side, [](const Contender& c) { return c.side.get(); });
      side->times.Finish(of == contenders_.end() ? std::vector<int>() : of->KindsOfFrames(times.size()));
    }
    reference_.AddTimes();
    for (Contender& contender : contenders_) {
      contender.AddTimes(full.times);
      if (contender.verdicts->hits() == 0)
        KPSA_RETURN_IF_ERROR(contender.tolerances.TimeHits(times).At({rig.path}));
    }
    KPSA_RETURN_IF_ERROR(ProfileClip(sides, times));
    for (Contender& contender : contenders_) {
      if (!HaveKeptModes(contender.applied)) continue;
      Result<FrameErrors> errors =
          SplitFrames(opener_, clip, contender.choice, times, contender.weights, watch_);
      if (!errors.ok()) return errors.status();
      contender.result.frame_errors.Append(*errors);
    }
    return Status();
  }

  std::vector<BenchResult> Finish() {
    std::vector<BenchResult> results;
    for (Contender& contender : contenders_) {
      contender.Finish(options_.speedup);
      contender.result.reference =
          reference_.Table(results.size(), contender.result.full_ms, contender.result.accelerated_ms);
      results.push_back(std::move(contender.result));
    }
    return results;
  }

 private:
  // All contenders' rigs and the plan of the full side.
  Result<std::shared_ptr<const Plan>> LoadSides(const RigChange& clip, const Rig& rig,
                                                const SideOptions& options) {
    Request outputs;
    for (std::size_t i = 0; i < contenders_.size(); ++i) {
      Request wanted;
      KPSA_RETURN_IF_ERROR(contenders_[i].Load(opener_, clip, options, &wanted));
      if (i == 0) outputs = wanted;
      if (outputs.outputs.size() != wanted.outputs.size() ||
          outputs.outputs.front().plug != wanted.outputs.front().plug)
        return Status::Usage("{} and {} accelerate different things, which no common run compares",
                             contenders_[0].applied.front().path, contenders_[i].applied.front().path);
    }
    Compiler compiler;
    return CompileFor(rig, &compiler, outputs);
  }

  // What the time consists of. The full side comes first.
  Status ProfileClip(const std::vector<Side*>& sides, const std::vector<double>& times) {
    std::vector<RecordedSteps> recorded(sides.size());
    for (Side* side : sides) side->StartAgain();
    Status status;
    for (std::size_t first = 0; first < times.size() && status.ok(); first += kTurnFrames) {
      const std::size_t end = std::min(first + kTurnFrames, times.size());
      for (std::size_t i = 0; i < sides.size() && status.ok(); ++i)
        status = sides[i]->RecordTurn(times, first, end, &recorded[i]);
    }
    KPSA_RETURN_IF_ERROR(std::move(status));
    const auto sum = [](const FrameTimes& frames) {
      double ns = 0;
      for (const std::vector<double>& runs : frames.ns()) ns += Median(runs);
      return ns;
    };
    for (std::size_t i = 0; i < contenders_.size(); ++i) {
      contenders_[i].AddFullProfile(*sides[0]->plan, recorded[0], sum(sides[0]->times));
      contenders_[i].AddProfile(recorded[i + 1], sum(sides[i + 1]->times));
    }
    return Status();
  }

  const RigOpener& opener_;
  const BenchOptions& options_;
  const Watch& watch_;
  BenchReference reference_;
  std::deque<Contender> contenders_;  // stay where they are: their verdicts refer to them
  std::size_t done_ = 0;
};

}  // namespace

Result<std::vector<BenchResult>> RunBench(const RigOpener& opener,
                                          const std::vector<AccelerationChoice>& sides,
                                          const std::vector<std::string>& clips, const BenchOptions& options,
                                          const Watch& watch) {
  const ThreadLimit limit(options.threads);
  Bench bench(opener, sides, options, watch);
  for (const std::string& clip : clips) KPSA_RETURN_IF_ERROR(bench.RunClip(clip));
  return bench.Finish();
}

}  // namespace kpsa::engine
