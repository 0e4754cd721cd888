// The one door to yaml-cpp: a YAML document as a small tree whose scalars stay text, so that the reader's
// schema decides what `010`, `no` and `1e999` mean. Every node knows its place.
//
// Refused, each at its place: syntax errors, no or several documents, duplicate keys, keys that are no
// scalars, `<<` merges, aliases that grow the tree beyond kMaxAliasNodes (or contain themselves), invalid
// UTF-8 and control characters, more than kMaxYamlBytes, kMaxYamlNodes or kMaxYamlDepth. A byte order mark
// and CRLF are accepted.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "files/quantity.h"

namespace kpsa::engine {

inline constexpr std::size_t kMaxYamlBytes = 16u << 20;
inline constexpr std::size_t kMaxYamlNodes = 1'000'000;
inline constexpr std::size_t kMaxAliasNodes = 100'000;
inline constexpr int kMaxYamlDepth = 64;

struct YamlNode {
  enum class Kind : std::uint8_t { kNull, kScalar, kSequence, kMap };
  Kind kind = Kind::kNull;
  bool quoted = false;  // of a scalar: written in quotes or as a block
  int line = 0, column = 0;
  std::shared_ptr<const std::string> file;
  std::string scalar;
  std::string tag;              // as written ("!ruby"); empty for none
  std::vector<YamlNode> keys;   // of a map: scalars, in the file's order
  std::vector<YamlNode> items;  // of a sequence, or the values of a map

  bool is_null() const { return kind == Kind::kNull; }
  bool is_scalar() const { return kind == Kind::kScalar; }
  bool is_sequence() const { return kind == Kind::kSequence; }
  bool is_map() const { return kind == Kind::kMap; }
  const YamlNode* Find(std::string_view key) const;  // of a map; null if it has no such key
  SourceLocation where() const { return {file == nullptr ? std::string() : *file, line, column}; }
  const char* kind_name() const;  // "a list", ... for messages
};

// `name` is used in locations.
Result<YamlNode> ParseYaml(std::string_view text, const std::string& name);
Result<YamlNode> ReadYamlFile(const std::string& path);

// --- Typed reads. Each appends its error, located, to `errors` and returns false.
class YamlErrors {
 public:
  template <typename... Args>
  bool Add(const YamlNode& node, fmt::format_string<Args...> format, Args&&... args) {
    Append(Status::Invalid(format, std::forward<Args>(args)...).At(node.where()));
    return false;
  }
  bool Add(const YamlNode& node, Status status) {
    if (status.ok()) return true;
    Append(std::move(status).At(node.where()));
    return false;
  }
  // Each error once: what several meshes share is read for each of them.
  void Append(Status status);
  bool ok() const { return status_.ok(); }
  // Nobody reads more: loops over an author's lines stop then. Later errors are dropped.
  bool full() const { return count() >= kMaxErrors; }
  std::size_t count() const { return status_.errors().size(); }
  Status Take() { return std::move(status_); }

 private:
  static constexpr std::size_t kMaxErrors = 100;
  Status status_;
};

bool ReadString(const YamlNode& node, std::string_view what, std::string* value, YamlErrors* errors);
// true, on, yes, false, off or no, as "on", "On" or "ON".
std::optional<bool> ParseBool(std::string_view text);
bool ReadBool(const YamlNode& node, std::string_view what, bool* value,
              YamlErrors* errors);  // true/false, on/off, yes/no
bool ReadNumber(const YamlNode& node, std::string_view what, Unit unit, const FileUnits& units, double* value,
                YamlErrors* errors);
bool ReadInteger(const YamlNode& node, std::string_view what, std::int64_t min, std::int64_t max,
                 std::int64_t* value, YamlErrors* errors);
// A list of strings; one string alone is a list of one.
bool ReadStrings(const YamlNode& node, std::string_view what, std::vector<std::string>* values,
                 YamlErrors* errors);

// A map that is read key by key; keys that nobody asked for are errors with the nearest key that was asked
// for.
class YamlMap {
 public:
  // `what` begins messages: "node \"mush\"". A node that is no map is an error; it then reads as an empty
  // map.
  YamlMap(const YamlNode& node, std::string what, YamlErrors* errors);
  const YamlNode* Find(std::string_view key);      // null if absent
  const YamlNode* Required(std::string_view key);  // an error if absent
  void RejectUnread();
  const YamlNode& node() const { return *node_; }
  const std::string& what() const { return what_; }

 private:
  const YamlNode* node_;
  std::string what_;
  YamlErrors* errors_;
  bool is_map_;
  std::vector<std::string> asked_;
};

}  // namespace kpsa::engine
