#include "report/rig_schema.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "report/json_text.h"
#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::ordered_json;

Json Ref(const std::string& name) { return {{"$ref", "#/$defs/" + name}}; }
Json Described(Json schema, const std::string& doc) {
  if (!doc.empty()) schema["description"] = doc;
  return schema;
}
Json MapOf(Json values) {
  return {{"type", {"object", "null"}}, {"additionalProperties", std::move(values)}};
}
Json ListOf(Json items) { return {{"type", {"array", "null"}}, {"items", std::move(items)}}; }
Json OneOrList(Json item) {
  Json list = {{"type", "array"}, {"items", item}};
  return {{"anyOf", {std::move(item), std::move(list)}}};
}
Json Closed(Json properties, Json required = Json::array()) {
  return {{"type", "object"},
          {"properties", std::move(properties)},
          {"required", std::move(required)},
          {"additionalProperties", false}};
}
Json Numbers(std::size_t count) {
  return {{"type", "array"}, {"items", Ref("number")}, {"minItems", count}, {"maxItems", count}};
}

// A value of the type, as the reader takes it; null for what only the rig itself sets.
Json ValueSchema(const AttributeDef& a, Type type) {
  switch (type) {
    case Type::kBool:
      return {{"type", {"boolean", "string"}}};
    case Type::kEnum:
      return {{"enum", a.enum_names}};
    case Type::kString:
      return {{"type", {"string", "number", "boolean"}}};
    case Type::kInt:
    case Type::kDouble: {
      // A string is a number with a suffix, or the plug that drives it
      Json schema = {{"type", {type == Type::kInt ? "integer" : "number", "string"}}};
      if (a.unit == Unit::kNone && !std::isinf(a.min)) schema["minimum"] = a.min;
      if (a.unit == Unit::kNone && !std::isinf(a.max)) schema["maximum"] = a.max;
      return schema;
    }
    case Type::kDouble3:
      return {{"anyOf", {Numbers(3), Ref("plug")}}};
    case Type::kQuaternion:
      return {{"anyOf", {Numbers(4), Ref("plug")}}};
    case Type::kMatrix:
      return Ref("matrix");
    case Type::kPoints:
    case Type::kColors:
      return {{"anyOf", {{{"type", "array"}, {"items", Numbers(3)}}, Ref("plug")}}};
    case Type::kWeights:
      return {{"anyOf", {{{"type", "array"}, {"items", Ref("number")}}, Ref("plug")}}};
    case Type::kInts:
      return OneOrList({{"type", "integer"}});
    case Type::kDoubles:
      return OneOrList(Ref("number"));
    default:
      return nullptr;
  }
}

std::string DocOf(const AttributeDef& a) {
  std::string doc = a.doc;
  const auto add = [&](const std::string& text) { doc += (doc.empty() ? "" : "; ") + text; };
  if (a.unit == Unit::kLength) add("a length in the file's unit");
  if (a.unit == Unit::kAngle) add("an angle in the file's unit");
  if (a.unit == Unit::kTime) add("a time in seconds");
  if (a.structural) add("structural: nothing that varies may drive it");
  return doc;
}

Json DefaultOf(const AttributeDef& a) {
  const Value& value = a.default_value;
  if (a.default_from || a.unit != Unit::kNone || a.array) return nullptr;
  if (a.type == Type::kBool) return value.AsInt() != 0;
  if (a.type == Type::kInt) return value.AsInt();
  if (a.type == Type::kDouble) return value.AsDouble();
  if (a.type == Type::kEnum) return a.enum_names.at(static_cast<std::size_t>(value.AsInt()));
  return nullptr;
}

