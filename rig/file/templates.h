// Inside of the rig reader: `templates:`, and what `use:` makes of them. Nothing outside rig/file/rig_file*.cpp and
// rig/file/templates.cpp includes this.
//
//   templates: {arm: {params: {s: string}, nodes: {hand: {type: transform, at: wrist.$(s)}}}}
//   use: {arm_L: {template: arm, s: L}}            makes the node arm_L:hand
//
// A template has nodes, connections, deform, controls and uses of other templates. $(param) stands in keys
// and values. Names of a template's own nodes are seen without their prefix inside it (rig/build/scopes.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "rig/file/rig_file.h"

namespace kpsa::engine {

class TemplateReader {
 public:
  // Notes a key of a section; false if it was defined before.
  using Define =
      std::function<bool(const std::string& section, const std::string& key, const SourceLocation& where)>;
  TemplateReader(RigFile* rig, YamlErrors* errors, Define define)
      : rig_(rig), errors_(errors), define_(std::move(define)) {}

  void ReadTemplates(const YamlNode& node, int source);
  void ReadUses(const YamlNode& node, int source);
  // Adds what the uses make, once all files are read. Errors, at their lines: unknown templates and
  // parameters, missing ones, values of another type, templates that use themselves, and more than kMaxUses
  // uses, kMaxUseDepth of them within each other, kMaxExpandedNodes or kMaxExpandedBytes of YAML.
  void Expand();

  static constexpr std::size_t kMaxUses = 10'000;
  static constexpr std::size_t kMaxUseDepth = 32;
  static constexpr std::size_t kMaxExpandedNodes = 1'000'000;
  static constexpr std::size_t kMaxExpandedBytes = 64u << 20;

 private:
  enum class ParamType : std::uint8_t { kString, kNumber };
  using Values = std::map<std::string, std::string>;
  struct Template {
    std::map<std::string, ParamType> params;
    YamlNode body;
    int source = 0;
  };
  struct Use {
    YamlNode key, body;
    int source = 0;
  };

  void ReadParams(const YamlNode& node, const std::string& what, Template* to);
  void ExpandUse(const Use& use);
  bool ReadValues(const Use& use, const std::string& name, const Template& from, Values* values);
  bool Substitute(const YamlNode& from, const Values& values, YamlNode* to);
  bool SubstituteText(const YamlNode& from, const Values& values, std::string* to);
  bool OverBudget(const YamlNode& at);

  RigFile* rig_;
  YamlErrors* errors_;
  Define define_;
  std::map<std::string, Template> templates_;
  std::vector<Use> uses_;
  std::vector<std::string> open_;  // templates that are being expanded, the outermost first
  std::size_t used_ = 0, nodes_ = 0, bytes_ = 0;
  bool stopped_ = false;
};

}  // namespace kpsa::engine
