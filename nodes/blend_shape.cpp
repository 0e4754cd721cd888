// blendShape: weighted displacements, with in-betweens. combinationShape: the weight of a shape that corrects
// others.
#include "nodes/kernels/blend_shape.h"

#include <algorithm>
#include <span>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kNoShape = static_cast<std::size_t>(-1);

// A target that goes through other shapes on its way: piecewise linear in its weight, its first and last
// piece going on outside of 0 to 1.
struct Path {
  struct Stop {
    double at;
    std::size_t shape;
  };
  std::size_t target;
  std::vector<Stop> stops;  // ascending; the first is nothing at 0, the last the target itself at 1

  void Add(double weight, std::span<double> weights) const {
    std::size_t i = 0;
    while (i + 2 < stops.size() && weight > stops[i + 1].at) ++i;
    const double t = (weight - stops[i].at) / (stops[i + 1].at - stops[i].at);
    if (stops[i].shape != kNoShape) weights[stops[i].shape] += 1 - t;
    weights[stops[i + 1].shape] += t;
  }
};

using BlendShapeContext =
    DeformerContext<In<"weight", ArrayView<double>>, In<"pointWeights", ConstPointsView>>;

struct BlendShapeBound {
  BlendShapeKernel kernel;
  CarriedFrame frame;
  std::vector<Path> paths;  // by target
  std::size_t weight_floats;
  bool weighted;  // by pointWeights
};

Result<std::vector<Path>> ReadPaths(const Structural& s, std::size_t target_count) {
  const auto& targets = s.value("inbetweenTarget").get<std::vector<std::int64_t>>();
  const auto& shapes = s.value("inbetweenShape").get<std::vector<std::int64_t>>();
  const auto& places = s.value("inbetweenWeight").get<std::vector<double>>();
  if (targets.size() != shapes.size() || targets.size() != places.size()) {
    return Status::Invalid(
        "inbetweenTarget, inbetweenShape and inbetweenWeight have {}, {} and {} entries, "
        "expected as many",
        targets.size(), shapes.size(), places.size());
  }
  std::vector<Path> paths;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const auto count = static_cast<std::int64_t>(target_count);
    if (targets[i] < 0 || targets[i] >= count || shapes[i] < 0 || shapes[i] >= count) {
      return Status::Invalid("in-between {}: expected numbers of targets from 0 to {}", i, count - 1);
    }
    if (targets[i] == shapes[i]) return Status::Invalid("in-between {}: target {} is its own", i, targets[i]);
    if (!(places[i] > 0 && places[i] < 1))
      return Status::Invalid("in-between {}: a weight of {}, expected more than 0 and less than 1", i,
                             places[i]);
    const auto target = static_cast<std::size_t>(targets[i]);
    auto path = std::find_if(paths.begin(), paths.end(), [&](const Path& p) { return p.target == target; });
    if (path == paths.end()) path = paths.insert(path, {target, {{0, kNoShape}, {1, target}}});
    const auto after = std::find_if(path->stops.begin(), path->stops.end(),
                                    [&](const Path::Stop& stop) { return stop.at >= places[i]; });
    if (after->at == places[i])
      return Status::Invalid("in-between {}: target {} has two at {}", i, target, places[i]);
    path->stops.insert(after, {places[i], static_cast<std::size_t>(shapes[i])});
  }
  return paths;
}

Result<BoundKernel> BindBlendShape(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto* asset = s.asset<MorphTargets>("targets");
  if (asset == nullptr) return Status::Invalid("targets are not set");
  const PointSet& out = binding.output("outPoints");
  if (asset->point_count() != out.total()) {
    return Status::Invalid("its targets are for {} points, the geometry has {}", asset->point_count(),
                           out.total());
  }
  std::vector<BlendTarget> targets;
  for (const MorphTargets::Target& target : asset->targets())
    targets.push_back({target.points, target.deltas});
  const BlendShapeTargets all{out.total(), targets};
  KPSA_RETURN_IF_ERROR(all.Validate());
  Result<std::vector<Path>> paths = ReadPaths(s, targets.size());
  if (!paths.ok()) return paths.status();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  BlendShapeBound bound{BlendShapeKernel(all, out.ToVector(), BoundWeights(binding)), *frame,
                        std::move(*paths), (2 * targets.size() + 15) / 16 * 16,
                        binding.input("pointWeights").total() > 0};
  std::size_t scratch = bound.weight_floats + (bound.kernel.ScratchFloats() + 15) / 16 * 16;
  if (!frame->fixed() || bound.weighted) scratch += 3 * PaddedCount(out.size());
  return MakeBound(std::move(bound), scratch);
}

bool IsTurned(const Matrix4& motion) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      if (motion(r, c) != (r == c ? 1 : 0)) return true;
    }
  }
  return false;
}

