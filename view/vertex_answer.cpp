#include "view/vertex_answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "host/explain/vertex_story.h"
#include "host/rig_survey.h"
#include "host/rig_training.h"
#include "host/run_up.h"
#include "host/settable_plug.h"
#include "report/vertex_text.h"

namespace kpsa::engine {
namespace {

VertexName FindVertex(const Rig& rig, std::size_t vertex) {
  for (const std::size_t m : ShownMeshes(rig.scene)) {
    const CharacterMesh& mesh = rig.scene.meshes[m];
    if (vertex < mesh.vertex_count) return {&mesh, static_cast<Index>(vertex)};
    vertex -= mesh.vertex_count;
  }
  return {};
}

Status Pose(const PlugRef& plug, double number, Rig* rig) {
  const Result<Value> value = ValueOf(*rig->graph, plug, number);
  if (!value.ok()) return value.status();
  return ApplySetting(rig, {plug, *value, rig->graph->PlugName(plug)});
}

// The rig with the pose in its graph.
Result<Rig> Posed(const Rig& rest, const LivePose& pose) {
  Rig rig = rest;
  if (pose.clip.has_value()) KPSA_RETURN_IF_ERROR(SetClip(&rig, *pose.clip));
  for (const MovedPlug& moved : pose.moved) KPSA_RETURN_IF_ERROR(Pose(moved.plug, moved.number, &rig));
  return rig;
}

// Where one vertex is, at any value of any control.
class Probe {
 public:
  Status Start(const Rig& rig, const VertexName& name, double seconds) {
    const Mesh& mesh = name.mesh->mesh();
    const Index point = mesh.data().vertex_to_point[name.vertex];
    Request request{{{name.mesh->points, PointSet::Of({point}, mesh.point_count())}}, VaryingPlugs(rig)};
    const auto plan = compiler_.Compile(*rig.graph, request);
    if (!plan.ok()) return plan.status();
    stateful_ = (*plan)->stateful_node();
    evaluator_.emplace(*plan);
    return RunUp(**plan, rig).To(seconds, &*evaluator_);
  }
  // The first node that remembers, or "".
  const std::string& stateful() const { return stateful_; }
  bool Moves(const PlugRef& plug) const { return static_cast<bool>(evaluator_->plan().Handle(plug)); }
  Status Set(const Graph& graph, const PlugRef& plug, double number) {
    const Result<Value> value = ValueOf(graph, plug, number);
    return value.ok() ? evaluator_->Set(evaluator_->plan().Handle(plug), *value) : value.status();
  }
  Result<Double3> Place() {
    KPSA_RETURN_IF_ERROR(evaluator_->Pull(0));
    const ConstPointsView view = evaluator_->Points(0);
    return Double3{view.x[0], view.y[0], view.z[0]};
  }

 private:
  Compiler compiler_;
  std::optional<Evaluator> evaluator_;
  std::string stateful_;
};

// Every control is free in the graph that is tried: what the clip drives is where it drove it.
Status TryControls(const Rig& rest, const LatestPose& at, std::size_t vertex, VertexAnswer* answer) {
  Result<Rig> posed = Posed(rest, at.pose);
  if (!posed.ok()) return posed.status();
  Rig& rig = *posed;
  std::vector<double> now;  // by control, runtime units
  for (const Control& control : rest.controls) {
    double number = control.value;
    for (const auto& [name, value] : at.values) {
      if (name == control.name) number = value * rest.units.FactorOf(control.unit);
    }
    for (const MovedPlug& moved : at.pose.moved) {
      if (moved.plug == control.plug) number = moved.number;
    }
    now.push_back(number);
    if (DriverOf(*rig.graph, control.plug) != nullptr && DriverOf(*rest.graph, control.plug) == nullptr)
      KPSA_RETURN_IF_ERROR(Pose(control.plug, number, &rig));
  }
  Probe probe;
  KPSA_RETURN_IF_ERROR(probe.Start(rig, FindVertex(rig, vertex), at.pose.seconds));
  if (!probe.stateful().empty()) {
    answer->lines.push_back(
        fmt::format("controls are not tried: {} remembers the frames before", probe.stateful()));
    return Status();
  }
  const Result<Double3> here = probe.Place();
  if (!here.ok()) return here.status();
  std::size_t tried = 0;
  for (std::size_t i = 0; i < rest.controls.size(); ++i) {
    const Control& control = rest.controls[i];
    if (!probe.Moves(control.plug)) continue;
    if (tried++ == kMostReaches) {
      answer->lines.push_back(
          fmt::format("{} controls were tried, of {}", kMostReaches, rest.controls.size()));
      break;
    }
    double most = 0;
    for (const double end : {control.min, control.max}) {
      KPSA_RETURN_IF_ERROR(probe.Set(*rig.graph, control.plug, end));
      const Result<Double3> there = probe.Place();
      if (there.ok()) most = std::max(most, Length(*there - *here));  // a pose that fails moves nothing
    }
    KPSA_RETURN_IF_ERROR(probe.Set(*rig.graph, control.plug, now[i]));
    if (most > 0) answer->moved_by.emplace_back(control.name, most);
  }
  std::ranges::stable_sort(answer->moved_by, std::greater(), [](const auto& moved) { return moved.second; });
  return Status();
}

}  // namespace

Result<VertexAnswer> TellOfVertex(const Rig& rest, const LatestPose& at, std::size_t vertex) {
  const Result<Rig> rig = Posed(rest, at.pose);
  if (!rig.ok()) return rig.status();
  const Result<VertexStory> story = TellOfVertex(*rig, rest, FindVertex(*rig, vertex), at.pose.seconds);
  if (!story.ok()) return story.status();
  VertexAnswer answer;
  const std::string text = VertexText(*story);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    answer.lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  KPSA_RETURN_IF_ERROR(TryControls(rest, at, vertex, &answer));
  return answer;
}

std::string VertexAnswerText(const VertexAnswer& answer) {
  using Json = nlohmann::ordered_json;
  Json moved = Json::array();
  for (const auto& [name, metres] : answer.moved_by) moved.push_back({{"name", name}, {"metres", metres}});
  return Json{{"lines", answer.lines}, {"moved_by", moved}}.dump(-1, ' ', false,
                                                                 Json::error_handler_t::replace);
}

}  // namespace kpsa::engine
