#include "rig/file/templates.h"

#include <algorithm>
#include <set>

#include "rig/file/sections.h"

namespace kpsa::engine {
namespace {

constexpr const char* kTemplate = "template";

std::vector<std::string> Keys(const auto& map) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : map) keys.push_back(key);
  return keys;
}

}  // namespace

void TemplateReader::ReadTemplates(const YamlNode& node, int source) {
  if (!node.is_map()) {
    errors_->Add(node, "templates: expected a map, found {}", node.kind_name());
    return;
  }
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const YamlNode& key = node.keys[i];
    const std::string what = fmt::format("template \"{}\"", key.scalar);
    if (!define_("template", key.scalar, key.where())) continue;
    Template read;
    read.source = source;
    YamlMap map(node.items[i], what, errors_);
    if (const YamlNode* params = map.Find("params"); params != nullptr && !params->is_null())
      ReadParams(*params, what, &read);
    for (const char* section : {"nodes", "connections", "deform", "controls", "use"}) (void)map.Find(section);
    map.RejectUnread();
    read.body = node.items[i];
    templates_.emplace(key.scalar, std::move(read));
  }
}

void TemplateReader::ReadParams(const YamlNode& node, const std::string& what, Template* to) {
  if (!node.is_map()) {
    errors_->Add(node, "{}: params: expected a map of names and types, found {}", what, node.kind_name());
    return;
  }
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const std::string& name = node.keys[i].scalar;
    std::string type;
    if (name.empty() || name == kTemplate || name.find(')') != std::string::npos) {
      errors_->Add(node.keys[i], "{}: no parameter may be called \"{}\"", what, name);
      continue;
    }
    if (!ReadString(node.items[i], "params." + name, &type, errors_)) continue;
    if (type != "string" && type != "number")
      errors_->Add(node.items[i], "params.{}: unknown type \"{}\"{}; expected string or number", name, type,
                   DidYouMean(type, {"string", "number"}));
    to->params[name] = type == "number" ? ParamType::kNumber : ParamType::kString;
  }
}

void TemplateReader::ReadUses(const YamlNode& node, int source) {
  if (!node.is_map()) {
    errors_->Add(node, "use: expected a map, found {}", node.kind_name());
    return;
  }
  for (std::size_t i = 0; i < node.keys.size(); ++i) uses_.push_back({node.keys[i], node.items[i], source});
}

void TemplateReader::Expand() {
  const std::vector<Use> uses = std::move(uses_);
  for (const Use& use : uses) {
    if (stopped_ || errors_->full()) break;
    ExpandUse(use);
  }
  if (stopped_) rig_->complete = false;  // what is missing is not worth an error a line
}

void TemplateReader::ExpandUse(const Use& use) {
  const auto sources = [this]() -> std::vector<RigSource>& { return rig_->sources; };
  const std::string name = sources()[static_cast<std::size_t>(use.source)].scope + use.key.scalar;
  if (use.key.scalar.empty() || name.size() > 1024) {
    errors_->Add(use.key, "a use needs a name, of at most 1024 bytes with those around it");
    return;
  }
  if (!define_("use", name, use.key.where())) return;
  if (++used_ > kMaxUses) {
    stopped_ = true;
    errors_->Add(use.key, "templates are used more than {} times", kMaxUses);
    return;
  }
  const YamlNode* of = use.body.is_map() ? use.body.Find(kTemplate) : nullptr;
  std::string template_name;
  if (of == nullptr) {
    errors_->Add(use.body, "use \"{}\": expected {{template: NAME, ...}}", name);
    return;
  }
  if (!ReadString(*of, fmt::format("use \"{}\": template", name), &template_name, errors_)) return;
  const auto found = templates_.find(template_name);
  if (found == templates_.end()) {
    errors_->Add(*of, "use \"{}\": unknown template \"{}\"{}", name, template_name,
                 DidYouMean(template_name, Keys(templates_)));
    return;
  }
  if (std::find(open_.begin(), open_.end(), template_name) != open_.end()) {
    errors_->Add(*of, "templates use each other in a circle: {} -> {}", fmt::join(open_, " -> "),
                 template_name);
    stopped_ = true;
    return;
  }
  if (open_.size() >= kMaxUseDepth) {
    errors_->Add(*of, "templates are used within each other more than {} deep", kMaxUseDepth);
    stopped_ = true;
    return;
  }
  const Template& from = found->second;
  Values values;
  YamlNode body;
  if (!ReadValues(use, name, from, &values) || !Substitute(from.body, values, &body) || !body.is_map())
    return;

  RigSource source = sources()[static_cast<std::size_t>(from.source)];
  source.scope = name + ":";
  source.outer = use.source;
  const int number = static_cast<int>(sources().size());
  sources().push_back(std::move(source));
  SectionReader sections{rig_, errors_, number, define_};
  const auto section = [&](const char* key) {
    const YamlNode* node = body.Find(key);
    return node == nullptr || node->is_null() ? nullptr : node;
  };
  if (const YamlNode* node = section("nodes")) sections.ReadNodes(*node);
  if (const YamlNode* node = section("connections")) sections.ReadConnections(*node);
  if (const YamlNode* node = section("deform")) sections.ReadDeform(*node);
  if (const YamlNode* node = section("controls")) sections.ReadControls(*node);
  const YamlNode* inner = section("use");
  if (inner == nullptr) return;
  if (!inner->is_map()) {
    errors_->Add(*inner, "use: expected a map, found {}", inner->kind_name());
    return;
  }
  open_.push_back(template_name);
  for (std::size_t i = 0; i < inner->keys.size() && !stopped_ && !errors_->full(); ++i)
    ExpandUse({inner->keys[i], inner->items[i], number});
  open_.pop_back();
}