void AddAttribute(const AttributeDef& a, Json* properties, Json* patterns) {
  const Json element = ValueSchema(a, a.type);
  if (element.is_null()) return;
  std::vector<std::string> names = a.aliases;
  names.insert(names.begin(), a.name);
  for (const std::string& name : names) {
    Json whole = a.array && !a.per_geometry ? Json{{"type", "array"}, {"items", element}} : element;
    whole = Described(std::move(whole), DocOf(a));
    if (const Json value = DefaultOf(a); !value.is_null()) whole["default"] = value;
    (*properties)[name] = std::move(whole);
    if (a.array) (*patterns)["^" + name + "\\[[^\\]]+\\]$"] = Described(element, DocOf(a));
    const std::string of_element = a.array ? "\\[[^\\]]+\\]" : "";
    if (a.type == Type::kDouble3 || a.type == Type::kQuaternion) {
      const bool four = a.type == Type::kQuaternion;
      (*patterns)["^" + name + of_element + (four ? "\\.[xyzw]$" : "\\.[xyz]$")] = Ref("number");
      if (!a.array) (*patterns)["^" + name + (four ? "[XYZW]$" : "[XYZ]$")] = Described(Ref("number"), a.doc);
    }
    if (IsPointType(a.type) && !a.array) {
      (*patterns)["^" + name + "\\[[^\\]]+\\]$"] = a.type == Type::kWeights ? Ref("number") : Ref("vector");
      (*patterns)["^" + name + "\\[[^\\]]+\\]\\.[xyz]$"] = Ref("number");
    }
  }
}

// An entry of a blend shape's targets: a name, or shapes of a file.
Json TargetSchema() {
  const Json shapes = Closed({{"file", {{"type", "string"}}},
                              {"shapes", OneOrList(Ref("name"))},
                              {"name", Ref("name")},
                              {"mesh", Ref("name")},
                              {"from", Ref("name")},
                              {"as", {{"enum", {"positions", "displacements"}}}},
                              {"unit", {{"enum", {"mm", "cm", "m"}}}}},
                             {"file"});
  return {{"anyOf", {Ref("name"), shapes}}};
}

Json WordSchema(const NodeDef& def, std::string_view word) {
  if (word == "at") return Ref("place");
  if (word == "members") return Ref("members");
  if (word == "weights") return OneOrList({{"type", "string"}});
  if (word == "falloff") return Ref("falloff");
  if (word == "targets" && def.name == "blendShape") return OneOrList(TargetSchema());
  if (word == "curves" || word == "targets" || word == "meshes" || word == "lights" || word == "carried" ||
      word == "falloffs")
    return ListOf(Ref("name"));
  if (word == "constrained") return OneOrList(Ref("name"));
  if (word == "combinations")
    return MapOf(Closed(
        {{"targets", ListOf(Ref("name"))}, {"method", {{"enum", {"multiply", "lowestWeighting", "smooth"}}}}},
        {"targets"}));
  if (word == "inbetweens") return MapOf(MapOf(Ref("name")));
  if (word == "poses") return MapOf(Numbers(3));
  if (word == "influences") return {{"type", "string"}};
  if (word == "blendWeights") return OneOrList({{"type", "string"}});
  if (word == "vertices") return Ref("vertices");
  if (word == "places") return {{"type", "array"}, {"items", Numbers(3)}};
  if (word == "closed") return Ref("flag");
  return Ref("name");
}

Json NodeSchema(const NodeDef& def) {
  Json properties = {{"type", {{"const", def.name}}}}, patterns = Json::object();
  for (const AttributeDef& a : def.attributes) {
    if (!a.output) AddAttribute(a, &properties, &patterns);
  }
  for (const RigWord& word : RigWordsOf(def)) {
    properties[word.name] = Described(WordSchema(def, word.name), word.doc);
  }
  Json schema = {{"description", def.doc}, {"properties", std::move(properties)}};
  if (!patterns.empty()) schema["patternProperties"] = std::move(patterns);
  schema["additionalProperties"] = false;
  return schema;
}

