#include "view/live_pose.h"

#include <algorithm>
#include <cmath>

#include "host/settable_plug.h"

namespace kpsa::engine {
namespace {

Result<MovedPlug> FindPlug(const Rig& rest, const std::string& name, double number) {
  const Graph& graph = *rest.graph;
  const Result<PlugRef> found = graph.FindPlug(name);
  if (!found.ok()) return found.status();
  const PlugRef& plug = *found;
  const AttributeDef& attribute = graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  if (plug == rest.scene.time)
    return Status::Usage("{} is the time, which is asked for apart", graph.PlugName(plug));
  KPSA_RETURN_IF_ERROR(CheckSettable(graph, plug));
  MovedPlug moved{plug, number * rest.units.FactorOf(attribute.unit)};
  if (const Result<Value> value = ValueOf(graph, plug, moved.number); !value.ok()) return value.status();
  moved.control =
      !IsPointType(attribute.type) && std::ranges::any_of(rest.controls, [&](const Control& control) {
        return control.plug.node == plug.node && control.plug.attribute == plug.attribute &&
               control.plug.element == plug.element &&
               (control.plug.component == plug.component || control.plug.component < 0);
      });
  return moved;
}

}  // namespace

Result<LivePose> FindPose(const Rig& rest, const PoseRequest& request) {
  LivePose pose;
  pose.clip = request.clip;
  pose.seconds = request.seconds;
  Status wrong;
  double end = 0;
  bool known = false;
  for (const CharacterClip& clip : rest.scene.clips) {
    end = std::max(end, clip.duration);
    known = known || clip.id == request.clip;
  }
  if (request.clip.has_value() && !known) wrong.Append(NoSuchClip(rest.scene, *request.clip));
  // Nodes that remember are run up to a time frame by frame: no request may ask for more than one would play
  if (!(request.seconds >= -kBeyondClips && request.seconds <= end + kBeyondClips))
    wrong.Append(Status::Usage("time {}: expected seconds from {} to {}", request.seconds, -kBeyondClips,
                               end + kBeyondClips));
  for (const auto& [name, number] : request.set) {
    const Result<MovedPlug> moved = FindPlug(rest, name, number);
    if (!moved.ok()) {
      if (wrong.errors().size() < 20) wrong.Append(moved.status());
      continue;
    }
    const auto at = std::ranges::find(pose.moved, moved->plug, &MovedPlug::plug);
    if (at != pose.moved.end())
      at->number = moved->number;
    else
      pose.moved.push_back(*moved);
  }
  if (!wrong.ok()) return wrong;
  return pose;
}

}  // namespace kpsa::engine
