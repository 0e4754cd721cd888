// Evaluation of a rig at several times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "graph/frames.h"
#include "host/watch.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// What is looked at where nobody says: the final points of ShownMeshes(rig.scene), in that
// order; time varies.
Request ShownPoints(const Rig& rig);

// Compiles the request; errors are located at the rig's file.
Result<std::shared_ptr<const Plan>> CompileFor(const Rig& rig, Compiler* compiler, const Request& request);

inline constexpr std::size_t kMaxSamples = 1'000'000;  // times of one evaluation
// Every frame between two times of a clip, both included, in seconds. Errors: more than kMaxSamples.
Result<std::vector<double>> FramesBetween(std::string_view clip, double begin, double end, double fps);
// Every frame of the clip that plays, from its first one to its end, in seconds; time 0 alone if none plays.
// Errors: more than kMaxSamples.
Result<std::vector<double>> ClipTimes(const Rig& rig);
// The same of a clip, whether it plays or not.
Result<std::vector<double>> ClipTimes(const CharacterClip& clip, double fps);
// The frame that is nearest to a time, for reports; held within +-1e15.
std::int64_t FrameNumber(double seconds, double fps);

// What went wrong at a time: its first error, with the time in the message, its node and the place of that.
Status FailedAt(const Rig& rig, double seconds, const Status& evaluated);

struct RigFrameOptions {
  int threads = 0;  // 0: all
  Watch watch;      // of frames
  Profile* profile = nullptr;
};

// Takes a frame whose outputs are up to date. In ascending order, one call at a time.
using RigFrameSink = std::function<Status(std::size_t frame, const Evaluator& evaluator)>;

// Evaluates all outputs of the plan at the times, to which nodes come that need their previous frame as RunUp says
// (host/run_up.h). The first frame that fails ends it, with its time in the
// message; so does whoever cancels it.
Status EvaluateTimes(const Rig& rig, const std::shared_ptr<const Plan>& plan,
                     const std::vector<double>& times, const RigFrameOptions& options,
                     const RigFrameSink& sink);

// Evaluates a frame after those that come before it: one, or all from 0 on where a node needs its past. A
// profile, where one is given, is of the frame alone.
Status EvaluateTo(const Rig& rig, int frame, Evaluator* evaluator, const Watch& watch,
                  Profile* profile = nullptr);

}  // namespace kpsa::engine
