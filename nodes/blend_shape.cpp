// blendShape: weighted displacements, with in-betweens. combinationShape: the weight of a shape that corrects
// others.
#include "nodes/kernels/blend_shape.h"

#include <algorithm>
#include <span>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/shape_paths.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using BlendShapeContext =
    DeformerContext<In<"weight", ArrayView<double>>, In<"pointWeights", ConstPointsView>>;

struct BlendShapeBound {
  BlendShapeKernel kernel;
  CarriedFrame frame;
  ShapePaths paths;
  std::size_t weight_floats;
  bool weighted;  // by pointWeights
};

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
  Result<ShapePaths> paths =
      ShapePaths::Make(s.value("inbetweenTarget").get<std::vector<std::int64_t>>(),
                       s.value("inbetweenShape").get<std::vector<std::int64_t>>(),
                       s.value("inbetweenWeight").get<std::vector<double>>(), targets.size());
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
  const auto weight_of = [&](std::size_t target) {
    const auto i = static_cast<std::uint32_t>(target);
    return i < weight.size() ? weight[i] : 0.0;
  };
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = weight_of(i);
  bound.paths.Apply(weight_of, weights);
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
      .cost(100, 0.6f);

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
