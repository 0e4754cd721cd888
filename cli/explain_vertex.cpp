#include "cli/explain_vertex.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/matrix.h"
#include "cli/common.h"
#include "cli/frames_range.h"
#include "cli/rig_frames.h"
#include "files/quantity.h"
#include "report/table.h"

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
  double size = 0;
};

std::vector<Touching> TargetsOf(const CharacterMesh& mesh, Index point) {
  std::vector<Touching> touching;
  if (mesh.geometry.targets == nullptr) return touching;
  const auto& targets = mesh.geometry.targets->targets();
  for (Index k = 0; k < targets.size(); ++k) {
    const auto it = std::lower_bound(targets[k].points.begin(), targets[k].points.end(), point);
    if (it == targets[k].points.end() || *it != point) continue;
    const float* delta = &targets[k].deltas[3 * static_cast<std::size_t>(it - targets[k].points.begin())];
    touching.push_back({k, Length({delta[0], delta[1], delta[2]})});
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

}  // namespace

Result<std::optional<VertexName>> FindVertex(const Rig& rig, const std::string& text) {
  const std::size_t open = text.rfind('[');
  if (open == std::string::npos || open == 0 || text.back() != ']') return std::optional<VertexName>();
  const std::string name = text.substr(0, open);
  std::vector<std::string> names;
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    names.push_back(mesh.name);
    if (mesh.name != name) continue;
    const Result<std::vector<Index>> vertices =
        ParseIndices(text, text.substr(open + 1, text.size() - open - 2), mesh.vertex_count);
    if (!vertices.ok()) return vertices.status();
    if (vertices->size() != 1) return Status::Usage("{}: expected one vertex", text);
    return std::optional<VertexName>({&mesh, vertices->front()});
  }
  if (name.find('.') != std::string::npos) return std::optional<VertexName>();  // an attribute's element
  return Status::Usage("\"{}\": no mesh is called \"{}\"{}", text, name, DidYouMean(name, names));
}

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
    story.morphs.push_back(
        {mesh.geometry.targets->targets()[touching[k].target].name, touching[k].size, now->weights[k]});
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
    told.moved = Length(at - from);
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

std::string VertexText(const VertexStory& story) {
  const auto place = [](const std::array<double, 3>& p) {
    return fmt::format("[{:.4f}, {:.4f}, {:.4f}]", p[0], p[1], p[2]);
  };
  std::string text =
      fmt::format("{}[{}] (point {} of {}) at {} s\n  rests at {} m, is at {} m, {} away\n", story.mesh,
                  story.vertex, Thousands(story.point), Thousands(story.points), NumberText(story.time),
                  place(story.rest), place(story.position), LengthText(story.moved));
  Table stages({"stage", "type", ">weight", ">envelope", ">moves it by"});
  for (const VertexStory::Stage& s : story.stages)
    stages.Row({s.name, s.type, fmt::format("{:.3g}", s.weight),
                s.envelope.has_value() ? fmt::format("{:.3g}", *s.envelope) : "", LengthText(s.moved)});
  text += "\n" + stages.Text();
  if (!story.joints.empty()) {
    Table joints({"joint", ">weight", ">moves it by"});
    for (const VertexStory::Joint& j : story.joints)
      joints.Row({j.name, fmt::format("{:.3g}", j.weight), LengthText(j.moved)});
    text += "\n" + joints.Text();
  }
  if (!story.morphs.empty()) {
    Table morphs({"morph target", ">at weight 1", ">weight", ">moves it by"});
    for (const VertexStory::Morph& m : story.morphs)
      morphs.Row({m.name, LengthText(m.size), fmt::format("{:.3g}", m.weight),
                  LengthText(std::abs(m.weight) * m.size)});
    text += "\n" + morphs.Text();
  }
  return text;
}

std::string VertexJson(const VertexStory& story) {
  using Json = nlohmann::ordered_json;
  Json stages = Json::array(), joints = Json::array(), morphs = Json::array();
  for (const VertexStory::Stage& s : story.stages) {
    Json stage = {{"stage", s.name},    {"type", s.type},      {"space", s.world ? "world" : "mesh"},
                  {"weight", s.weight}, {"envelope", nullptr}, {"moved_m", s.moved}};
    if (s.envelope.has_value()) stage["envelope"] = *s.envelope;
    stages.push_back(std::move(stage));
  }
  for (const VertexStory::Joint& j : story.joints)
    joints.push_back(Json{{"joint", j.name}, {"weight", j.weight}, {"moved_m", j.moved}});
  for (const VertexStory::Morph& m : story.morphs)
    morphs.push_back(Json{{"target", m.name},
                          {"size_m", m.size},
                          {"weight", m.weight},
                          {"moved_m", std::abs(m.weight) * m.size}});
  const Json document = {{"schema", "kpsa.explain_vertex/1"},
                         {"mesh", story.mesh},
                         {"vertex", story.vertex},
                         {"point", story.point},
                         {"time", story.time},
                         {"rest_m", story.rest},
                         {"position_m", story.position},
                         {"moved_m", story.moved},
                         {"stages", std::move(stages)},
                         {"joints", std::move(joints)},
                         {"morphs", std::move(morphs)}};
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace kpsa::engine
