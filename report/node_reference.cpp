#include "report/node_reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "files/quantity.h"
#include "report/json_text.h"
#include "report/table.h"
#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

const char* UnitName(Unit unit) {
  switch (unit) {
    case Unit::kLength:
      return "length";
    case Unit::kAngle:
      return "angle";
    case Unit::kTime:
      return "time";
    default:
      return "";
  }
}

std::string KindText(const AttributeDef& a) {
  if (a.output) return "out";
  if (a.structural) return "structural";
  return a.lazy ? "in, lazy" : "in";
}

std::string TypeText(const AttributeDef& a) {
  std::string text = TypeName(a.type);
  if (!a.enum_names.empty()) text += fmt::format(" ({})", fmt::join(a.enum_names, " "));
  if (a.array) text += "[]";
  return text;
}

std::string DefaultText(const AttributeDef& a) {
  if (a.output) return "";
  if (a.default_from) return "follows";
  if (a.default_value.empty()) return "";
  const auto choice = static_cast<std::size_t>(a.default_value.AsInt());
  if (a.type == Type::kEnum && choice < a.enum_names.size()) return a.enum_names[choice];
  if (const Matrix4* matrix = a.default_value.get_if<Matrix4>(); matrix != nullptr && *matrix == Matrix4())
    return "identity";
  return a.default_value.ToString();
}

std::string RangeText(const AttributeDef& a) {
  if (std::isinf(a.min) && std::isinf(a.max)) return "";
  if (std::isinf(a.max)) return "from " + NumberText(a.min);
  if (std::isinf(a.min)) return "to " + NumberText(a.max);
  return NumberText(a.min) + " to " + NumberText(a.max);
}

Table AttributeTable(const NodeDef& def) {
  Table table({"attribute", "kind", "type", "default", "range", "unit", "what it is"});
  for (const AttributeDef& a : def.attributes) {
    table.Row({a.name, KindText(a), TypeText(a), DefaultText(a), RangeText(a), UnitName(a.unit), a.doc});
  }
  return table;
}

// Keys of a node in a rig that are no attributes (docs/rig-format.md); empty where it has none.
Table KeyTable(const std::vector<RigWord>& words) {
  Table table({"key in a rig", "what it is"});
  for (const RigWord& word : words) table.Row({word.name, word.doc});
  return table;
}

nlohmann::ordered_json DefJson(const NodeDef& def) {
  nlohmann::ordered_json attributes = nlohmann::ordered_json::array();
  for (const AttributeDef& a : def.attributes) {
    nlohmann::ordered_json json = {
        {"name", a.name},   {"type", TypeName(a.type)},   {"doc", a.doc},   {"output", a.output},
        {"array", a.array}, {"structural", a.structural}, {"lazy", a.lazy}, {"per_geometry", a.per_geometry}};
    if (!a.output) json["default"] = DefaultText(a);
    if (!std::isinf(a.min)) json["min"] = a.min;
    if (!std::isinf(a.max)) json["max"] = a.max;
    if (a.unit != Unit::kNone) json["unit"] = UnitName(a.unit);
    if (!a.enum_names.empty()) json["enum"] = a.enum_names;
    if (!a.aliases.empty()) json["aliases"] = a.aliases;
    attributes.push_back(std::move(json));
  }
  nlohmann::ordered_json keys = nlohmann::ordered_json::array();
  for (const RigWord& word : RigWordsOf(def)) keys.push_back({{"name", word.name}, {"doc", word.doc}});
  return {{"name", def.name},
          {"doc", def.doc},
          {"category", def.category},
          {"version", def.version},
          {"animation", def.animation},
          {"stateful", def.stateful},
          {"attributes", std::move(attributes)},
          {"rig_keys", std::move(keys)}};
}

std::map<std::string, NodeDefs> ByCategory(const NodeDefs& defs) {
  std::map<std::string, NodeDefs> by_category;
  for (const NodeDef* def : defs) by_category[def->category].push_back(def);
  return by_category;
}

}  // namespace

std::string NodesMarkdown(const NodeDefs& defs,
                          const std::function<bool(const std::string& type)>& has_picture) {
  std::string text =
      "# Node reference\n\nWritten by `kpsa nodes --markdown`. Lengths in metres, angles in radians, times "
      "in seconds unless a rig's `units` say otherwise.\n";
  for (const auto& [category, members] : ByCategory(defs)) {
    text += "\n## " + category + "\n";
    for (const NodeDef* def : members) {
      const std::string picture =
          has_picture(def->name) ? fmt::format("![{0}: before and after](nodes/{0}.png)\n\n", def->name) : "";
      text += fmt::format("\n### {}\n\n{}\n\n{}{}", def->name, def->doc, picture,
                          AttributeTable(*def).Markdown());
      if (const auto words = RigWordsOf(*def); !words.empty()) text += "\n" + KeyTable(words).Markdown();
    }
  }
  return text;
}

std::string NodesText(const NodeDefs& defs) {
  Table table({"type", "category", "what it does"});
  for (const auto& [category, members] : ByCategory(defs)) {
    for (const NodeDef* def : members) table.Row({def->name, category, def->doc});
  }
  return table.Text();
}

std::string NodeText(const NodeDef& def) {
  std::string text =
      fmt::format("{} ({})\n{}\n\n{}", def.name, def.category, def.doc, AttributeTable(def).Text());
  if (const auto words = RigWordsOf(def); !words.empty()) text += "\n" + KeyTable(words).Text();
  return text;
}

std::string NodesJson(const NodeDefs& defs) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
  for (const NodeDef* def : defs) nodes.push_back(DefJson(*def));
  const nlohmann::ordered_json document{{"schema", "kpsa.nodes/1"}, {"nodes", std::move(nodes)}};
  return JsonText(document);
}

}  // namespace kpsa::engine
