#include "gltf/vrm.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;
using ExpressionKind = Expression::Kind;

// VRM 1.0's names, then those of VRM 0.x.
ExpressionKind KindOf(std::string_view preset) {
  static const std::pair<std::string_view, ExpressionKind> kKinds[] = {
      {"blink", ExpressionKind::kBlink},      {"blinkLeft", ExpressionKind::kBlink},
      {"blinkRight", ExpressionKind::kBlink}, {"lookUp", ExpressionKind::kLookAt},
      {"lookDown", ExpressionKind::kLookAt},  {"lookLeft", ExpressionKind::kLookAt},
      {"lookRight", ExpressionKind::kLookAt}, {"aa", ExpressionKind::kMouth},
      {"ih", ExpressionKind::kMouth},         {"ou", ExpressionKind::kMouth},
      {"ee", ExpressionKind::kMouth},         {"oh", ExpressionKind::kMouth},
      {"blink_l", ExpressionKind::kBlink},    {"blink_r", ExpressionKind::kBlink},
      {"lookup", ExpressionKind::kLookAt},    {"lookdown", ExpressionKind::kLookAt},
      {"lookleft", ExpressionKind::kLookAt},  {"lookright", ExpressionKind::kLookAt},
      {"a", ExpressionKind::kMouth},          {"i", ExpressionKind::kMouth},
      {"u", ExpressionKind::kMouth},          {"e", ExpressionKind::kMouth},
      {"o", ExpressionKind::kMouth}};
  for (const auto& [name, kind] : kKinds) {
    if (name == preset) return kind;
  }
  return ExpressionKind::kOther;
}

const json* FindKey(const json& object, const char* key) {
  const auto found = object.find(key);  // none of what is no object
  return found == object.end() ? nullptr : &*found;
}
std::string TextOf(const json& object, const char* key) {
  const json* value = FindKey(object, key);
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}
bool IsTrue(const json& object, const char* key) {
  const json* value = FindKey(object, key);
  return value != nullptr && value->is_boolean() && value->get<bool>();
}
bool ReadIndex(const json& object, const char* key, std::size_t size, Index* index) {
  const json* value = FindKey(object, key);
  if (value == nullptr || !value->is_number_unsigned() || value->get<std::uint64_t>() >= size) return false;
  *index = value->get<Index>();
  return true;
}
// `fallback` where there is none.
bool ReadWeight(const json& object, double fallback, double largest, double* weight) {
  const json* value = FindKey(object, "weight");
  if (value != nullptr && !value->is_number()) return false;
  *weight = std::clamp((value == nullptr ? fallback : value->get<double>()) / largest, 0.0, 1.0);
  return true;
}
std::size_t SizeOf(const json* array) { return array != nullptr && array->is_array() ? array->size() : 0; }

class VrmReader {
 public:
  explicit VrmReader(Character* character) : character_(*character) {}

  // VRM 0.x: an array of groups.
  void ReadGroups(const json& master) {
    const json* groups = FindKey(master, "blendShapeGroups");
    for (std::size_t g = 0; g < SizeOf(groups); ++g) {
      const json& group = (*groups)[g];
      const std::string place = fmt::format("VRM.blendShapeMaster.blendShapeGroups[{}]", g);
      if (!group.is_object()) {
        Ignore(place);
        continue;
      }
      const std::string preset = TextOf(group, "presetName");
      const bool known = !preset.empty() && preset != "unknown";
      Expression& expression =
          Add(known ? preset : TextOf(group, "name"), known ? KindOf(preset) : ExpressionKind::kOther);
      expression.is_binary = IsTrue(group, "isBinary");
      ignores_materials_ = ignores_materials_ || SizeOf(FindKey(group, "materialValues")) != 0;
      const json* binds = FindKey(group, "binds");
      for (std::size_t b = 0; b < SizeOf(binds); ++b) {
        ExpressionBind bind;
        const json& in = (*binds)[b];
        if (ReadIndex(in, "mesh", character_.meshes.size(), &bind.mesh) && ReadTarget(in, &bind) &&
            ReadWeight(in, 0, 100, &bind.weight)) {
          expression.binds.push_back(bind);
        } else {
          Ignore(fmt::format("{}.binds[{}]", place, b));
        }
      }
    }
  }

  // VRM 1.0: objects by name.
  void ReadExpressions(const json& expressions) {
    for (const char* part : {"preset", "custom"}) {
      const json* named = FindKey(expressions, part);
      if (named == nullptr || !named->is_object()) continue;
      for (const auto& [name, in] : named->items()) {
        const std::string place = fmt::format("VRMC_vrm.expressions.{}.{}", part, name);
        if (!in.is_object()) {
          Ignore(place);
          continue;
        }
        Expression& expression = Add(name, part[0] == 'p' ? KindOf(name) : ExpressionKind::kOther);
        expression.is_binary = IsTrue(in, "isBinary");
        expression.blink = OverrideOf(in, "overrideBlink", place);
        expression.look_at = OverrideOf(in, "overrideLookAt", place);
        expression.mouth = OverrideOf(in, "overrideMouth", place);
        ignores_materials_ = ignores_materials_ || SizeOf(FindKey(in, "materialColorBinds")) != 0 ||
                             SizeOf(FindKey(in, "textureTransformBinds")) != 0;
        const json* binds = FindKey(in, "morphTargetBinds");
        for (std::size_t b = 0; b < SizeOf(binds); ++b) {
          ExpressionBind bind;
          if (ReadNodeBind((*binds)[b], &bind)) {
            expression.binds.push_back(bind);
          } else {
            Ignore(fmt::format("{}.morphTargetBinds[{}]", place, b));
          }
        }
      }
    }
  }