Json Definitions(const NodeRegistry& registry) {
  Json types = Json::array(), choices = Json::array(), defs;
  for (const std::string& name : registry.Names()) {
    types.push_back(name);
    choices.push_back({{"if", {{"properties", {{"type", {{"const", name}}}}}, {"required", {"type"}}}},
                       {"then", Ref("node." + name)}});
  }
  defs["name"] = {{"type", {"string", "number"}}};
  defs["plug"] = {{"type", "string"}};
  defs["flag"] = {{"type", {"boolean", "string"}}};
  defs["number"] = Described({{"type", {"number", "string"}}},
                             "in the file's unit, or with a suffix (mm cm m deg rad s f %), or a plug");
  defs["vector"] = {{"anyOf", {Numbers(3), Ref("plug")}}};
  defs["matrix"] = {
      {"anyOf",
       {{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 16}, {"maxItems", 16}},
        {{"type", "array"}, {"items", Numbers(4)}, {"minItems", 4}, {"maxItems", 4}},
        Ref("plug")}}};
  defs["vertices"] = Described(
      {{"anyOf", {{{"type", {"string", "integer"}}}, {{"type", "array"}, {"items", {{"type", "integer"}}}}}}},
      "indices, or ranges as in \"0:99,120\"");
  defs["place"] = {
      {"anyOf",
       {Closed({{"vertex", Ref("vertices")}, {"mesh", Ref("name")}}, {"vertex"}), Numbers(3), Ref("name")}}};
  defs["members"] = {{"anyOf",
                      {{{"const", "all"}},
                       Closed({{"vertices", Ref("vertices")},
                               {"primitive", {{"type", "integer"}, {"minimum", 0}}},
                               {"material", Ref("name")},
                               {"joint", Ref("name")},
                               {"above", Ref("number")},
                               {"weights", {{"type", "string"}}}}),
                       {{"type", "array"}, {"items", Ref("members")}}}}};
  const Json curve = {{"enum", {"smooth", "linear"}}}, radius = Ref("number");
  defs["falloff"] = {
      {"anyOf",
       {Closed({{"at", Ref("place")}, {"radius", radius}, {"curve", curve}}, {"at", "radius"}),
        Closed({{"sphere",
                 Closed({{"at", Ref("place")}, {"radius", radius}, {"curve", curve}}, {"at", "radius"})}},
               {"sphere"}),
        Closed({{"capsule",
                 Closed({{"from", Ref("place")}, {"to", Ref("place")}, {"radius", radius}, {"curve", curve}},
                        {"from", "to", "radius"})}},
               {"capsule"}),
        Closed({{"plane", Closed({{"at", Ref("place")},
                                  {"normal", Numbers(3)},
                                  {"from", Ref("number")},
                                  {"to", Ref("number")},
                                  {"curve", curve}},
                                 {"at", "normal", "from", "to"})}},
               {"plane"}),
        Closed({{"proximity",
                 Closed({{"mesh", Ref("name")}, {"radius", radius}, {"curve", curve}}, {"mesh", "radius"})}},
               {"proximity"}),
        Closed({{"weights", OneOrList({{"type", "string"}})}}, {"weights"}),
        Closed({{"combine", {{"enum", {"multiply", "max", "add"}}}}, {"of", ListOf(Ref("falloff"))}}, {"of"}),
        {{"type", "array"}, {"items", Ref("falloff")}},
        Ref("name")}}};
  defs["clips"] = OneOrList(Ref("name"));
  defs["node"] = {{"type", "object"},
                  {"properties", {{"type", {{"enum", std::move(types)}}}}},
                  {"required", {"type"}},
                  {"allOf", std::move(choices)}};
  for (const std::string& name : registry.Names()) defs["node." + name] = NodeSchema(*registry.Find(name));
  return defs;
}

}  // namespace

