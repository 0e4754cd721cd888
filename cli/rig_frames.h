// Evaluation of a rig at several times.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/status.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "graph/frames.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// What the command line asks for where nobody says: the final points of ShownMeshes(rig.scene), in that
// order; time varies.
Request ShownPoints(const Rig& rig);

// Compiles the request; errors are located at the rig's file.
Result<std::shared_ptr<const Plan>> CompileFor(const Rig& rig, Compiler* compiler, const Request& request);

struct RigFrameOptions {
  int threads = 0;    // 0: all
  std::string label;  // of the progress bar; "": none
  bool quiet = false;
  Profile* profile = nullptr;
};

// Takes a frame whose outputs are up to date. In ascending order, one call at a time.
using RigFrameSink = std::function<Status(std::size_t frame, const Evaluator& evaluator)>;

// Evaluates all outputs of the plan at the times. The first frame that fails ends it, with its time in the
// message; so does an interrupt.
Status EvaluateTimes(const Rig& rig, const std::shared_ptr<const Plan>& plan,
                     const std::vector<double>& times, const RigFrameOptions& options,
                     const RigFrameSink& sink);

// Evaluates a frame after those that come before it: one, or all from 0 on where a node needs its past. A
// profile, where one is given, is of the frame alone.
Status EvaluateTo(const Rig& rig, int frame, Evaluator* evaluator, Profile* profile = nullptr);

}  // namespace kpsa::engine
