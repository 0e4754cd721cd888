// poseInterpolator: weights of named poses of a transform (Maya's node of this name), for shapes and values
// that belong to poses.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/matrix.h"
#include "nodes/choices.h"
#include "nodes/deformer.h"
#include "nodes/kernels/pose_weights.h"
#include "nodes/kernels/transform_math.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

struct PoseBound {
  PoseWeights weights;
  Matrix4 rest;
};

Result<BoundKernel> BindPoses(const Binding& binding) {
  const Structural& s = binding.structural();
  const std::vector<double>& angles = s.value("poseAngles").get<std::vector<double>>();
  if (angles.empty()) return Status::Invalid("poseAngles: there are no poses");
  if (angles.size() % 3 != 0)
    return Status::Invalid("poseAngles: expected three angles a pose, found {} numbers", angles.size());
  PoseSettings settings;
  settings.space.part = s.choice<PoseSpace::Part>("poseType");
  settings.space.twist_axis = UnitVector(s.choice<Axis>("twistAxis"));
  settings.basis = s.choice<PoseBasis>("interpolation");
  settings.radius = s.get_double("radius");
  settings.regularization = s.get_double("regularization");
  settings.normalize = s.get_bool("normalize");
  const auto order = s.choice<RotateOrder>("rotateOrder");
  std::vector<Quaternion> poses;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < angles.size(); i += 3) {
    poses.push_back(
        QuaternionFromRotation(RotationFromEuler({angles[i], angles[i + 1], angles[i + 2]}, order)));
    names.push_back(fmt::format("{}", i / 3));
  }
  // The poses' names, where the rig gives them: one string, a line each
  const std::string& lines = s.value("poseNames").get<std::string>();
  for (std::size_t i = 0, at = 0; i < names.size() && at < lines.size(); ++i) {
    const std::size_t end = std::min(lines.find('\n', at), lines.size());
    names[i] = lines.substr(at, end - at);
    at = end + 1;
  }
  Result<PoseWeights> weights = PoseWeights::Bind(settings, poses, names);
  if (!weights.ok()) return weights.status();
  const std::size_t floats = 2 * weights->pose_count();
  return MakeBound(PoseBound{std::move(*weights), s.value("restMatrix").get<Matrix4>()}, floats);
}

void ComputePoses(NodeContext<In<"matrix", Matrix4>, Out<"outputWeight", OutArray<double>>> c) {
  const auto& bound = c.kernel_as<PoseBound>();
  const std::span<double> weights(reinterpret_cast<double*>(c.scratch()), bound.weights.pose_count());
  bound.weights.Run(PoseRotation(c.get<"matrix">(), bound.rest), weights);
  const OutArray<double> out = c.out<"outputWeight">();
  for (std::uint32_t i = 0; i < out.size(); ++i) out[i] = i < weights.size() ? weights[i] : 0.0;
}

}  // namespace

KPSA_NODES(pose_interpolator, registry) {
  registry
      .add("poseInterpolator",
           "How near a transform is to each of a few poses: 1 at a pose itself, 0 at the others.")
      .in("matrix", Matrix4(), {.doc = "the transform's local matrix; `driver:` connects it"})
      .structural("restMatrix", Matrix4(), {.doc = "the same at rest: poses are turns from it"})
      .structural("poseAngles", std::vector<double>{},
                  {.unit = Unit::kAngle, .doc = "three angles a pose; in rigs a map, name: [x, y, z]"})
      .structural("poseNames", "", {.doc = "of the poses, one a line; `poses:` sets it"})
      .enumeration<RotateOrder>("rotateOrder", kRotateOrders, true, "of the poses' angles")
      .enumeration<PoseSpace::Part>(
          "poseType",
          {{"swingAndTwist", PoseSpace::Part::kSwingAndTwist},
           {"swing", PoseSpace::Part::kSwing},
           {"twist", PoseSpace::Part::kTwist}},
          true, "what of a rotation counts: all of it, where the twist axis points, or the turn about it")
      .enumeration<Axis>("twistAxis", kAxes, true, "the axis of swing and twist")
      .enumeration<PoseBasis>("interpolation",
                              {{"gaussian", PoseBasis::kGaussian},
                               {"thinPlate", PoseBasis::kThinPlate},
                               {"linear", PoseBasis::kLinear}},
                              true, "the radial function: exp(-(d/r)^2), d^2 log d, or d")
      .structural("radius", 0.0,
                  {.min = 0,
                   .unit = Unit::kAngle,
                   .doc = "of gaussian; 0: the mean distance of the poses from their nearest other"})
      .structural("regularization", 0.0,
                  {.min = 0, .doc = "above 0: smoother, and no longer exactly 1 at the poses"})
      .structural("normalize", false, {.doc = "no weight is below 0, and all sum to 1"})
      .out("outputWeight", Type::kDouble, "by pose: outputWeight[0], or outputWeight[name]")
      .array()
      .compute<ComputePoses>()
      .bind(BindPoses)
      .cost(400, 0);
}

}  // namespace kpsa::engine