std::string RigSchema(const NodeRegistry& registry) {
  const Json files = OneOrList({{"type", "string"}});
  Json properties;
  properties["kpsa"] = Described({{"const", 1}}, "the version of the format");
  properties["units"] =
      Described(Closed({{"length", {{"enum", {"mm", "cm", "m"}}}}, {"angle", {{"enum", {"deg", "rad"}}}}}),
                "of bare numbers in this file; m and deg if not given");
  properties["fps"] =
      Described({{"type", "number"}, {"exclusiveMinimum", 0}}, "frames a second; 24 if not given");
  properties["character"] = Described({{"type", "string"}}, "a .glb, .gltf or .vrm, relative to this file");
  properties["include"] = Described(files, "other rig files, without `character`");
  properties["plugins"] = Described(files, "shared libraries that add node types");
  properties["weld"] = Described(Ref("flag"), "off: keep vertices apart that a UV seam splits");
  properties["nodes"] = MapOf(Ref("node"));
  properties["connections"] = ListOf(
      {{"anyOf",
        {{{"type", "string"}, {"pattern", " -> "}},
         Closed({{"from", Ref("plug")}, {"to", Ref("plug")}, {"override", Ref("flag")}}, {"from", "to"})}}});
  properties["deform"] = ListOf(
      Closed({{"meshes", OneOrList(Ref("name"))}, {"points", Ref("plug")}, {"stack", OneOrList(Ref("name"))}},
             {"stack"}));
  properties["controls"] =
      Described(MapOf(Closed({{"min", Ref("number")}, {"max", Ref("number")}}, {"min", "max"})),
                "what an animator, and the trainer, may move");
  properties["accelerate"] = MapOf(Closed(
      {{"points", Described(OneOrList(Ref("name")), "mesh@stage: up to and including the stage")},
       {"colors", Described(OneOrList(Ref("name")), "instead of points: outputs of colours, node.attribute")},
       {"space", Described(Ref("name"), "the transform in whose space the points are learnt")},
       {"subspace", Described({{"type", "string"}}, "the file that kpsa train writes")},
       {"tolerance", Ref("number")},
       {"violationRate",
        Described({{"type", {"number", "string"}}, {"minimum", 0}, {"maximum", 1}}, "of frames")},
       {"train", Closed({{"clips", Ref("clips")},
                         {"samples", {{"type", "integer"}, {"minimum", 0}}},
                         {"keyPoints", {{"type", "integer"}, {"minimum", 1}}},
                         {"heldOut", {{"type", "integer"}, {"minimum", 20}}}})},
       {"test", Closed({{"clips", Ref("clips")}})}}));
  properties["overrides"] =
      Described(MapOf(true), "plug: value; instead of what was set or connected before");
  properties["variants"] = Described(MapOf(MapOf(true)), "overrides that --variant chooses by name");
  const Json param = {{"type", {"string", "number", "boolean"}}};
  properties["templates"] = MapOf(Closed(
      {{"params", MapOf({{"enum", {"string", "number"}}})},
       {"nodes", Described({{"type", {"object", "null"}}}, "nodes in which $(param) stands for a parameter")},
       {"connections", {{"type", {"array", "null"}}}},
       {"deform", {{"type", {"array", "null"}}}},
       {"controls", {{"type", {"object", "null"}}}},
       {"use", {{"type", {"object", "null"}}}}}));
  properties["use"] = Described(MapOf({{"type", "object"},
                                       {"properties", {{"template", Ref("name")}}},
                                       {"required", {"template"}},
                                       {"additionalProperties", param}}),
                                "NAME: {template: NAME, ...}; its nodes are called NAME:node");
  const Json layer =
      Closed({{"clip", Ref("name")},
              {"weight", {{"type", {"number", "string"}}, {"minimum", 0}, {"maximum", 1}}},
              {"mode", {{"enum", {"override", "additive"}}}},
              {"mask", Described(OneOrList({{"type", "string"}}), "names of nodes, with * and ?")},
              {"start", Described({{"type", {"number", "string"}}}, "a frame, or with a suffix (s f)")},
              {"speed", {{"type", {"number", "string"}}}},
              {"loop", Ref("flag")}},
             {"clip"});
  properties["clips"] = Described(
      MapOf(
          Closed({{"layers", {{"type", "array"}, {"items", layer}, {"minItems", 1}}},
                  {"frames",
                   {{"type", "array"}, {"items", {{"type", "integer"}}}, {"minItems", 2}, {"maxItems", 2}}}},
                 {"layers"})),
      "clips of the character over each other, for --clip");
  properties["references"] =
      Described(MapOf(Closed({{"file", {{"type", "string"}}},
                              {"translate", Numbers(3)},
                              {"clip", Described(Ref("name"), "that it plays; its first one if not given")},
                              {"start", Described({{"type", {"number", "string"}}},
                                                  "when the clip begins: a frame, or with a suffix (s f)")}},
                             {"file"})),
                "other rigs; what they bring is called NAME:node");
  const Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                       {"title", "kpsa rig file, version 1"},
                       {"type", "object"},
                       {"properties", std::move(properties)},
                       {"required", {"kpsa"}},
                       {"additionalProperties", false},
                       {"$defs", Definitions(registry)}};
  return JsonText(schema);
}

}  // namespace kpsa::engine