  void ReadConstraint(Index node, const json& extension) {
    static const std::array<std::string_view, 6> kAim = {"PositiveX", "NegativeX", "PositiveY",
                                                         "NegativeY", "PositiveZ", "NegativeZ"};
    static const std::array<std::string_view, 3> kRoll = {"X", "Y", "Z"};
    NodeConstraint constraint;
    constraint.node = node;
    const json* kinds = FindKey(extension, "constraint");
    const json* in = nullptr;
    bool good = true;
    const auto axis = [&](const auto& names, const char* key) {
      const std::string name = TextOf(*in, key);
      const auto found = std::find(names.begin(), names.end(), name);
      constraint.axis = static_cast<int>(found - names.begin());
      return found != names.end();
    };
    if (kinds != nullptr && (in = FindKey(*kinds, "roll")) != nullptr) {
      constraint.type = NodeConstraint::Type::kRoll;
      good = axis(kRoll, "rollAxis");
    } else if (kinds != nullptr && (in = FindKey(*kinds, "aim")) != nullptr) {
      constraint.type = NodeConstraint::Type::kAim;
      good = axis(kAim, "aimAxis");
    } else {
      in = kinds == nullptr ? nullptr : FindKey(*kinds, "rotation");
    }
    if (in != nullptr && good && ReadIndex(*in, "source", character_.nodes.size(), &constraint.source) &&
        constraint.source != node && ReadWeight(*in, 1, 1, &constraint.weight)) {
      character_.constraints.push_back(constraint);
    } else {
      Ignore(fmt::format("nodes[{}].extensions.VRMC_node_constraint", node));
    }
  }

  void Finish() {
    if (ignored_ > 0) {
      character_.warnings.push_back(
          fmt::format("{} part(s) of VRM's extensions name nothing in the file and are ignored: {}{}",
                      ignored_, first_ignored_, ignored_ > 1 ? ", ..." : ""));
    }
    if (ignores_materials_)
      character_.warnings.push_back("what VRM's expressions do to materials and textures is ignored");
  }

 private:
  void Ignore(const std::string& place) {
    if (ignored_++ == 0) first_ignored_ = place;
  }
  Expression& Add(std::string name, ExpressionKind kind) {
    if (name.empty()) name = fmt::format("expression{}", character_.expressions.size());
    if (!names_.insert(name).second) {
      name += fmt::format("#{}", character_.expressions.size());
      while (!names_.insert(name).second) name += '#';
    }
    Expression& expression = character_.expressions.emplace_back();
    expression.name = std::move(name);
    expression.kind = kind;
    return expression;
  }
  bool ReadTarget(const json& in, ExpressionBind* bind) const {
    return ReadIndex(in, "index", character_.meshes[bind->mesh].targets.size(), &bind->target);
  }
  bool ReadNodeBind(const json& in, ExpressionBind* bind) const {
    if (!ReadIndex(in, "node", character_.nodes.size(), &bind->node)) return false;
    bind->mesh = character_.nodes[bind->node].mesh;
    return bind->mesh != kNoIndex && ReadTarget(in, bind) && ReadWeight(in, 0, 1, &bind->weight);
  }
  Expression::Override OverrideOf(const json& in, const char* key, const std::string& place) {
    const std::string text = TextOf(in, key);
    if (text == "block") return Expression::Override::kBlock;
    if (text == "blend") return Expression::Override::kBlend;
    if (FindKey(in, key) != nullptr && text != "none") Ignore(fmt::format("{}.{}", place, key));
    return Expression::Override::kNone;
  }

  Character& character_;
  std::set<std::string> names_;
  std::size_t ignored_ = 0;
  std::string first_ignored_;
  bool ignores_materials_ = false;
};

}  // namespace

Status ReadVrm(const Document& document, Character* character) {
  if (document.vrm.empty()) return {};
  const json parts = json::parse(document.vrm);
  VrmReader reader(character);
  if (const json* expressions = FindKey(parts, "VRMC_vrm")) {
    reader.ReadExpressions(*expressions);  // a file of both versions means the newer one
  } else if (const json* master = FindKey(parts, "VRM")) {
    reader.ReadGroups(*master);
  }
  if (const json* constraints = FindKey(parts, "constraints")) {
    for (const json& pair : *constraints) reader.ReadConstraint(pair[0].get<Index>(), pair[1]);
  }
  reader.Finish();
  return {};
}

}  // namespace kpsa::engine::gltf
