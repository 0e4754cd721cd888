#include "view/pose_answer.h"

#include <nlohmann/json.hpp>
#include <span>

namespace kpsa::engine {

Result<std::string> PoseAnswer(const Rig& rest, std::string_view text) {
  using Json = nlohmann::ordered_json;
  const Result<PoseFile> pose = ParsePose(rest, text, "pose");
  if (!pose.ok()) return pose.status();
  Json set = Json::object();
  Status wrong;
  for (const Setting& setting : pose->settings) {
    const Graph& graph = *rest.graph;
    const double one = rest.units.FactorOf(
        graph.def(setting.plug.node).attributes[static_cast<std::size_t>(setting.plug.attribute)].unit);
    double whole = 0;
    const std::span<const double> numbers = NumbersOf(setting.value, &whole);
    if (numbers.empty() || numbers.size() > 4) {
      wrong.Append(Status::Invalid("{}: a page moves numbers and vectors, and no {}",
                                   graph.PlugName(setting.plug), TypeName(graph.PlugType(setting.plug))));
      continue;
    }
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      PlugRef plug = setting.plug;
      if (numbers.size() > 1) plug.component = static_cast<int>(i);
      set[graph.AuthoredName(plug)] = numbers[i] / one;
    }
  }
  if (!wrong.ok()) return wrong;
  Json answer = {{"set", std::move(set)}};
  if (pose->clip.has_value()) answer["clip"] = *pose->clip;
  if (pose->time.has_value()) answer["time"] = *pose->time;
  return answer.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace kpsa::engine
