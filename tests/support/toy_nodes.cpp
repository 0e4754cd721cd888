#include "tests/support/toy_nodes.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

struct SmoothKernel {
  std::vector<std::vector<Index>> neighbours;  // positions in the input set
};

Result<BoundKernel> BindSmooth(const Binding& binding) {
  const PointSet& out = binding.output("outPoints");
  const PointSet& in = binding.input("points");
  const int rings = binding.structural().get_int("rings");
  auto kernel = std::make_shared<SmoothKernel>();
  for (Index i = 0; i < out.size(); ++i) {
    kernel->neighbours.emplace_back();
    for (int d = -rings; d <= rings; ++d) {
      const auto n = static_cast<int>(out.total());
      const auto point = static_cast<Index>(((static_cast<int>(out[i]) + d) % n + n) % n);
      kernel->neighbours.back().push_back(in.PositionsOf(PointSet::Of({point}, in.total()))[0]);
    }
  }
  return BoundKernel{kernel, 0, 0};
}

void DemandSmooth(Demand& demand) {
  const PointSet& out = demand.output("outPoints");
  const int rings = demand.structural().get_int("rings");
  std::vector<Index> needed;
  for (Index i = 0; i < out.size(); ++i) {
    for (int d = -rings; d <= rings; ++d) {
      const auto n = static_cast<int>(out.total());
      needed.push_back(static_cast<Index>(((static_cast<int>(out[i]) + d) % n + n) % n));
    }
  }
  demand.Require("points", 0, PointSet::Of(needed, out.total()));
}

std::atomic<int> block_computes{0}, block_frames{0}, batch_computes{0};

void ComputeFloors(NodeBatch<In<"input", double>, Out<"out", double>> c) {
  ++batch_computes;
  for (std::size_t i = 0; i < c.count(); ++i) c.out<"out">(i) = std::floor(c.get<"input">(i));
}

void ComputeCached(ComputeContext& c) {
  const PointsView& out = c.out_points(0);
  const bool miss = c.chosen != 0;
  const double mean = c.state_as<double>();
  if (mean < c.get<double>(1)) return c.host->Fail("the cues are below the floor");
  for (std::size_t i = 0; i < out.count; ++i) {
    out.x[i] = miss ? c.points(3).x[i] : static_cast<float>(mean);
    out.y[i] = out.z[i] = 0;
  }
}

}  // namespace

const NodeRegistry& ToyRegistry() {
  static const NodeRegistry* registry = [] {
    auto* toys = new NodeRegistry;
    AddToyNodes(*toys);
    return toys;
  }();
  return *registry;
}

int TakeBatchComputes() { return batch_computes.exchange(0); }

BlockComputes TakeBlockComputes() { return {block_computes.exchange(0), block_frames.exchange(0)}; }

void AddToySelect(NodeRegistry& registry, const char* name, const char* doc, DecideFn decide) {
  registry.add(name, doc)
      .in("which", false)
      .in("a", 0.0)
      .lazy()
      .in("b", 0.0)
      .lazy()
      .out("out", Type::kDouble)
      .compute([](bool which, double a, double b) { return which ? b : a; })
      .decide(decide);
}

void AddToyRaise(NodeRegistry& registry, const char* name, const char* doc, Index forgotten) {
  registry.add(name, doc)
      .structural("first", 0)
      .points_in("points")
      .in("by", 0.0)
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) {
        const auto& raised = c.kernel_as<std::vector<bool>>();
        const double by = c.get<double>(1);
        for (std::size_t i = 0; i < c.points(0).count; ++i) {
          c.out_points(0).x[i] = c.points(0).x[i];
          c.out_points(0).y[i] = c.points(0).y[i];
          if (raised[i] && by != 0) c.out_points(0).y[i] += static_cast<float>(by);
          c.out_points(0).z[i] = c.points(0).z[i];
        }
      })
      .bind([](const Binding& b) -> Result<BoundKernel> {
        const auto first = static_cast<Index>(b.structural().get_int("first"));
        auto raised = std::make_shared<std::vector<bool>>();
        for (const Index point : b.output("outPoints").ToVector()) raised->push_back(point >= first);
        return BoundKernel{raised, 0, 0};
      })
      .in_place("points")
      .touches("points",
               [forgotten](const Structural& structural, const PointSet& points) {
                 const auto first = static_cast<Index>(structural.get_int("first")) + forgotten;
                 return std::ranges::any_of(points.ToVector(), [&](Index point) { return point >= first; });
               })
      .strength("by");
}

