#include "host/explain/vertex_story.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "files/quantity.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

// Of one point, at one time: what is asked of the graph, in that order.
struct PointValues {
  std::vector<Double3> stages;    // after each
  std::vector<double> envelopes;  // of the stages that have one; 1 elsewhere
  std::vector<Matrix4> joints;    // world_from_joint, by the point's influences
  std::vector<double> weights;    // of the morph targets in `targets`
  Matrix4 node;                   // world_from_mesh of the mesh's node
};

struct Touching {  // a morph target that moves the point
  Index target = 0;
  Double3 delta;  // in the mesh's space
};

std::vector<Touching> TargetsOf(const CharacterMesh& mesh, Index point) {
  std::vector<Touching> touching;
  if (mesh.geometry.targets == nullptr) return touching;
  const auto& targets = mesh.geometry.targets->targets();
  for (Index k = 0; k < targets.size(); ++k) {
    const auto it = std::lower_bound(targets[k].points.begin(), targets[k].points.end(), point);
    if (it == targets[k].points.end() || *it != point) continue;
    const float* delta = &targets[k].deltas[3 * static_cast<std::size_t>(it - targets[k].points.begin())];
    touching.push_back({k, {delta[0], delta[1], delta[2]}});
  }
  return touching;
}

int AttributeOf(const Rig& rig, NodeId node, std::string_view name) {
  return rig.graph->def(node).FindAttribute(name);
}

Result<PointValues> Read(const Rig& rig, const CharacterMesh& mesh, Index point,
                         const std::vector<Touching>& touching, double time) {
  Request request;
  request.varying.push_back(rig.scene.time);
  const auto want = [&](const PlugRef& plug) { request.outputs.push_back({plug, {}}); };
  for (const Stage& stage : mesh.stages)
    request.outputs.push_back({stage.points, PointSet::Of({point}, mesh.mesh().point_count())});
  for (const Stage& stage : mesh.stages) {
    const int envelope = AttributeOf(rig, stage.node, "envelope");
    if (envelope >= 0) want({stage.node, envelope, -1, -1});
  }
  std::size_t joints = 0;
  if (mesh.influences != nullptr) {
    const auto& offsets = mesh.influences->offsets();
    for (Index i = offsets[point]; i < offsets[point + 1]; ++i, ++joints) {
      const NodeId joint = mesh.influence_nodes[mesh.influences->joints()[i]];
      want({joint, AttributeOf(rig, joint, "worldMatrix"), -1, -1});
    }
  }
  for (const Touching& t : touching)
    want({mesh.blend_shape, AttributeOf(rig, mesh.blend_shape, "weight"), static_cast<int>(t.target), -1});
  want({mesh.transform, AttributeOf(rig, mesh.transform, "worldMatrix"), -1, -1});

  Compiler compiler;
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  PointValues values;
  RigFrameOptions options;
  options.threads = 1;
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, {time}, options, [&](std::size_t, const Evaluator& evaluator) {
        Index at = 0;
        for (; at < mesh.stages.size(); ++at) {
          const ConstPointsView view = evaluator.Points(at);
          values.stages.push_back({view.x[0], view.y[0], view.z[0]});
        }
        for (const Stage& stage : mesh.stages) {
          const bool has = AttributeOf(rig, stage.node, "envelope") >= 0;
          values.envelopes.push_back(has ? evaluator.Get<double>(at++) : 1);
        }
        for (std::size_t j = 0; j < joints; ++j) values.joints.push_back(evaluator.Get<Matrix4>(at++));
        for (std::size_t k = 0; k < touching.size(); ++k)
          values.weights.push_back(evaluator.Get<double>(at++));
        values.node = evaluator.Get<Matrix4>(at);
        return Status();
      }));
  return values;
}

double WeightOf(const Rig& rig, const Stage& stage, Index point) {
  const int weights = AttributeOf(rig, stage.node, "weights");
  if (weights < 0) return 1;
  const Value* value = rig.graph->FindValue({stage.node, weights, stage.geometry, -1});
  const WeightMap* map = value == nullptr ? nullptr : value->asset<WeightMap>();
  return map == nullptr || point >= map->weights().size() ? 1 : static_cast<double>(map->weights()[point]);
}

