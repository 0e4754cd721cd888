// What the small nodes of a character cost a frame, without points: all world matrices (as skins read them)
// and morph weights of a clip; and local matrices instead (as KPSA nodes read them).
//   bench_joints CHARACTER [frames]       a .glb, .gltf or rig; 240 frames if not given
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>

#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "nodes/standard_nodes.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPasses = 30;

// Microseconds a frame, the least of several passes over the frames. `disturb` runs before every frame, not
// timed.
template <typename F>
double MicrosecondsAFrame(Evaluator& evaluator, Index time, const std::vector<double>& times, F disturb) {
  double best = 1e30;
  for (int pass = 0; pass < kPasses; ++pass) {
    double sum = 0;
    for (double t : times) {
      disturb();
      const auto start = Clock::now();
      evaluator.Set(time, t);
      if (!evaluator.Evaluate().ok()) return -1;
      sum += std::chrono::duration<double, std::micro>(Clock::now() - start).count();
    }
    best = std::min(best, sum);
  }
  return best / static_cast<double>(times.size());
}

int Report(const Rig& rig, const std::string& matrices, long frames) {
  Request request;
  request.varying = {rig.scene.time};
  const auto ask = [&](const std::string& plug) {
    Result<PlugRef> found = rig.graph->FindPlug(plug);
    if (found.ok()) request.outputs.push_back({*found, {}});
  };
  for (NodeId node : rig.scene.transforms) {
    if (rig.graph->IsAlive(node)) ask(rig.graph->name(node) + "." + matrices);
  }
  for (NodeId node : rig.scene.clip_nodes) {
    if (rig.graph->def(node).name == "clipWeights") ask(rig.graph->name(node) + ".output[0]");
  }
  Compiler compiler;
  Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig.graph, request);
  if (!plan.ok()) {
    fmt::print(stderr, "{}\n", plan.status().ToString());
    return 3;
  }
  const Index time = (*plan)->FindVarying(rig.scene.time);
  if (time == kNoIndex) {
    fmt::print(stderr, "{}: nothing moves with time\n", rig.path);
    return 3;
  }
  std::vector<double> forward, scattered;
  for (long f = 0; f < frames; ++f) {
    forward.push_back(static_cast<double>(f) / 24);
    scattered.push_back(static_cast<double>(f * 7919 % frames) / 24);
  }
  Evaluator evaluator(*plan);
  std::vector<char> other(std::size_t{4} << 20);  // what a frame's points would leave in the caches
  const auto nothing = [] {};
  const auto evict = [&] {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
  };
  const double in_order = MicrosecondsAFrame(evaluator, time, forward, nothing);
  const double out_of_order = MicrosecondsAFrame(evaluator, time, scattered, nothing);
  const double cold = MicrosecondsAFrame(evaluator, time, forward, evict);
  Profile profile(**plan);
  evaluator.Record(&profile);
  const double recorded = MicrosecondsAFrame(evaluator, time, forward, nothing);
  fmt::print(
      "{}, {} steps: {:.2f} us a frame in order, {:.2f} in any order, {:.2f} with cold caches, {:.2f} while "
      "recording\n",
      matrices, (*plan)->steps().size(), in_order, out_of_order, cold, recorded);
  struct Row {
    std::uint64_t steps = 0, count = 0, ns = 0;
  };
  std::map<std::string, Row> by_type;
  for (Index s = 0; s < (*plan)->steps().size(); ++s) {
    Row& row = by_type[(*plan)->step_type(s)];
    ++row.steps, row.count += profile.counts()[s], row.ns += profile.self_ns()[s];
  }
  for (const auto& [type, row] : by_type) {
    fmt::print(
        "  {:<20} {:>5} steps, {:>5.1f} % of them a frame, {:>6.0f} ns each (the clock's own time is in "
        "it)\n",
        type, row.steps,
        100.0 * static_cast<double>(row.count) / static_cast<double>(row.steps * kPasses * forward.size()),
        static_cast<double>(row.ns) / static_cast<double>(std::max<std::uint64_t>(row.count, 1)));
  }
  return 0;
}

int Main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: bench_joints CHARACTER [frames]\n");
    return 2;
  }
  NodeRegistry registry;
  AddStandardNodes(registry);
  const Result<Rig> rig = LoadRig(registry, argv[1]);
  if (!rig.ok()) {
    fmt::print(stderr, "{}\n", rig.status().ToString());
    return 3;
  }
  const long frames = argc > 2 ? std::clamp(std::strtol(argv[2], nullptr, 10), 1L, 1000000L) : 240;
  const int world = Report(*rig, "worldMatrix", frames);
  return world != 0 ? world : Report(*rig, "matrix", frames);
}

}  // namespace
}  // namespace kpsa::engine

int main(int argc, char** argv) { return kpsa::engine::Main(argc, argv); }
