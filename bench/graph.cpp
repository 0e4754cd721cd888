// What the engine costs around nodes that do next to nothing: nanoseconds and bytes a node on large graphs,
// beside naive twins (plain calls in order; a recursive lazy pull over node objects) that compute the same
// values.
//   bench_graph [nodes]          100,000 if not given
// Exit status 1 if a goal is missed.
#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>

#include "base/check.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"

namespace kpsa::engine {
namespace {

constexpr double kGoalColdNs = 25, kGoalBytes = 200;  // a node
constexpr int kControls = 10;
constexpr Index kLayer = 1000;

double Mix(double a, double b) { return a * 0.5 + b * 0.25 + 1; }

using Clock = std::chrono::steady_clock;
double Since(Clock::time_point start) {
  return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

// The least of several runs, each after a preparation that is not timed.
double Least(const std::function<void(int)>& prepare, const std::function<void()>& run) {
  double best = 1e30;
  const auto start = Clock::now();
  for (int i = 0; i < 1000 && (i < 10 || Since(start) < 5e8); ++i) {
    prepare(i);
    const auto before = Clock::now();
    run();
    best = std::min(best, Since(before));
  }
  return best;
}

std::size_t HeapBytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

// Where node i takes its inputs from: a node before it, or control -1 - k.
struct Shape {
  const char* name;
  std::vector<std::array<int, 2>> inputs;
};

Shape Chain(Index count) {
  Shape shape{"chain", {}};
  for (Index i = 0; i < count; ++i)
    shape.inputs.push_back({i == 0 ? -1 : static_cast<int>(i) - 1, -1 - static_cast<int>(i * 7 % kControls)});
  return shape;
}

// Layers of a thousand nodes that each read two of the layer before.
Shape Layered(Index count) {
  Shape shape{"layered", {}};
  for (Index i = 0; i < count; ++i) {
    const Index layer = i / kLayer, at = i % kLayer;
    if (layer == 0) {
      shape.inputs.push_back(
          {-1 - static_cast<int>(at % kControls), -1 - static_cast<int>(at / kControls % kControls)});
    } else {
      const Index before = (layer - 1) * kLayer;
      shape.inputs.push_back(
          {static_cast<int>(before + at), static_cast<int>(before + (at + layer) % kLayer)});
    }
  }
  return shape;
}

// The naive twin that pulls: every node knows its inputs and readers and computes when asked.
struct LazyNode {
  std::function<double(double, double)> compute;
  LazyNode* inputs[2] = {};
  std::vector<LazyNode*> readers;
  double value = 0;
  bool dirty = true;

  double Pull() {
    if (!dirty) return value;
    dirty = false;
    return value = compute(inputs[0]->Pull(), inputs[1]->Pull());
  }
  void Dirty() {
    if (dirty) return;
    dirty = true;
    for (LazyNode* reader : readers) reader->Dirty();
  }
  void Set(double v) {
    if (value == v) return;
    value = v;
    for (LazyNode* reader : readers) reader->Dirty();
  }
};

// Runs on a stack of a gigabyte (of address space): the naive pull recurses as deep as the graph is.
void OnDeepStack(std::function<void()> body) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  KPSA_CHECK_EQ(pthread_attr_setstacksize(&attributes, std::size_t{1} << 30), 0);
  pthread_t thread;
  const auto entry = [](void* f) -> void* { return (*static_cast<std::function<void()>*>(f))(), nullptr; };
  KPSA_CHECK_EQ(pthread_create(&thread, &attributes, entry, &body), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
}

struct Times {
  double cold = 0, warm = 0, moved = 0;  // nanoseconds in total
};

void PrintRow(const char* name, const Times& times, std::size_t nodes) {
  fmt::print("  {:<28} cold {:>6.2f} ns a node   warm {:>9.0f} ns   one control moved {:>6.2f} ns a node\n",
             name, times.cold / static_cast<double>(nodes), times.warm,
             times.moved / static_cast<double>(nodes));
}

// Plain calls in order have no state: they always compute everything.
double RunPlain(const Shape& shape, const std::vector<double>& controls, Times* times) {
  double (*volatile hidden)(double, double) = Mix;
  double (*mix)(double, double) = hidden;  // a call through a pointer, as a node's is
  std::vector<double> values(shape.inputs.size());
  const auto all = [&] {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto [a, b] = shape.inputs[i];
      values[i] =
          mix(a < 0 ? controls[static_cast<std::size_t>(-1 - a)] : values[static_cast<std::size_t>(a)],
              b < 0 ? controls[static_cast<std::size_t>(-1 - b)] : values[static_cast<std::size_t>(b)]);
    }
  };
  times->cold = times->warm = times->moved = Least([](int) {}, all);
  return values.back();
}

double RunLazy(const Shape& shape, const std::vector<double>& controls, Times* times) {
  std::vector<LazyNode> nodes(shape.inputs.size()), leaves(controls.size());
  for (std::size_t k = 0; k < controls.size(); ++k) {
    leaves[k].dirty = false;
    leaves[k].value = controls[k];
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].compute = Mix;
    for (std::size_t p = 0; p < 2; ++p) {
      const int from = shape.inputs[i][p];
      nodes[i].inputs[p] =
          from < 0 ? &leaves[static_cast<std::size_t>(-1 - from)] : &nodes[static_cast<std::size_t>(from)];
      nodes[i].inputs[p]->readers.push_back(&nodes[i]);
    }
  }
  const std::size_t roots = std::min<std::size_t>(nodes.size(), kLayer);
  const auto pull = [&] {
    for (std::size_t i = nodes.size() - roots; i < nodes.size(); ++i) nodes[i].Pull();
  };
  double result = 0;
  OnDeepStack([&] {
    times->cold = Least(
        [&](int) {
          for (LazyNode& node : nodes) node.dirty = true;
        },
        pull);
    result = nodes.back().value;
    times->warm = Least([](int) {}, pull);
    int run = 0;
    times->moved = Least([](int) {},
                         [&] {
                           leaves[0].Set(++run);
                           pull();
                         });
  });
  return result;
}

bool Report(const Shape& shape) {
  const std::size_t count = shape.inputs.size();
  NodeRegistry registry;
  registry.add("mix", "Mixes.")
      .in("a", 0.0)
      .in("b", 0.0)
      .out("out", Type::kDouble)
      .compute([](double a, double b) { return Mix(a, b); });
  const NodeDef& def = *registry.Find("mix");
  const int a = def.FindAttribute("a"), b = def.FindAttribute("b"), out = def.FindAttribute("out");

  auto start = Clock::now();
  auto graph = std::make_unique<Graph>(registry);
  Request request;
  std::vector<NodeId> nodes;
  const auto must = [](const Status& status) { KPSA_CHECK(status.ok()); };
  for (int k = 0; k < kControls; ++k) {
    nodes.push_back(*graph->AddNode("mix", fmt::format("control{}", k)));
    request.varying.push_back({nodes.back(), a, -1, -1});
  }
  for (std::size_t i = 0; i < count; ++i) nodes.push_back(*graph->AddNode("mix", fmt::format("n{}", i)));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t p = 0; p < 2; ++p) {
      const int from = shape.inputs[i][p];
      const PlugRef source = from < 0
                                 ? request.varying[static_cast<std::size_t>(-1 - from)]
                                 : PlugRef{nodes[static_cast<std::size_t>(kControls + from)], out, -1, -1};
      must(graph->Connect(source, {nodes[kControls + i], p == 0 ? a : b, -1, -1}));
    }
  }
  for (std::size_t i = count - std::min<std::size_t>(count, kLayer); i < count; ++i)
    request.outputs.push_back({{nodes[kControls + i], out, -1, -1}, {}});
  const double build = Since(start);

  start = Clock::now();
  auto compiler = std::make_unique<Compiler>();
  Result<std::shared_ptr<const Plan>> plan = compiler->Compile(*graph, request);
  KPSA_CHECK(plan.ok());
  KPSA_CHECK_EQ((*plan)->steps().size(), count);
  const double compile = Since(start);

  // What a second compilation adds to the heap is the plan: the graph and the compiler have grown already
  const std::size_t before_plan = HeapBytes();
  Result<std::shared_ptr<const Plan>> second = compiler->Compile(*graph, request);
  const std::size_t plan_bytes = HeapBytes() - before_plan;
  const std::size_t before_evaluator = HeapBytes();
  Evaluator evaluator(*second);
  const std::size_t evaluator_bytes = HeapBytes() - before_evaluator;

  std::vector<double> controls(kControls);
  for (Index k = 0; k < kControls; ++k) {
    controls[k] = 0.25 * k - 1;
    evaluator.Set(k, controls[k]);
  }
  Times engine, plain, lazy;
  engine.cold = Least([&](int) { evaluator.Invalidate(); }, [&] { must(evaluator.Evaluate()); });
  const double value = evaluator.Get<double>(static_cast<Index>(request.outputs.size() - 1));
  engine.warm = Least([](int) {}, [&] { must(evaluator.Evaluate()); });
  int run = 0;
  engine.moved = Least([](int) {},
                       [&] {
                         evaluator.Set(0, ++run);
                         must(evaluator.Evaluate());
                       });
  const double plain_value = RunPlain(shape, controls, &plain), lazy_value = RunLazy(shape, controls, &lazy);
  const bool same = value == plain_value && value == lazy_value;

  const double cold = engine.cold / static_cast<double>(count);
  const double bytes = static_cast<double>(plan_bytes + evaluator_bytes) / static_cast<double>(count);
  fmt::print(
      "{}, {} nodes: build {:.0f} ms, compile {:.0f} ms; plan {:.0f} + evaluator {:.0f} bytes a node\n",
      shape.name, count, build * 1e-6, compile * 1e-6,
      static_cast<double>(plan_bytes) / static_cast<double>(count),
      static_cast<double>(evaluator_bytes) / static_cast<double>(count));
  PrintRow("engine", engine, count);
  PrintRow("naive: plain calls", plain, count);
  PrintRow("naive: recursive lazy pull", lazy, count);
  if (!same) fmt::print("  VALUES DIFFER: {} {} {}\n", value, plain_value, lazy_value);
  if (cold > kGoalColdNs) fmt::print("  MISSES THE GOAL of {} ns a node, cold\n", kGoalColdNs);
  if (bytes > kGoalBytes) fmt::print("  MISSES THE GOAL of {} bytes a node: {:.0f}\n", kGoalBytes, bytes);
  return same && cold <= kGoalColdNs && bytes <= kGoalBytes;
}

int Main(int argc, char** argv) {
  const long count = argc > 1 ? std::strtol(argv[1], nullptr, 10) : 100000;
  if (count < 1 || count > 10000000) {
    fmt::print(stderr, "usage: bench_graph [nodes]   1 to 10,000,000 nodes; 100,000 if not given\n");
    return 2;
  }
  const bool chain = Report(Chain(static_cast<Index>(count)));
  const bool layered = Report(Layered(static_cast<Index>(count)));
  return chain && layered ? 0 : 1;
}

}  // namespace
}  // namespace kpsa::engine

int main(int argc, char** argv) { return kpsa::engine::Main(argc, argv); }
