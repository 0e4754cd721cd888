// Values from outside of the rig: --set and pose files.
#include <algorithm>

#include "base/text.h"
#include "rig/build/rig_builder.h"
#include "rig/file/values.h"

namespace kpsa::engine {
namespace {

Result<Setting> ReadSetting(const Rig& rig, const std::string& plug_text, const YamlNode& value,
                            const FileUnits& units) {
  const Result<PlugRef> plug = rig.graph->FindPlug(plug_text);
  if (!plug.ok()) return plug.status();
  const AttributeDef& attribute =
      rig.graph->def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
  if (attribute.output)
    return Status::Invalid("{} is an output and cannot be set", rig.graph->PlugName(*plug));
  Setting setting;
  setting.plug = *plug;
  setting.text = plug_text + "=" + (value.is_scalar() ? value.scalar : "...");
  YamlErrors errors;
  if (!ReadValue(value, rig.graph->PlugName(*plug), attribute, rig.graph->PlugType(*plug), units,
                 &setting.value, &errors))
    return errors.Take();
  if (setting.value.get_if<double>() != nullptr || setting.value.get_if<std::int64_t>() != nullptr) {
    const double number = setting.value.AsDouble();
    if (number < attribute.min || number > attribute.max) {
      return Status::Invalid("{} = {} is outside of {} to {}", rig.graph->PlugName(*plug), number,
                             attribute.min, attribute.max);
    }
  }
  return setting;
}

void ReadPlugs(const Rig& rig, const YamlNode& plugs, const FileUnits& units, PoseFile* file,
               YamlErrors* errors) {
  for (std::size_t i = 0; i < plugs.keys.size() && !errors->full(); ++i) {
    Result<Setting> setting = ReadSetting(rig, plugs.keys[i].scalar, plugs.items[i], units);
    if (setting.ok()) {
      file->settings.push_back(std::move(*setting));
    } else {
      errors->Add(plugs.keys[i], setting.status());
    }
  }
}

Result<PoseFile> ReadPose(const Rig& rig, const YamlNode& root) {
  YamlErrors errors;
  PoseFile file;
  if (root.is_map() && root.Find("kpsa") == nullptr && root.Find("pose") == nullptr) {
    ReadPlugs(rig, root, rig.units, &file, &errors);
    if (!errors.ok()) return errors.Take();
    return file;
  }
  YamlMap map(root, "pose file", &errors);
  ReadVersion(&map, &errors);
  FileUnits units = rig.units;
  if (const YamlNode* node = map.Find("units")) ReadUnits(*node, &units, &errors);
  if (const YamlNode* clip = map.Find("clip")) {
    if (clip->is_scalar()) {
      file.clip = clip->scalar;
    } else {
      errors.Add(*clip, "clip: expected the name of a clip, or \"\" for the rest pose, found {}",
                 clip->kind_name());
    }
  }
  if (const YamlNode* time = map.Find("time")) {
    double seconds = 0;
    if (ReadNumber(*time, "time", Unit::kTime, units, &seconds, &errors)) file.time = seconds;
  }
  if (const YamlNode* pose = map.Required("pose")) {
    if (!pose->is_map())
      errors.Add(*pose, "pose: expected a map of plugs and values, found {}", pose->kind_name());
    ReadPlugs(rig, *pose, units, &file, &errors);
  }
  map.RejectUnread();
  if (!errors.ok()) return errors.Take();
  return file;
}

}  // namespace

Result<Setting> ParseSetting(const Rig& rig, std::string_view text) {
  // Names may hold a '=', and so may values: the longest plug that exists
  std::size_t equals = LongestBefore('=', text, [&](std::string_view plug) {
    while (plug.ends_with(' ')) plug.remove_suffix(1);
    return rig.graph->FindPlug(plug).ok();
  });
  if (equals == std::string_view::npos) equals = text.rfind('=');
  if (equals == std::string_view::npos || equals == 0 || equals + 1 == text.size()) {
    return Status::Usage("\"{}\": expected plug=value, as in jaw.rotateX=-20", text);
  }
  std::string plug(text.substr(0, equals));
  while (!plug.empty() && plug.back() == ' ') plug.pop_back();
  const Result<YamlNode> value = ParseYaml(text.substr(equals + 1), "");
  if (!value.ok()) return Status::Usage("\"{}\": {}", text, value.status().errors().front().message);
  Result<Setting> setting = ReadSetting(rig, plug, *value, rig.units);
  if (!setting.ok()) {
    Status usage;
    for (const Error& error : setting.status().errors()) usage.Append(Status::Usage("{}", error.message));
    return usage;
  }
  setting->text = std::string(text);
  return setting;
}

Result<PoseFile> ReadPoseFile(const Rig& rig, const std::string& path) {
  const Result<YamlNode> root = ReadYamlFile(path);
  return root.ok() ? ReadPose(rig, *root) : root.status();
}

Result<PoseFile> ParsePose(const Rig& rig, std::string_view text, const std::string& name) {
  const Result<YamlNode> root = ParseYaml(text, name);
  return root.ok() ? ReadPose(rig, *root) : root.status();
}

Status ApplySetting(Rig* rig, const Setting& setting) {
  Graph& graph = *rig->graph;
  const auto overlap = [](int a, int b) { return a == b || a < 0 || b < 0; };
  std::vector<PlugRef> driven;  // by a clip: the plug, a part of it, or what it is a part of
  for (const Connection& driver : graph.Inputs(setting.plug.node, setting.plug.attribute)) {
    const PlugRef& plug = driver.destination;
    if (!overlap(plug.element, setting.plug.element) || !overlap(plug.component, setting.plug.component))
      continue;
    const std::vector<NodeId>& clip_nodes = rig->scene.clip_nodes;
    if (std::find(clip_nodes.begin(), clip_nodes.end(), driver.source.node) == clip_nodes.end()) {
      return Status::Usage("{} is driven by {} and cannot be set", graph.PlugName(plug),
                           graph.PlugName(driver.source));
    }
    driven.push_back(plug);
  }
  for (const PlugRef& plug : driven) KPSA_RETURN_IF_ERROR(graph.Disconnect(plug));
  if (IsClipPlug(rig->scene, graph, setting.plug)) rig->pinned.push_back(setting.plug);
  return graph.Pose(setting.plug, setting.value);  // rest states are those of the rig
}

}  // namespace kpsa::engine
