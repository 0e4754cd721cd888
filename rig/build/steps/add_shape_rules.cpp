#include "rig/build/steps/add_shape_rules.h"

#include <algorithm>

#include "rig/graph_editor.h"

namespace kpsa::engine {
namespace {

constexpr const char* kMethods[] = {"multiply", "lowestWeighting", "smooth"};

bool FindTarget(const BuildInput& in, const MadeNode& made, const YamlNode& at, const std::string& name,
                PlugRef* weight) {
  const int attribute = in.graph().def(made.id).FindAttribute("weight");
  const std::vector<std::string>* known = in.graph().ElementNames(made.id, attribute);
  const std::vector<std::string> names = known == nullptr ? std::vector<std::string>() : *known;
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) {
    return in.errors->Add(at, "\"{}\" has no target \"{}\"{}", made.from->name, name,
                          DidYouMean(name, names));
  }
  if (std::find(it + 1, names.end(), name) != names.end())
    return in.errors->Add(at, "\"{}\" is the name of several targets of \"{}\"", name, made.from->name);
  *weight = {made.id, attribute, static_cast<int>(it - names.begin()), -1};
  return true;
}

// A node that drives the weight of a target by those of others, as Maya's combinationShape.
void AddCombination(const BuildInput& in, const MadeNode& made, const YamlNode& key, const YamlNode& body,
                    Graph* graph) {
  PlugRef driven;
  bool good = FindTarget(in, made, key, key.scalar, &driven);
  YamlMap map(body, fmt::format("combination \"{}\"", key.scalar), in.errors);
  const YamlNode* targets = map.Required("targets");
  const YamlNode* method_node = map.Find("method");
  map.RejectUnread();
  std::string method = kMethods[0];
  if (method_node != nullptr) {
    if (!ReadString(*method_node, "method", &method, in.errors)) return;
    if (std::find(std::begin(kMethods), std::end(kMethods), method) == std::end(kMethods)) {
      in.errors->Add(*method_node, "method: expected {}, found \"{}\"", fmt::join(kMethods, ", "), method);
      return;
    }
  }
  if (targets == nullptr) return;
  if (!targets->is_sequence() || targets->items.empty()) {
    in.errors->Add(*targets, "targets: expected a list of the targets that act together");
    return;
  }
  std::vector<PlugRef> drivers(targets->items.size());
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    const YamlNode& item = targets->items[i];
    std::string name;
    good = ReadString(item, "targets", &name, in.errors) && FindTarget(in, made, item, name, &drivers[i]) &&
           good;
  }
  if (!good) return;
  GraphEditor edit(graph);
  const NodeId node =
      edit.AddFresh("combinationShape", fmt::format("{}_{}", graph->name(made.id), key.scalar));
  if (edit.ok()) {
    edit.Set(node, "combinationMethod",
             Value(std::find(std::begin(kMethods), std::end(kMethods), method) - std::begin(kMethods)));
  }
  for (std::size_t i = 0; i < drivers.size(); ++i)
    edit.Connect(drivers[i], edit.Plug(node, "inputWeight", static_cast<int>(i)));
  // A clip that plays the combination gives way, and so do VRM's expressions: it is none of their business
  const Connection* driver = graph->FindConnection(driven);
  const bool clip = IsClipPlug(in.rig.scene, *graph, driven) ||
                    (driver != nullptr && graph->def(driver->source.node).name == "vrmMorphWeights");
  const PlugRef weight = edit.Plug(node, "outputWeight");
  if (edit.ok()) edit.Check(graph->Connect(weight, driven, clip));
  in.Fail(key.where(), edit.Take());
}

// inbetweens: {smile: {0.5: smile_half}}
void AddInbetweens(const BuildInput& in, const MadeNode& made, const YamlNode& value, Graph* graph) {
  std::vector<std::int64_t> targets, shapes;
  std::vector<double> weights;
  if (!value.is_map()) {
    in.errors->Add(value, "inbetweens: expected {{TARGET: {{0.5: OTHER_TARGET}}}}");
    return;
  }
  bool good = true;
  for (std::size_t i = 0; i < value.keys.size(); ++i) {
    const YamlNode &key = value.keys[i], &stops = value.items[i];
    PlugRef target;
    good = FindTarget(in, made, key, key.scalar, &target) && good;
    if (!stops.is_map()) {
      good = in.errors->Add(stops, "inbetweens: expected {{0.5: TARGET}} for \"{}\"", key.scalar);
      continue;
    }
    for (std::size_t k = 0; k < stops.keys.size(); ++k) {
      double weight = 0;
      std::string name;
      PlugRef through;
      if (!ReadNumber(stops.keys[k], "weight of an in-between", Unit::kNone, FileUnits(), &weight,
                      in.errors) ||
          !ReadString(stops.items[k], "in-between", &name, in.errors) ||
          !FindTarget(in, made, stops.items[k], name, &through)) {
        good = false;
        continue;
      }
      if (!(weight > 0 && weight < 1)) {
        good = in.errors->Add(
            stops.keys[k], "an in-between of \"{}\" at {}: expected a weight of more than 0 and less than 1",
            key.scalar, stops.keys[k].scalar);
      } else if (through == target) {
        good = in.errors->Add(stops.items[k], "\"{}\" cannot be its own in-between", name);
      } else if (good) {
        for (std::size_t other = 0; other < targets.size(); ++other) {
          if (targets[other] == target.element && weights[other] == weight)
            good = in.errors->Add(stops.keys[k], "\"{}\" has two in-betweens at {}", key.scalar, weight);
        }
        targets.push_back(target.element);
        shapes.push_back(through.element);
        weights.push_back(weight);
      }
    }
  }
  if (!good) return;
  GraphEditor edit(graph);
  edit.Set(made.id, "inbetweenTarget", Value(std::move(targets)));
  edit.Set(made.id, "inbetweenShape", Value(std::move(shapes)));
  edit.Set(made.id, "inbetweenWeight", Value(std::move(weights)));
  in.Fail(value.where(), edit.Take());
}

void AddShapeRulesOf(const BuildInput& in, const MadeNode& made, Graph* graph) {
  if (graph->def(made.id).name != "blendShape" || in.errors->full()) return;
  if (const RigAttribute* combinations = made.Find("combinations")) {
    const YamlNode& value = combinations->value;
    if (!value.is_map()) {
      in.errors->Add(value, "combinations: expected {{TARGET: {{targets: [...], method: multiply}}}}");
    } else {
      for (std::size_t i = 0; i < value.keys.size(); ++i)
        AddCombination(in, made, value.keys[i], value.items[i], graph);
    }
  }
  if (const RigAttribute* inbetweens = made.Find("inbetweens"))
    AddInbetweens(in, made, inbetweens->value, graph);
}

}  // namespace

void AddShapeRules(const BuildInput& in, const MadeNodes& nodes, const OwnDeformers& own, Graph* graph) {
  for (const MadeNode& made : nodes) AddShapeRulesOf(in, made, graph);
  for (const MadeNode& made : own.made) AddShapeRulesOf(in, made, graph);
}

}  // namespace kpsa::engine
