#include "host/pose_text.h"

#include <algorithm>
#include <charconv>
#include <map>

#include "files/quantity.h"
#include "host/plug_columns.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

// The shortest number that is read back as the value.
std::string ShortestText(double value, double factor) {
  for (int digits = 1; digits < 17; ++digits) {
    const std::string text = fmt::format("{:.{}g}", value / factor, digits);
    double read = 0;
    std::from_chars(text.data(), text.data() + text.size(), read);
    if (read * factor == value) return NumberText(read);
  }
  return fmt::format("{:.17g}", value / factor);
}

// A string of YAML; names without anything special stay as they are.
std::string YamlString(const std::string& text) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
  };
  const bool letter = !text.empty() && plain(text.front()) && text.front() > '9' && text.front() != '_';
  if (letter && text.find('.') != std::string::npos && std::all_of(text.begin(), text.end(), plain))
    return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 32) {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned>(c));
    } else {
      if (c == '"' || c == '\\') quoted += '\\';
      quoted += c;
    }
  }
  return quoted + "\"";
}

// What the rig's file holds for a plug: what is written, or the attribute's default.
Value ValueAtRest(const Graph& graph, const PlugRef& plug) {
  const AttributeDef& attribute = graph.def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  Value whole = attribute.default_value;
  for (const SetValue& written : graph.WrittenValues(plug.node, plug.attribute)) {
    if (written.plug == plug) return written.value;
    if (written.plug.element == plug.element && written.plug.component < 0) whole = written.value;
  }
  if (plug.component < 0) return whole;
  double one = 0;
  const std::span<const double> numbers = NumbersOf(whole, &one);
  const auto component = static_cast<std::size_t>(plug.component);
  return component < numbers.size() ? Value(numbers[component]) : Value();
}

Result<std::string> ValueText(const Rig& rig, const PlugRef& plug, const Value& value) {
  const AttributeDef& attribute =
      rig.graph->def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)];
  const double factor = rig.units.FactorOf(attribute.unit);
  if (attribute.type == Type::kEnum) {
    const auto choice = static_cast<std::size_t>(value.AsInt());
    if (choice < attribute.enum_names.size()) return YamlString(attribute.enum_names[choice]);
  }
  if (const auto* text = value.get_if<std::string>()) return YamlString(*text);
  if (const auto* whole = value.get_if<std::int64_t>()) {
    if (attribute.type == Type::kBool) return std::string(*whole != 0 ? "true" : "false");
    if (attribute.unit == Unit::kNone) return std::to_string(*whole);
  }
  if (const auto* whole = value.get_if<std::vector<std::int64_t>>())
    return fmt::format("[{}]", fmt::join(*whole, ", "));
  double one = 0;
  std::span<const double> numbers = NumbersOf(value, &one);
  if (const auto* list = value.get_if<std::vector<double>>()) numbers = *list;
  if (numbers.empty()) return Status::Usage("{} holds what no pose file can", rig.graph->AuthoredName(plug));
  if (value.get_if<double>() != nullptr || value.get_if<std::int64_t>() != nullptr)
    return ShortestText(numbers[0], factor);
  std::vector<std::string> texts;
  for (double number : numbers) texts.push_back(ShortestText(number, factor));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

// The controls, as they are at a time.
Status AddControls(const Rig& rig, double time, std::map<std::string, std::string>* pose) {
  std::vector<std::string> names;
  for (const Control& control : rig.controls) names.push_back(control.name);
  Request request;
  request.varying.push_back(rig.scene.time);
  Result<std::vector<Column>> columns = FindColumns(rig, names, &request);
  if (!columns.ok()) return columns.status();
  Compiler compiler;
  const auto plan = CompileFor(rig, &compiler, request);
  if (!plan.ok()) return plan.status();
  for (Column& column : *columns) CompleteColumn(**plan, &column);
  return EvaluateTimes(rig, *plan, {time}, {}, [&](std::size_t, const Evaluator& evaluator) {
    std::vector<double> numbers;
    for (std::size_t c = 0; c < columns->size(); ++c) {
      const Control& control = rig.controls[c];
      numbers = {control.value / rig.units.FactorOf(control.unit)};
      if ((*columns)[c].output != kNoIndex) {
        numbers.clear();
        (*columns)[c].Read(evaluator, &numbers);
      }
      const double factor = rig.units.FactorOf(control.unit);
      pose->emplace(rig.graph->AuthoredName(control.plug), ShortestText(numbers.at(0) * factor, factor));
    }
    return Status();
  });
}

}  // namespace

Result<std::string> PoseText(const Rig& rig, const PoseTextOptions& options) {
  const Graph& graph = *rig.graph;
  std::map<std::string, std::string> pose;
  for (NodeId node : graph.Nodes()) {
    for (int a = 0; a < static_cast<int>(graph.def(node).attributes.size()); ++a) {
      const std::span<const SetValue> values = graph.Values(node, a);
      if (values.data() == graph.WrittenValues(node, a).data()) continue;  // not posed
      for (const SetValue& set : values) {
        // A clip would move it, if it were not said that it rests
        const bool pinned = std::find(rig.pinned.begin(), rig.pinned.end(), set.plug) != rig.pinned.end();
        if (!pinned && !options.all && ValueAtRest(graph, set.plug).digest() == set.value.digest()) continue;
        const Result<std::string> text = ValueText(rig, set.plug, set.value);
        if (!text.ok()) return text.status();
        pose.emplace(graph.AuthoredName(set.plug), *text);
      }
    }
  }
  if (options.all && !rig.controls.empty()) KPSA_RETURN_IF_ERROR(AddControls(rig, options.time, &pose));
  std::string text = "kpsa: 1\n";
  if (options.clip.has_value()) {
    text += fmt::format("clip: {}\n", YamlString(*options.clip));
    if (!options.clip->empty()) text += fmt::format("time: {}s\n", ShortestText(options.time, 1));
  }
  text += pose.empty() ? "pose: {}\n" : "pose:\n";
  for (const auto& [plug, value] : pose) text += fmt::format("  {}: {}\n", YamlString(plug), value);
  return text;
}

}  // namespace kpsa::engine
