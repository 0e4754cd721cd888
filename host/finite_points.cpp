#include "host/finite_points.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <string>

#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

bool IsFinite(ConstPointsView points, std::size_t i) {
  return std::isfinite(points.x[i]) && std::isfinite(points.y[i]) && std::isfinite(points.z[i]);
}

bool AreFinite(ConstPointsView points) {
  constexpr std::uint32_t kExponent = 0x7f800000;  // all of its bits are set in infinities and NaNs
  bool wrong = false;
  for (const float* row : {points.x, points.y, points.z}) {
    for (std::size_t i = 0; i < points.count; ++i)
      wrong |= (std::bit_cast<std::uint32_t>(row[i]) & kExponent) == kExponent;
  }
  return !wrong;
}

// " after node "mush" (deltaMush)", or "" where it cannot be told.
std::string FirstNode(const Rig& rig, const CharacterMesh& mesh, double seconds, std::string* name) {
  Request request;
  request.varying.push_back(rig.scene.time);
  for (const Stage& stage : mesh.stages) request.outputs.push_back({stage.points, {}});
  Compiler compiler;
  const Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig.graph, request);
  if (!plan.ok()) return "";
  Evaluator evaluator(*plan);
  if (const Index time = (*plan)->FindVarying(rig.scene.time); time != kNoIndex) evaluator.Set(time, seconds);
  if (!evaluator.Evaluate().ok()) return "";
  for (Index s = 0; s < mesh.stages.size(); ++s) {
    if (AreFinite(evaluator.Points(s))) continue;
    *name = rig.graph->name(mesh.stages[s].node);
    return fmt::format(" after node \"{}\" ({})", *name, rig.graph->def(mesh.stages[s].node).name);
  }
  return "";
}

}  // namespace

Status CheckFinite(const Rig& rig, const CharacterMesh& mesh, ConstPointsView points, double seconds) {
  if (AreFinite(points)) return Status();
  for (Index v = 0; v < mesh.vertex_count; ++v) {
    const std::size_t i = mesh.mesh().data().vertex_to_point[v];
    if (IsFinite(points, i)) continue;
    std::string node;
    const std::string after = FirstNode(rig, mesh, seconds, &node);
    Status status = Status::Evaluation("at {} s: vertex {} of mesh \"{}\" is ({}, {}, {}), not finite{}",
                                       seconds, v, mesh.name, points.x[i], points.y[i], points.z[i], after)
                        .OfNode(node);
    const SourceLocation place = PlaceOf(rig, status.errors().front());
    return std::move(status).At(place);
  }
  return Status();
}

}  // namespace kpsa::engine
