#include "rig/file/format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kWidth = 150;  // of a line
constexpr int kStep = 2;

constexpr const char* kSections[] = {"kpsa",      "units",       "fps",        "character", "include",
                                     "plugins",   "weld",        "references", "templates", "use",
                                     "nodes",     "connections", "deform",     "controls",  "accelerate",
                                     "overrides", "variants",    "clips"};
// Of these, the ones that are no list of entries: on their line.
constexpr const char* kOneLine[] = {"kpsa", "units", "fps", "character", "include", "plugins", "weld"};

template <std::size_t N>
std::size_t PlaceOf(const char* const (&list)[N], std::string_view word) {
  return static_cast<std::size_t>(std::find(std::begin(list), std::end(list), word) - std::begin(list));
}

// A plain decimal number, as any YAML reader takes it.
bool IsNumber(std::string_view text) {
  return ParseQuantity(text, Unit::kNone, FileUnits()).ok() && text.find('%') == std::string_view::npos;
}

// What some version of YAML reads as something else than a string.
bool LooksTyped(std::string_view text) {
  if (text.empty() || text == "~" || text == "<<" || text == "=") return true;
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  for (const char* word :
       {"null", "true", "false", "yes", "no", "on", "off", "y", "n", ".inf", "-.inf", "+.inf", ".nan"}) {
    if (lower == word) return true;
  }
  const std::size_t first = lower.find_first_not_of("+-.");
  const bool digit = first != std::string::npos && lower[first] >= '0' && lower[first] <= '9';
  // 1e3, 010, 0x1F, 1_000, 12:30, 2001-12-14
  return digit && lower.find_first_not_of("0123456789+-._:abcdefox t%z") == std::string::npos;
}

// Whether a scalar stands without quotes, in braces or outside of them.
bool IsPlain(std::string_view text, bool in_flow) {
  if (text.empty() || text.front() == ' ' || text.back() == ' ' || text.back() == ':') return false;
  if (std::string_view("?:,[]{}#&*!|>'\"%@`=").find(text.front()) != std::string_view::npos) return false;
  if (text.front() == '-' && (text.size() == 1 || text[1] == ' ' || text.starts_with("---"))) return false;
  if (text.starts_with("...") || text == "~" || text == "<<") return false;
  if (text.find(": ") != std::string_view::npos || text.find(" #") != std::string_view::npos) return false;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 32 || byte == 127) return false;
  }
  for (const char* unseen : {"\xC2\x85", "\xE2\x80\xA8", "\xE2\x80\xA9", "\xEF\xBB\xBF"}) {
    if (text.find(unseen) != std::string_view::npos) return false;
  }
  return !in_flow || text.find_first_of(",[]{}?") == std::string_view::npos;
}

