// kpsa nodes: the node reference, from the registry.
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "files/quantity.h"
#include "picture/node_pictures.h"
#include "report/rig_schema.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

struct NodesFlags : Flags {
  std::optional<std::string> type;
  std::optional<std::string> pictures;
  bool markdown = false, schema = false;
};

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

std::string Kind(const AttributeDef& a) {
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

Table Attributes(const NodeDef& def) {
  Table table({"attribute", "kind", "type", "default", "range", "unit", "what it is"});
  for (const AttributeDef& a : def.attributes) {
    table.Row({a.name, Kind(a), TypeText(a), DefaultText(a), RangeText(a), UnitName(a.unit), a.doc});
  }
  return table;
}

std::string PictureLink(const std::string& type) {
  return HasNodePicture(type) ? fmt::format("![{}: before and after](nodes/{}.png)\n\n", type, type) : "";
}

nlohmann::ordered_json Json(const NodeDef& def) {
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
  return {{"name", def.name},
          {"doc", def.doc},
          {"category", def.category},
          {"version", def.version},
          {"animation", def.animation},
          {"stateful", def.stateful},
          {"attributes", std::move(attributes)}};
}

CommandResult Nodes(const NodesFlags& flags) {
  NodeRegistry registry;
  AddAllNodes(registry);
  PluginLoader plugins(&registry);
  KPSA_RETURN_IF_ERROR(LoadPlugins(flags, &plugins));
  if (flags.markdown + flags.schema + flags.json + flags.pictures.has_value() > 1)
    return Status::Usage("expected one of --markdown, --pictures, --schema and --json");
  if (flags.pictures.has_value()) {
    if (flags.type.has_value())
      return Status::Usage("--pictures is of all node types, expected no TYPE, found \"{}\"", *flags.type);
    KPSA_RETURN_IF_ERROR(WriteNodePictures(registry, *flags.pictures, flags.force));
    return 0;
  }
  if (flags.schema) {
    if (flags.type.has_value())
      return Status::Usage("--schema is of all node types, expected no TYPE, found \"{}\"", *flags.type);
    Print(RigSchema(registry));
    return 0;
  }
  std::vector<const NodeDef*> defs;
  for (const std::string& name : registry.Names()) defs.push_back(registry.Find(name));
  if (flags.type.has_value()) {
    const NodeDef* def = registry.Find(*flags.type);
    if (def == nullptr)
      return Status::Usage("no node type is called \"{}\"{}", *flags.type,
                           DidYouMean(*flags.type, registry.Names()));
    defs = {def};
  }
  if (flags.json) {
    nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
    for (const NodeDef* def : defs) nodes.push_back(Json(*def));
    PrintJson(nlohmann::ordered_json{{"schema", "kpsa.nodes/1"}, {"nodes", std::move(nodes)}});
    return 0;
  }
  std::map<std::string, std::vector<const NodeDef*>> by_category;
  for (const NodeDef* def : defs) by_category[def->category].push_back(def);
  if (flags.markdown) {
    Print(
        "# Node reference\n\nWritten by `kpsa nodes --markdown`. Lengths in metres, angles in radians, times "
        "in seconds unless a rig's `units` say otherwise.\n");
    for (const auto& [category, members] : by_category) {
      Print("\n## " + category + "\n");
      for (const NodeDef* def : members)
        Print(fmt::format("\n### {}\n\n{}\n\n{}{}", def->name, def->doc, PictureLink(def->name),
                          Attributes(*def).Markdown()));
    }
    return 0;
  }
  if (flags.type.has_value()) {
    Print(fmt::format("{} ({})\n{}\n\n{}", defs[0]->name, defs[0]->category, defs[0]->doc,
                      Attributes(*defs[0]).Text()));
    return 0;
  }
  Table table({"type", "category", "what it does"});
  for (const auto& [category, members] : by_category) {
    for (const NodeDef* def : members) table.Row({def->name, category, def->doc});
  }
  Print(table.Text());
  return 0;
}

}  // namespace

void AddNodesCommand(CLI::App* program, Command* chosen) {
  auto flags = std::make_shared<NodesFlags>();
  CLI::App* command = AddCommand(program, "nodes", "The node reference",
                                 "Examples:\n"
                                 "  kpsa nodes\n"
                                 "  kpsa nodes deltaMush\n"
                                 "  kpsa nodes --plugin libmynodes.so --json\n"
                                 "  kpsa nodes --schema > rig.schema.json",
                                 chosen, [flags] { return Nodes(*flags); });
  AddOption(command, "TYPE", "", &flags->type, "one node type, with its attributes");
  AddSwitch(command, "--markdown", &flags->markdown, "print the whole reference as Markdown");
  AddOption(command, "--pictures", "FOLDER", &flags->pictures,
            "write a picture of what each deformer does, FOLDER/TYPE.png");
  AddSwitch(command, "--force", &flags->force, "replace existing pictures");
  AddSwitch(command, "--schema", &flags->schema, "print a JSON Schema of rig files, for editors");
  AddPluginFlag(command, flags.get());
  AddJsonFlag(command, flags.get());
}

}  // namespace kpsa::engine