// What a shift in the mesh's space is in the world in the rest pose: a mesh may be stored in any units, and its skin says
// what they are.
Double3 ShiftInWorld(const CharacterMesh& mesh, Index point, const PointValues& rest, Double3 shift) {
  Double3 shifted;
  double total = 0;
  for (std::size_t j = 0; j < rest.joints.size(); ++j) {
    const Index at = mesh.influences->offsets()[point] + static_cast<Index>(j);
    const auto weight = static_cast<double>(mesh.influences->weights()[at]);
    const Matrix4& bind = mesh.inverse_binds[mesh.influences->joints()[at]];
    shifted = shifted + weight * TransformVector(rest.joints[j], TransformVector(bind, shift));
    total += weight;
  }
  return total > 0 ? shifted * (1 / total) : TransformVector(rest.node, shift);
}

}  // namespace

Result<VertexStory> TellOfVertex(const Rig& rig, const Rig& rest, const VertexName& name, double time) {
  const CharacterMesh& mesh = *name.mesh;
  const auto number = static_cast<std::size_t>(&mesh - rig.scene.meshes.data());
  const Index point = mesh.mesh().data().vertex_to_point[name.vertex];
  const std::vector<Touching> touching = TargetsOf(mesh, point);
  const Result<PointValues> now = Read(rig, mesh, point, touching, time);
  if (!now.ok()) return now.status();
  const Result<PointValues> before = Read(rest, rest.scene.meshes[number], point, touching, 0);
  if (!before.ok()) return before.status();

  VertexStory story;
  story.mesh = mesh.name;
  story.vertex = name.vertex;
  story.point = point;
  story.points = mesh.mesh().point_count();
  story.time = time;
  for (std::size_t k = 0; k < touching.size(); ++k) {
    const double size = Length(ShiftInWorld(mesh, point, *before, touching[k].delta));
    story.morphs.push_back(
        {mesh.geometry.targets->targets()[touching[k].target].name, size, now->weights[k]});
  }
  std::stable_sort(story.morphs.begin(), story.morphs.end(),
                   [](const VertexStory::Morph& a, const VertexStory::Morph& b) {
                     return std::abs(a.weight) * a.size > std::abs(b.weight) * b.size;
                   });

  const ConstPointsView rest_points = mesh.mesh().data().rest.view();
  Double3 at{rest_points.x[point], rest_points.y[point], rest_points.z[point]};
  bool world = false;
  for (std::size_t s = 0; s < mesh.stages.size(); ++s) {
    const Stage& stage = mesh.stages[s];
    Double3 from = at;
    if (stage.world && !world && stage.node == mesh.skin_cluster) {
      const Index first = mesh.influences->offsets()[point];
      from = {};
      double total = 0;
      for (std::size_t j = 0; j < now->joints.size(); ++j) {
        const Index joint = mesh.influences->joints()[first + j];
        const auto weight = static_cast<double>(mesh.influences->weights()[first + j]);
        const Double3 bound = TransformPoint(mesh.inverse_binds[joint], at);
        const Double3 rested = TransformPoint(before->joints[j], bound);
        from = from + weight * rested;
        total += weight;
        story.joints.push_back({rig.graph->name(mesh.influence_nodes[joint]), weight,
                                weight * Length(TransformPoint(now->joints[j], bound) - rested)});
      }
      from = total > 0 ? from * (1 / total) : TransformPoint(before->node, at);
    } else if (stage.world && !world) {
      from = TransformPoint(before->node, at);
    }
    at = now->stages[s];
    world = stage.world;
    VertexStory::Stage told{stage.name, rig.graph->def(stage.node).name, stage.world,
                            WeightOf(rig, stage, point)};
    if (AttributeOf(rig, stage.node, "envelope") >= 0) told.envelope = now->envelopes[s];
    told.moved = Length(world ? at - from : ShiftInWorld(mesh, point, *before, at - from));
    story.stages.push_back(std::move(told));
  }
  std::stable_sort(
      story.joints.begin(), story.joints.end(),
      [](const VertexStory::Joint& a, const VertexStory::Joint& b) { return a.weight > b.weight; });
  const Double3 rested = before->stages.empty() ? at : before->stages.back();
  story.rest = {rested.x, rested.y, rested.z};
  story.position = {at.x, at.y, at.z};
  story.moved = Length(at - rested);
  return story;
}

}  // namespace kpsa::engine
