// Typed reads of a YAML tree.
#include <algorithm>
#include <cmath>

#include "files/yaml_document.h"

namespace kpsa::engine {
namespace {

bool CheckScalar(const YamlNode& node, std::string_view what, const char* expected, YamlErrors* errors) {
  if (node.is_scalar()) return true;
  return errors->Add(node, "{}: expected {}, found {}", what, expected, node.kind_name());
}

}  // namespace

bool ReadString(const YamlNode& node, std::string_view what, std::string* value, YamlErrors* errors) {
  if (!CheckScalar(node, what, "a string", errors)) return false;
  *value = node.scalar;
  return true;
}

std::optional<bool> ParseBool(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  std::string upper(text), title = lower;
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  if (!title.empty()) title[0] = upper[0];
  if (text != lower && text != upper && text != title) return std::nullopt;
  if (lower == "true" || lower == "on" || lower == "yes") return true;
  if (lower == "false" || lower == "off" || lower == "no") return false;
  return std::nullopt;
}

bool ReadBool(const YamlNode& node, std::string_view what, bool* value, YamlErrors* errors) {
  if (!CheckScalar(node, what, "true or false", errors)) return false;
  const std::optional<bool> read = ParseBool(node.scalar);
  if (!read.has_value())
    return errors->Add(node, "{}: expected true or false, found \"{}\"", what, node.scalar);
  *value = *read;
  return true;
}

bool ReadNumber(const YamlNode& node, std::string_view what, Unit unit, const FileUnits& units, double* value,
                YamlErrors* errors) {
  if (!CheckScalar(node, what, "a number", errors)) return false;
  Result<double> number = ParseQuantity(node.scalar, unit, units);
  if (!number.ok()) return errors->Add(node, "{}: {}", what, number.status().errors().front().message);
  *value = *number;
  return true;
}

bool ReadInteger(const YamlNode& node, std::string_view what, std::int64_t min, std::int64_t max,
                 std::int64_t* value, YamlErrors* errors) {
  double number = 0;
  if (!ReadNumber(node, what, Unit::kNone, FileUnits(), &number, errors)) return false;
  if (number != std::floor(number) || number < static_cast<double>(min) ||
      number > static_cast<double>(max)) {
    return errors->Add(node, "{}: expected a whole number from {} to {}, found {}", what, min, max,
                       node.scalar);
  }
  *value = static_cast<std::int64_t>(number);
  return true;
}

bool ReadStrings(const YamlNode& node, std::string_view what, std::vector<std::string>* values,
                 YamlErrors* errors) {
  values->clear();
  if (node.is_scalar()) {
    values->push_back(node.scalar);
    return true;
  }
  if (!node.is_sequence())
    return errors->Add(node, "{}: expected a list of names, found {}", what, node.kind_name());
  bool good = true;
  for (const YamlNode& item : node.items) {
    std::string text;
    if (ReadString(item, what, &text, errors)) {
      values->push_back(std::move(text));
    } else {
      good = false;
    }
  }
  return good;
}

YamlMap::YamlMap(const YamlNode& node, std::string what, YamlErrors* errors)
    : node_(&node), what_(std::move(what)), errors_(errors), is_map_(node.is_map()) {
  if (!is_map_) errors_->Add(node, "{}: expected a map, found {}", what_, node.kind_name());
}

const YamlNode* YamlMap::Find(std::string_view key) {
  if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) asked_.emplace_back(key);
  return is_map_ ? node_->Find(key) : nullptr;
}

const YamlNode* YamlMap::Required(std::string_view key) {
  const YamlNode* found = Find(key);
  if (found == nullptr && is_map_) errors_->Add(*node_, "{}: the key \"{}\" is missing", what_, key);
  return found;
}

void YamlMap::RejectUnread() {
  if (!is_map_) return;
  for (const YamlNode& key : node_->keys) {
    if (std::find(asked_.begin(), asked_.end(), key.scalar) != asked_.end()) continue;
    errors_->Add(key, "{}: unknown key \"{}\"{}; the keys are {}", what_, key.scalar,
                 DidYouMean(key.scalar, asked_), fmt::join(asked_, ", "));
  }
}

}  // namespace kpsa::engine