void AddToyNodes(NodeRegistry& registry) {
  registry.add("add", "Adds.")
      .in("a", 0.0)
      .in("b", 0.0)
      .out("out", Type::kDouble)
      .compute([](double a, double b) { return a + b; });
  registry.add("scale3", "Scales a vector.")
      .in("input", Double3())
      .in("factor", 1.0)
      .out("out", Type::kDouble3)
      .compute([](Double3 v, double f) { return v * f; })
      .passes("input", {"factor"});
  registry.add("floor", "Rounds down.")
      .in("input", 0.0)
      .out("out", Type::kDouble)
      .compute([](double v) { return std::floor(v); })
      .batch<ComputeFloors>(nullptr);
  registry.add("sum", "Adds many.")
      .in("input", 0.0)
      .array()
      .out("out", Type::kDouble)
      .compute([](ArrayView<double> values) {
        double sum = 0;
        for (std::uint32_t i = 0; i < values.size(); ++i) sum += values[i];
        return sum;
      })
      .cost(20000, 0);
  AddToySelect(registry, "select", "Takes one of two.",
               [](ComputeContext& c) -> std::uint64_t { return c.get<std::int64_t>(0) != 0 ? 2 : 1; });
  registry.add("fail", "Fails below zero.")
      .in("input", 0.0)
      .out("out", Type::kDouble)
      .compute([](ComputeContext& c) {
        if (c.get<double>(0) == kThrows) throw std::runtime_error("was told to throw");
        if (c.get<double>(0) < 0) return c.host->Fail("input is below zero");
        c.out_value<double>(0) = c.get<double>(0);
      });
  registry.add("source", "Points on a line.")
      .structural("count", 10)
      .in("step", 1.0)
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) {
        const auto& set = c.kernel_as<PointSet>();
        for (Index i = 0; i < set.size(); ++i) {
          c.out_points(0).x[i] = static_cast<float>(set[i] * c.get<double>(0));
          c.out_points(0).y[i] = c.out_points(0).z[i] = 0;
        }
      })
      .bind([](const Binding& b) -> Result<BoundKernel> {
        return BoundKernel{std::make_shared<PointSet>(b.output("outPoints")), 0, 0};
      })
      .point_count([](const Structural& s, std::string_view, int) -> Result<Index> {
        return static_cast<Index>(s.get_int("count"));
      });
  registry.add("move", "Moves points.")
      .points_in("points")
      .in("offset", 0.0)
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) {
        const auto offset = static_cast<float>(c.get<double>(1));
        for (std::size_t i = 0; i < c.points(0).count; ++i) {
          c.out_points(0).x[i] = c.points(0).x[i] + offset;
          c.out_points(0).y[i] = c.points(0).y[i];
          c.out_points(0).z[i] = c.points(0).z[i];
        }
      })
      .in_place("points")
      .cost(20000, 2);
  AddToyRaise(registry, "raise", "Raises the points from one on.", 0);
  registry.add("smooth", "Means over a ring.")
      .structural("rings", 1)
      .points_in("points")
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) {
        const auto& kernel = c.kernel_as<SmoothKernel>();
        for (std::size_t i = 0; i < kernel.neighbours.size(); ++i) {
          float x = 0;
          for (Index n : kernel.neighbours[i]) x += c.points(0).x[n];
          c.out_points(0).x[i] = x / static_cast<float>(kernel.neighbours[i].size());
          c.out_points(0).y[i] = c.out_points(0).z[i] = 0;
        }
      })
      .demand(DemandSmooth)
      .bind(BindSmooth)
      .cost(20000, 10);
  registry.add("measure", "Sum of x.")
      .points_in("points")
      .out("out", Type::kDouble)
      .compute([](ComputeContext& c) {
        double sum = 0;
        for (std::size_t i = 0; i < c.points(0).count; ++i) sum += c.points(0).x[i];
        c.out_value<double>(0) = sum;
      });
  registry.add("cached", "A stand-in for a slow stack.")
      .structural("cues", Type::kInts)
      .in("threshold", 0.0)
      .in("floor", -1e30)
      .points_in("cuePoints")
      .points_in("full")
      .lazy()
      .out("outPoints", Type::kPoints)
      .compute(ComputeCached)
      .decide([](ComputeContext& c) -> std::uint64_t {
        double sum = 0;
        for (std::size_t i = 0; i < c.points(2).count; ++i) sum += c.points(2).x[i];
        c.state_as<double>() = sum / static_cast<double>(c.points(2).count);
        return sum < c.get<double>(0) ? 0 : 1;
      })
      .block([](ComputeContext* contexts, std::size_t count) {
        ++block_computes;
        block_frames += static_cast<int>(count);
        for (std::size_t i = 0; i < count; ++i) ComputeCached(contexts[i]);
      })
      .demand([](Demand& d) {
        const auto& cues = d.structural().value("cues").get<std::vector<std::int64_t>>();
        d.Require("cuePoints", 0, PointSet::Of({cues.begin(), cues.end()}, d.input_total("cuePoints")));
        d.Require("full", 0, d.output("outPoints"));
      })
      .bind([](const Binding&) -> Result<BoundKernel> {
        return BoundKernel{nullptr, 0, sizeof(double)};
      });
  registry.add("trail", "Moves half of the way to its input, from where it was.")
      .stateful()
      .in("input", 0.0)
      .out("out", Type::kDouble)
      .compute([](ComputeContext& c) {
        auto& at = c.state_as<double>();
        at = (at + c.get<double>(0)) / 2;
        c.out_value<double>(0) = at;
      })
      .bind([](const Binding&) -> Result<BoundKernel> {
        return BoundKernel{nullptr, 0, sizeof(double)};
      });
  registry.add("twoWays", "Two values side by side.")
      .in("a", 0.0)
      .in("b", 0.0)
      .out("outA", Type::kDouble)
      .out("outB", Type::kDouble)
      .compute_for({"outA"}, {"a"}, [](double v) { return v + 1; })
      .compute_for({"outB"}, {"b"}, [](double v) { return v * 2; });
  registry.add("choice", "Takes one of many.")
      .in("selector", 0)
      .in("input", 0.0)
      .array()
      .lazy()
      .out("out", Type::kDouble)
      .compute([](std::int64_t selector, ArrayView<double> input) {
        return selector >= 0 && selector < input.size() ? input[static_cast<std::uint32_t>(selector)] : 0;
      })
      .decide([](ComputeContext& c) -> std::uint64_t {
        const std::int64_t selector = c.get<std::int64_t>(0);
        return selector < 0 || selector > kMostChoices ? 0 : std::uint64_t{1} << selector;
      });
  registry.add("together", "Adds all, or none.")
      .in("wanted", false)
      .in("input", 0.0)
      .array()
      .lazy(true)
      .in("other", 0.0)
      .lazy()
      .out("out", Type::kDouble)
      .compute([](ComputeContext& c) {
        const ArrayView<double> input = c.array<double>(1);
        double sum = (c.chosen & 2) != 0 ? c.get<double>(2) : 0;
        for (std::uint32_t i = 0; (c.chosen & 1) != 0 && i < input.size(); ++i) sum += input[i];
        c.out_value<double>(0) = sum;
      })
      .decide([](ComputeContext& c) -> std::uint64_t { return c.get<std::int64_t>(0) != 0 ? 1 : 2; });
  registry.add("shift", "A translation.")
      .in("offset", Double3())
      .out("out", Type::kMatrix)
      .compute([](Double3 offset) { return Translation(offset); });
  registry.add("chain", "A product.")
      .in("matrix", Matrix4())
      .array()
      .out("out", Type::kMatrix)
      .compute([](ArrayView<Matrix4> matrices) {
        Matrix4 all;
        for (std::uint32_t i = 0; i < matrices.size(); ++i) all = all * matrices[i];
        return all;
      })
      .cost(20000, 0);
  registry.add("carry", "A point in a matrix.")
      .in("matrix", Matrix4())
      .in("point", Double3())
      .out("out", Type::kDouble3)
      .compute([](const Matrix4& m, Double3 point) { return TransformPoint(m, point); });
  registry.add("carryPoints", "Points in a matrix.")
      .points_in("points")
      .in("matrix", Matrix4())
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) {
        const ConstPointsView& from = c.points(0);
        for (std::size_t i = 0; i < from.count; ++i) {
          const Double3 p = TransformPoint(c.get<Matrix4>(1), {from.x[i], from.y[i], from.z[i]});
          c.out_points(0).x[i] = static_cast<float>(p.x);
          c.out_points(0).y[i] = static_cast<float>(p.y);
          c.out_points(0).z[i] = static_cast<float>(p.z);
        }
      })
      .in_place("points")
      .cost(20000, 4);
  registry.add("picky", "Fails where it is told to.")
      .structural("where", 0)
      .structural("factor", 2.0)
      .points_in("points")
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) {
        if (c.kernel == nullptr) return c.host->Fail("cannot compute");
        for (std::size_t i = 0; i < c.points(0).count; ++i) {
          c.out_points(0).x[i] = c.points(0).x[i] * c.kernel_as<float>();
          c.out_points(0).y[i] = c.out_points(0).z[i] = 0;
        }
      })
      .bind([](const Binding& b) -> Result<BoundKernel> {
        const int where = b.structural().get_int("where");
        if (where == 1) return Status::Invalid("cannot bind");
        if (where == 4) return BoundKernel();
        return BoundKernel{std::make_shared<float>(static_cast<float>(b.structural().get_double("factor"))),
                           0, 0};
      })
      .demand([](Demand& d) {
        d.Require("points", 0,
                  d.structural().get_int("where") == 2 ? PointSet::All(3) : d.output("outPoints"));
      })
      .point_count([](const Structural& s, std::string_view, int) -> Result<Index> {
        if (s.get_int("where") == 3) return Status::Invalid("cannot count");
        return Index{10};
      });
  registry.add("grid", "Attributes of many kinds.")
      .structural("divisions", std::vector<std::int64_t>{2, 3, 2})
      .enumeration("mode", {"linear", "smooth"}, true)
      .in("size", 1.0, {.min = 0, .max = 10})
      .in("weight", 0.0)
      .array()
      .in("matrix", Matrix4())
      .in("center", Double3())
      .alias("pivot")
      .points_in("points")
      .grid("divisions")
      .default_from([](const Structural& s) {
        Index count = 1;
        for (std::int64_t n : s.value("divisions").get<std::vector<std::int64_t>>())
          count *= static_cast<Index>(n);
        return Value(PointBufferPtr(std::make_shared<PointBuffer>(count)));
      })
      .out("outPoints", Type::kPoints)
      .compute([](ComputeContext& c) {
        for (std::size_t i = 0; i < c.points(4).count; ++i) c.out_points(0).x[i] = c.points(4).x[i];
      });
}

}  // namespace kpsa::engine