void ComputeBlendShape(BlendShapeContext c) {
  const auto& bound = c.kernel_as<BlendShapeBound>();
  const ArrayView<double> weight = c.get<"weight">();
  const std::span<double> weights(reinterpret_cast<double*>(c.scratch()), bound.kernel.target_count());
  for (std::uint32_t i = 0; i < weights.size(); ++i) weights[i] = i < weight.size() ? weight[i] : 0.0;
  for (const Path& path : bound.paths) weights[path.target] = 0;
  for (const Path& path : bound.paths) {
    const auto target = static_cast<std::uint32_t>(path.target);
    path.Add(target < weight.size() ? weight[target] : 0.0, weights);
  }
  const Parallel parallel = HostParallel(c);
  const BlendShapeKernel::Inputs inputs{weights, c.get<"envelope">()};
  float* scratch = c.scratch() + bound.weight_floats;
  const std::span<float> kernel_scratch(scratch, bound.kernel.ScratchFloats());
  const ConstPointsView& in = c.get<"inPoints">();
  const PointsView& out = c.out<"outPoints">();
  const Matrix4 motion = bound.frame.Motion(c.get<"parentMatrix">());
  if (!bound.weighted && !IsTurned(motion)) {
    bound.kernel.Run(inputs, in, out, kernel_scratch, &parallel);
    return;
  }
  // Displacements alone, then weighted, and turned with the parent
  scratch += (kernel_scratch.size() + 15) / 16 * 16;
  const std::size_t row = PaddedCount(in.count);
  std::fill_n(scratch, 3 * row, 0.0f);
  const PointsView sums{scratch, scratch + row, scratch + 2 * row, in.count};
  bound.kernel.Run(inputs, sums, sums, kernel_scratch, &parallel);
  const float* shares = bound.weighted ? c.get<"pointWeights">().x : nullptr;
  c.For(in.count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double share = shares == nullptr ? 1.0 : shares[i];
      const Double3 sum = Double3{sums.x[i], sums.y[i], sums.z[i]} * share;
      const Double3 delta = TransformVector(motion, sum);
      const bool moves = !(sum == Double3());
      out.x[i] = moves ? static_cast<float>(in.x[i] + delta.x) : in.x[i];
      out.y[i] = moves ? static_cast<float>(in.y[i] + delta.y) : in.y[i];
      out.z[i] = moves ? static_cast<float>(in.z[i] + delta.z) : in.z[i];
    }
  });
}

void DemandBlendShape(Demand& demand) {
  demand.Require("inPoints", 0, demand.output("outPoints"));
  if (demand.input_total("pointWeights") > 0) demand.Require("pointWeights", 0, demand.output("outPoints"));
}

enum class CombinationMethod { kMultiply, kLowestWeighting, kSmooth };

// Of weights below 0 all methods but the product make nothing: a shape that is pulled the other way needs no
// correction.
double Combine(ArrayView<double> weights, CombinationMethod method) {
  if (weights.size() == 0) return 0;
  double product = weights[0], lowest = weights[0], inverses = 0;
  for (std::uint32_t i = 0; i < weights.size(); ++i) {
    if (i > 0) product *= weights[i];
    lowest = std::min(lowest, weights[i]);
    inverses += 1 / weights[i];
  }
  if (method == CombinationMethod::kMultiply) return product;
  if (!(lowest > 0)) return 0;
  return method == CombinationMethod::kLowestWeighting ? lowest : weights.size() / inverses;
}

void DeclareBlendShape(NodeBuilder& b) {
  b.structural("targets", Type::kAsset, {.doc = "the target shapes"}).per_geometry();
  b.in("weight", 0.0, {.doc = "one for each target; weight[name] works, too"}).array();
  b.points_in(
       "pointWeights",
       "a factor for each point that may vary, as the compress of a tension; 1 where nothing drives it",
       Type::kWeights)
      .per_geometry();
  b.structural("inbetweenTarget", std::vector<std::int64_t>{},
               {.doc = "targets that go through other shapes; `inbetweens:` sets the three lists"});
  b.structural("inbetweenShape", std::vector<std::int64_t>{}, {.doc = "the targets that are these shapes"});
  b.structural("inbetweenWeight", std::vector<double>{},
               {.doc = "the weights at which the targets are these shapes; more than 0, less than 1"});
}

}  // namespace

KPSA_NODES(blend_shape, registry) {
  AddDeformer<ComputeBlendShape>(
      registry, {.name = "blendShape",
                 .doc = "Adds weighted displacements towards target shapes (morph targets). They are those "
                        "of the file, in the axes of mesh space, wherever the stage is; after a skin they "
                        "turn as parentMatrix has turned since the rest pose.",
                 .own = DeclareBlendShape,
                 .bind = BindBlendShape,
                 .demand = DemandBlendShape})
      .cost(300, 5);

  registry.add("combinationShape", "The weight of a shape that acts where others act together.")
      .category("deformer")
      .in("inputWeight", 0.0, {.doc = "the weights of the others"})
      .array()
      .enumeration<CombinationMethod>(
          "combinationMethod",
          {{"multiply", CombinationMethod::kMultiply},
           {"lowestWeighting", CombinationMethod::kLowestWeighting},
           {"smooth", CombinationMethod::kSmooth}},
          false, "their product, the lowest, or their harmonic mean: as the lowest, without its kink")
      .out("outputWeight", Type::kDouble)
      .compute([](ArrayView<double> weights, CombinationMethod method) { return Combine(weights, method); });
}

}  // namespace kpsa::engine
