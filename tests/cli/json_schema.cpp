#include "tests/cli/json_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

class Checker {
 public:
  explicit Checker(const Json& root) : root_(root) {}

  void Check(const Json& schema, const Json& value, const std::string& at) {
    if (schema.is_boolean()) {
      if (!schema.get<bool>()) Report(at, "is not allowed");
      return;
    }
    static const std::set<std::string> kKnown = {"$schema",
                                                 "$defs",
                                                 "title",
                                                 "description",
                                                 "default",
                                                 "$ref",
                                                 "type",
                                                 "enum",
                                                 "const",
                                                 "minimum",
                                                 "exclusiveMinimum",
                                                 "maximum",
                                                 "minItems",
                                                 "maxItems",
                                                 "items",
                                                 "pattern",
                                                 "anyOf",
                                                 "allOf",
                                                 "if",
                                                 "then",
                                                 "required",
                                                 "properties",
                                                 "patternProperties",
                                                 "additionalProperties"};
    for (const auto& [keyword, unused] : schema.items()) {
      if (kKnown.count(keyword) == 0) Report(at, "unknown keyword " + keyword);
    }
    if (schema.contains("$ref"))
      Check(root_.at(Json::json_pointer(schema["$ref"].get<std::string>().substr(1))), value, at);
    if (schema.contains("type") && !HasType(schema["type"], value))
      Report(at, fmt::format("is {}, expected {}", value.dump(), schema["type"].dump()));
    if (schema.contains("const") && schema["const"] != value)
      Report(at, fmt::format("is {}, expected {}", value.dump(), schema["const"].dump()));
    if (schema.contains("enum") &&
        std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end())
      Report(at, fmt::format("is {}, expected one of {}", value.dump(), schema["enum"].dump()));
    if (value.is_number()) CheckNumber(schema, value.get<double>(), at);
    if (value.is_string() && schema.contains("pattern") &&
        !std::regex_search(value.get<std::string>(), std::regex(schema["pattern"].get<std::string>())))
      Report(at, "does not match " + schema["pattern"].dump());
    if (value.is_array()) CheckItems(schema, value, at);
    if (value.is_object()) CheckProperties(schema, value, at);
    for (const Json& part : schema.value("allOf", Json::array())) Check(part, value, at);
    if (schema.contains("if") && Fits(schema["if"], value) && schema.contains("then"))
      Check(schema["then"], value, at);
    if (schema.contains("anyOf")) {
      const Json& any = schema["anyOf"];
      if (std::none_of(any.begin(), any.end(), [&](const Json& part) { return Fits(part, value); }))
        Report(at, fmt::format("{} fits none of {}", value.dump(), any.dump()));
    }
  }
  std::vector<std::string> problems;

 private:
  void Report(const std::string& at, const std::string& text) {
    problems.push_back((at.empty() ? "/" : at) + ": " + text);
  }
  bool Fits(const Json& schema, const Json& value) const {
    Checker other(root_);
    other.Check(schema, value, "");
    return other.problems.empty();
  }
  static bool HasType(const Json& type, const Json& value) {
    if (type.is_array())
      return std::any_of(type.begin(), type.end(), [&](const Json& one) { return HasType(one, value); });
    if (type == "integer") return value.is_number() && value.get<double>() == std::floor(value.get<double>());
    return type == "number" ? value.is_number() : type == value.type_name();
  }
  void CheckNumber(const Json& schema, double value, const std::string& at) {
    if (schema.contains("minimum") && value < schema["minimum"].get<double>())
      Report(at, fmt::format("is {}, below {}", value, schema["minimum"].dump()));
    if (schema.contains("exclusiveMinimum") && value <= schema["exclusiveMinimum"].get<double>())
      Report(at, fmt::format("is {}, not above {}", value, schema["exclusiveMinimum"].dump()));
    if (schema.contains("maximum") && value > schema["maximum"].get<double>())
      Report(at, fmt::format("is {}, above {}", value, schema["maximum"].dump()));
  }
  void CheckItems(const Json& schema, const Json& value, const std::string& at) {
    if (schema.contains("minItems") && value.size() < schema["minItems"].get<std::size_t>())
      Report(at, fmt::format("has {} items", value.size()));
    if (schema.contains("maxItems") && value.size() > schema["maxItems"].get<std::size_t>())
      Report(at, fmt::format("has {} items", value.size()));
    for (std::size_t i = 0; i < value.size() && schema.contains("items"); ++i)
      Check(schema["items"], value[i], fmt::format("{}/{}", at, i));
  }
  void CheckProperties(const Json& schema, const Json& value, const std::string& at) {
    for (const Json& name : schema.value("required", Json::array())) {
      if (!value.contains(name.get<std::string>())) Report(at, "lacks " + name.dump());
    }
    const Json patterns = schema.value("patternProperties", Json::object());
    for (const auto& [name, item] : value.items()) {
      const std::string place = at + "/" + name;
      bool known = false;
      if (schema.contains("properties") && schema["properties"].contains(name)) {
        known = true;
        Check(schema["properties"][name], item, place);
      }
      for (const auto& [pattern, part] : patterns.items()) {
        if (!std::regex_search(name, std::regex(pattern))) continue;
        known = true;
        Check(part, item, place);
      }
      if (!known && schema.contains("additionalProperties"))
        Check(schema["additionalProperties"], item, place);
    }
  }

  const Json& root_;
};

}  // namespace

std::vector<std::string> SchemaProblems(const nlohmann::json& schema, const nlohmann::json& value) {
  Checker checker(schema);
  checker.Check(schema, value, "");
  return checker.problems;
}

}  // namespace kpsa::engine