std::string InQuotes(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (c == '\n') {
      quoted += "\\n";
    } else if (c == '\t') {
      quoted += "\\t";
    } else if (byte < 32 || byte == 127) {
      quoted += fmt::format("\\x{:02X}", byte);
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

class Formatter {
 public:
  Formatter(const NodeRegistry& registry, const CommentMap& comments)
      : registry_(registry), comments_(comments) {}

  std::string Root(const YamlNode& root) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < root.keys.size(); ++i) order.push_back(i);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return PlaceOf(kSections, root.keys[a].scalar) < PlaceOf(kSections, root.keys[b].scalar);
    });
    for (const std::string& line : comments_.head) out_ += line + "\n";
    if (!comments_.head.empty()) out_ += "\n";
    bool entries_before = false;
    for (std::size_t i : order) {
      const std::string& key = root.keys[i].scalar;
      const bool entries = PlaceOf(kOneLine, key) == std::size(kOneLine) && !root.items[i].items.empty();
      if (entries && entries_before) out_ += "\n";
      entries_before = entries;
      section_ = key;
      path_.clear();
      Commented(root.items[i], "", false, [&] {
        out_ += Scalar(root.keys[i], false, false) + ":";
        if (!entries) return Value(root.items[i], key.size() + 1, 0);
        Block(root.items[i], kStep, false);
        return true;
      });
    }
    for (const std::string& line : comments_.foot) out_ += line + "\n";
    return std::move(out_);
  }

 private:
  // Whether a scalar at the path is a number whatever it says.
  bool TakesNumber() const {
    const auto at = [&](std::size_t i) { return i < path_.size() ? path_[i] : std::string_view(); };
    if (section_ == "fps") return true;
    if (section_ == "controls") return at(1) == "min" || at(1) == "max";
    if (section_ == "accelerate")
      return at(1) == "tolerance" || at(1) == "violationRate" || at(2) == "samples";
    if (section_ == "references") return at(1) == "translate" || at(1) == "start";
    if (section_ == "clips") {
      return at(1) == "frames" || at(2) == "weight" || at(2) == "start" || at(2) == "speed";
    }
    if (section_ != "nodes" || type_ == nullptr || path_.size() < 2 || IsRigWord(*type_, at(1))) return false;
    const std::string_view name = at(1).substr(0, at(1).find_first_of("[."));
    int number = type_->FindAttribute(name);
    if (number < 0 && name.size() > 1) number = type_->FindAttribute(name.substr(0, name.size() - 1));
    if (number < 0) return false;
    const Type type = type_->attributes[static_cast<std::size_t>(number)].type;
    return type != Type::kString && type != Type::kEnum && type != Type::kBool;
  }

  std::string Scalar(const YamlNode& node, bool in_flow, bool value) const {
    if (node.is_null()) return value && node.scalar == "~" ? "~" : "";
    const std::string& text = node.scalar;
    if (value && !node.quoted && IsNumber(text) && TakesNumber()) {
      const std::string shortest = NumberText(*ParseQuantity(text, Unit::kNone, FileUnits()));
      return IsNumber(shortest) ? shortest : text;
    }
    if (!IsPlain(text, in_flow) || (node.quoted && LooksTyped(text))) return InQuotes(text);
    return text;
  }

  std::string Flow(const YamlNode& node) {
    if (node.is_scalar()) return Scalar(node, true, true);
    if (node.is_null()) return "~";
    std::string text = node.is_map() ? "{" : "[";
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      if (i > 0) text += ", ";
      if (node.is_map()) {
        Enter(node, i);
        text += Scalar(node.keys[i], true, false) + ": ";
      }
      text += Flow(node.items[i]);
      if (node.is_map()) path_.pop_back();
    }
    return text + (node.is_map() ? "}" : "]");
  }

  // Writes an entry with its comments; `write` says whether the entries within it wrote their own. On the line of a
  // "-" (`here`) nothing comes before it any more.
  template <typename Write>
  void Commented(const YamlNode& value, const std::string& indent, bool here, Write&& write) {
    const std::size_t begin = out_.size();
    const bool within = write();
    std::string before, after;
    const auto add = [&](const std::vector<std::string>& lines, std::string* to) {
      for (const std::string& line : lines) *to += indent + line + "\n";
    };
    const auto found = comments_.entries.find(&value);
    const EntryComments own = found == comments_.entries.end() ? EntryComments() : found->second;
    add(own.before, here ? &after : &before);
    if (!within) {
      std::vector<std::string> inner;
      CollectComments(value, &inner);
      add(inner, here ? &after : &before);
    }
    add(own.after, &after);
    if (!own.beside.empty()) out_.insert(std::min(out_.find('\n', begin), out_.size()), " " + own.beside);
    out_.insert(begin, before);
    out_ += after;
  }

  void CollectComments(const YamlNode& node, std::vector<std::string>* lines) const {
    for (const YamlNode& item : node.items) {
      if (const auto found = comments_.entries.find(&item); found != comments_.entries.end()) {
        const EntryComments& of = found->second;
        lines->insert(lines->end(), of.before.begin(), of.before.end());
        if (!of.beside.empty()) lines->push_back(of.beside);
        lines->insert(lines->end(), of.after.begin(), of.after.end());
      }
      CollectComments(item, lines);
    }
  }

  // What follows "key:" or "-", which end at a column, up to the end of the line or of the block. Whether it is a block,
  // whose entries have lines of their own.
  bool Value(const YamlNode& node, std::size_t column, int indent, bool in_list = false) {
    if (node.items.empty() && !node.is_map() && !node.is_sequence()) {
      const std::string text = Scalar(node, false, true);
      out_ += (text.empty() ? "" : " ") + text + "\n";
      return false;
    }
    const std::string flow = Flow(node);
    if (node.items.empty() || column + 1 + flow.size() <= kWidth) {
      out_ += " " + flow + "\n";
    } else if (node.is_sequence() &&
               std::none_of(node.items.begin(), node.items.end(),
                            [](const YamlNode& n) { return n.is_map() || n.is_sequence(); })) {
      Wrapped(node, column, indent + kStep);
    } else {
      Block(node, indent + kStep, in_list && node.is_map());
      return true;
    }
    return false;
  }

  // A long list of scalars, in lines.
  void Wrapped(const YamlNode& node, std::size_t column, int indent) {
    out_ += " [";
    column += 2;
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      const std::string item = Flow(node.items[i]) + (i + 1 < node.items.size() ? "," : "]");
      if (i > 0 && column + 1 + item.size() > kWidth) {
        out_ += "\n" + std::string(static_cast<std::size_t>(indent), ' ');
        column = static_cast<std::size_t>(indent);
      } else if (i > 0) {
        out_ += " ", ++column;
      }
      out_ += item;
      column += item.size();
    }
    out_ += "\n";
  }

  // An entry a line. out_ is at the end of a "key:" or, `here`, of the "-" whose line the first one is on.
  void Block(const YamlNode& node, int indent, bool here) {
    const std::string before(static_cast<std::size_t>(indent), ' ');
    out_ += here ? " " : "\n";
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      std::string head = "-";
      if (node.is_map()) {
        Enter(node, i);
        head = Scalar(node.keys[i], false, false) + ":";
      }
      const bool first = here && i == 0;
      Commented(node.items[i], before, first, [&] {
        out_ += (first ? "" : before) + head;
        return Value(node.items[i], before.size() + head.size(), indent, !node.is_map());
      });
      if (node.is_map()) path_.pop_back();
    }
  }

  void Enter(const YamlNode& map, std::size_t i) {
    path_.push_back(map.keys[i].scalar);
    if (path_.size() != 1 || section_ != "nodes") return;
    const YamlNode* type = map.items[i].is_map() ? map.items[i].Find("type") : nullptr;
    type_ = type == nullptr ? nullptr : registry_.Find(type->scalar);
  }

  const NodeRegistry& registry_;
  const CommentMap& comments_;
  std::string out_;
  std::string_view section_;
  std::vector<std::string_view> path_;  // keys below the section
  const NodeDef* type_ = nullptr;       // of the node
};