// The parameters of a use: all that the template declares, and no others.
bool TemplateReader::ReadValues(const Use& use, const std::string& name, const Template& from,
                                Values* values) {
  bool good = true;
  for (std::size_t i = 0; i < use.body.keys.size(); ++i) {
    const YamlNode& key = use.body.keys[i];
    const YamlNode& value = use.body.items[i];
    if (key.scalar == kTemplate) continue;
    const auto param = from.params.find(key.scalar);
    if (param == from.params.end()) {
      good = errors_->Add(key, "use \"{}\": the template has no parameter \"{}\"{}", name, key.scalar,
                          DidYouMean(key.scalar, Keys(from.params)));
      continue;
    }
    std::string text;
    if (!ReadString(value, fmt::format("use \"{}\": {}", name, key.scalar), &text, errors_)) {
      good = false;
    } else if (param->second == ParamType::kNumber && !LooksNumeric(text)) {
      good = errors_->Add(value, "use \"{}\": {}: expected a number, found \"{}\"", name, key.scalar, text);
    }
    (*values)[key.scalar] = std::move(text);
  }
  for (const auto& [param, type] : from.params) {
    if (values->count(param) == 0)
      good =
          errors_->Add(use.key, "use \"{}\": the parameter \"{}\" of the template is missing", name, param);
  }
  return good;
}

bool TemplateReader::OverBudget(const YamlNode& at) {
  if (nodes_ <= kMaxExpandedNodes && bytes_ <= kMaxExpandedBytes) return false;
  if (!stopped_)
    errors_->Add(at, "templates expand to more than {} values or {} MB", kMaxExpandedNodes,
                 kMaxExpandedBytes >> 20);
  stopped_ = true;
  return true;
}

bool TemplateReader::Substitute(const YamlNode& from, const Values& values, YamlNode* to) {
  ++nodes_;
  if (OverBudget(from)) return false;
  to->kind = from.kind, to->quoted = from.quoted, to->line = from.line, to->column = from.column;
  to->file = from.file, to->tag = from.tag;
  if (!SubstituteText(from, values, &to->scalar)) return false;
  std::set<std::string> keys;
  for (const YamlNode& key : from.keys) {
    to->keys.emplace_back();
    if (!Substitute(key, values, &to->keys.back())) return false;
    if (!keys.insert(to->keys.back().scalar).second)
      return errors_->Add(key, "the key \"{}\" comes up twice in its map", to->keys.back().scalar);
  }
  for (const YamlNode& item : from.items) {
    to->items.emplace_back();
    if (!Substitute(item, values, &to->items.back())) return false;
  }
  return true;
}

// One pass: what a value brings is not looked through again.
bool TemplateReader::SubstituteText(const YamlNode& from, const Values& values, std::string* to) {
  const std::string& text = from.scalar;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t open = text.find("$(", at);
    to->append(text, at, open - at);
    if (open == std::string::npos) break;
    const std::size_t close = text.find(')', open);
    if (close == std::string::npos) return errors_->Add(from, "\"{}\": $( without )", text);
    const std::string param = text.substr(open + 2, close - open - 2);
    const auto value = values.find(param);
    if (value == values.end())
      return errors_->Add(from, "\"{}\": the template has no parameter \"{}\"{}", text, param,
                          DidYouMean(param, Keys(values)));
    bytes_ += value->second.size();
    if (OverBudget(from)) return false;
    to->append(value->second);
    at = close + 1;
  }
  bytes_ += text.size();
  return true;
}

}  // namespace kpsa::engine
