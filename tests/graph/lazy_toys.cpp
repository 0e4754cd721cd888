#include "tests/graph/lazy_toys.h"

#include "tests/support/toy_nodes.h"

namespace kpsa::engine {
namespace {

struct PatchKernel {
  std::vector<std::pair<std::uint32_t, Index>> from;  // by output point: the patch, and where in it
};

std::uint32_t PatchOf(Index point, int patches) { return point % static_cast<Index>(patches); }

void ComputePatches(ComputeContext& c) {
  const auto chosen = static_cast<std::uint64_t>(c.get<std::int64_t>(0));
  const ArrayView<ConstPointsView> patch = c.array<ConstPointsView>(1), all = c.array<ConstPointsView>(2);
  const PointsView& out = c.out_points(0);
  const auto& from = c.kernel_as<PatchKernel>().from;
  for (std::size_t i = 0; i < out.count; ++i) {
    out.x[i] = out.y[i] = out.z[i] = -1;
    if ((chosen >> patch.size() & 1) != 0) {
      out.x[i] = all[0].x[i], out.y[i] = all[0].y[i], out.z[i] = all[0].z[i];
    } else if ((chosen >> from[i].first & 1) != 0) {
      const ConstPointsView& p = patch[from[i].first];
      const Index at = from[i].second;
      out.x[i] = p.x[at], out.y[i] = p.y[at], out.z[i] = p.z[at];
    }
  }
}

void AddLazyToys(NodeRegistry& registry, bool lazy) {
  AddToyNodes(registry);
  NodeBuilder patches = registry.add("patches", "Each point from a patch of its own.");
  patches.structural("count", std::int64_t{kPatchPoints}).in("chosen", 0).points_in("patch").array();
  if (lazy) patches.lazy();
  patches.points_in("all").array();
  if (lazy) patches.lazy(true);
  patches.out("outPoints", Type::kPoints).compute(ComputePatches);
  if (lazy) {
    patches.decide([](ComputeContext& c) -> std::uint64_t {
      return static_cast<std::uint64_t>(c.get<std::int64_t>(0));
    });
  }
  patches
      .demand([](Demand& d) {
        const int count = d.structural().array_size("patch");
        std::vector<std::vector<Index>> points(static_cast<std::size_t>(count));
        for (Index point : d.output("outPoints").ToVector()) points[PatchOf(point, count)].push_back(point);
        for (int e = 0; e < count; ++e)
          d.Require("patch", e, PointSet::Of(points[static_cast<std::size_t>(e)], kPatchPoints));
        d.Require("all", 0, d.output("outPoints"));
      })
      .bind([](const Binding& b) -> Result<BoundKernel> {
        auto kernel = std::make_shared<PatchKernel>();
        const int count = b.structural().array_size("patch");
        for (Index point : b.output("outPoints").ToVector()) {
          const std::uint32_t e = PatchOf(point, count);
          const PointSet one = PointSet::Of({point}, kPatchPoints);
          kernel->from.emplace_back(e, b.input("patch", static_cast<int>(e)).PositionsOf(one)[0]);
        }
        return BoundKernel{kernel, 0, 0};
      })
      .point_count([](const Structural& s, std::string_view, int) -> Result<Index> {
        return static_cast<Index>(s.get_int("count"));
      })
      .cost(20000, 2);
  NodeBuilder pick = registry.add("pick", "The sum of some.");
  pick.in("chosen", 0).in("input", 0.0).array();
  if (lazy) pick.lazy();
  pick.out("out", Type::kDouble).compute([](std::int64_t chosen, ArrayView<double> input) {
    double sum = 0;
    for (std::uint32_t i = 0; i < input.size(); ++i) sum += (chosen >> i & 1) != 0 ? input[i] : 0;
    return sum;
  });
  if (lazy) {
    pick.decide([](ComputeContext& c) -> std::uint64_t {
      return static_cast<std::uint64_t>(c.get<std::int64_t>(0));
    });
  }
}

}  // namespace

const NodeRegistry& LazyToys(bool lazy) {
  static const NodeRegistry* const registries = [] {
    auto* both = new NodeRegistry[2];
    AddLazyToys(both[0], false);
    AddLazyToys(both[1], true);
    return both;
  }();
  return registries[lazy ? 1 : 0];
}

int SharedSegments(const Plan& plan) {
  int count = 0;
  for (const Plan::Segment& segment : plan.segments()) count += !segment.users.empty();
  return count;
}

std::string OutputBytes(const Evaluator& evaluator) {
  std::string bytes;
  const auto add = [&](const void* from, std::size_t size) {
    bytes.append(static_cast<const char*>(from), size);
  };
  for (Index i = 0; i < evaluator.plan().outputs().size(); ++i) {
    if (evaluator.plan().outputs()[i].type != Type::kPoints) {
      add(&evaluator.Get<double>(i), sizeof(double));
      continue;
    }
    const ConstPointsView points = evaluator.Points(i);
    for (const float* component : {points.x, points.y, points.z})
      add(component, points.count * sizeof(float));
  }
  return bytes;
}

}  // namespace kpsa::engine