bool IsTagged(const YamlNode& node) {
  const auto any = [](const std::vector<YamlNode>& nodes) {
    return std::any_of(nodes.begin(), nodes.end(), IsTagged);
  };
  return !node.tag.empty() || any(node.keys) || any(node.items);
}

// The same but for the order of the sections and how numbers are written.
bool Same(const YamlNode& a, const YamlNode& b, bool ordered) {
  if (a.kind != b.kind || a.items.size() != b.items.size()) return false;
  if (a.is_scalar() && a.scalar != b.scalar) {
    return IsNumber(a.scalar) && IsNumber(b.scalar) &&
           *ParseQuantity(a.scalar, Unit::kNone, FileUnits()) ==
               *ParseQuantity(b.scalar, Unit::kNone, FileUnits());
  }
  for (std::size_t i = 0; i < a.items.size(); ++i) {
    const YamlNode* other = ordered || !a.is_map() ? &b.items[i] : b.Find(a.keys[i].scalar);
    if (other == nullptr || (ordered && a.is_map() && a.keys[i].scalar != b.keys[i].scalar)) return false;
    if (!Same(a.items[i], *other, true)) return false;
  }
  return true;
}

// With kNoComment for each #, what stood in comments is part of what a file says; a # within a scalar makes
// no other difference.
constexpr char kNoComment = '_';

bool SameUncommented(const YamlNode& said, const YamlNode& says) {
  const auto same = [](const std::vector<YamlNode>& a, const std::vector<YamlNode>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), SameUncommented);
  };
  const auto uncommented = [](std::string text) {
    std::replace(text.begin(), text.end(), '#', kNoComment);
    return text;
  };
  return said.kind == says.kind && uncommented(said.scalar) == uncommented(says.scalar) &&
         uncommented(said.tag) == uncommented(says.tag) && same(said.keys, says.keys) &&
         same(said.items, says.items);
}

}  // namespace

Result<std::string> FormatRig(const YamlNode& root, const NodeRegistry& registry,
                              const CommentMap& comments) {
  const SourceLocation where{root.where().file, 0, 0};
  if (!root.is_map())
    return Status::Invalid("expected a map of sections, found {}", root.kind_name()).At(where);
  if (IsTagged(root)) return Status::Invalid("has YAML tags (!name), which have no canonical form").At(where);
  std::string text = Formatter(registry, comments).Root(root);
  const Result<YamlNode> back = ParseYaml(text, where.file);
  if (!back.ok() || !Same(root, *back, false))
    return Status::Invalid("has a value that no canonical form is known of").At(where);
  return text;
}

bool HasComments(std::string_view text) {
  if (text.find('#') == std::string_view::npos) return false;
  if (text.starts_with('%') || text.find("\n%") != std::string_view::npos)
    return true;  // of a directive, too
  std::string uncommented(text);
  std::replace(uncommented.begin(), uncommented.end(), '#', kNoComment);
  const Result<YamlNode> said = ParseYaml(text, ""), says = ParseYaml(uncommented, "");
  return !said.ok() || !says.ok() || !SameUncommented(*said, *says);
}

}  // namespace kpsa::engine
