#include "files/yaml_document.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cmath>
#include <istream>
#include <map>
#include <streambuf>
#include <unordered_map>

#include "files/file.h"
#include "files/utf8.h"

namespace kpsa::engine {
namespace {

// Ends the parse; caught in ParseYaml.
struct Refusal {
  Status status;
};

// Builds the tree from yaml-cpp's events. Open collections are kept on a stack and moved into their parents
// when they end, so that no pointer into a growing vector is held.
class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(std::shared_ptr<const std::string> file) : file_(std::move(file)) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    Add(Make(YamlNode::Kind::kNull, mark), anchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    if (value.find('\0') != std::string::npos)  // by an escape; what is named so would end there elsewhere
      throw Refusal{Status::Invalid("a text may hold no zero byte").At(Where(mark))};
    YamlNode node = Make(YamlNode::Kind::kScalar, mark);
    node.quoted = tag == "!";
    if (tag != "!" && tag != "?") node.tag = tag;
    // A plain ~, null or nothing is null; the schema may still read the text of a plain "null" as a name
    if (!node.quoted && node.tag.empty() && (value.empty() || value == "~"))
      node.kind = YamlNode::Kind::kNull;
    node.scalar = value;
    Add(std::move(node), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto it = anchors_.find(anchor);
    if (it == anchors_.end())
      throw Refusal{Status::Invalid("an alias may not lie within its own anchor").At(Where(mark))};
    const std::size_t size = it->second.size;
    aliased_ += size;
    if (aliased_ > kMaxAliasNodes) {
      throw Refusal{Status::Invalid("the aliases of this file expand to more than {} nodes", kMaxAliasNodes)
                        .At(Where(mark))};
    }
    count_ += size;
    CheckCount(mark);
    if (static_cast<int>(open_.size()) + it->second.depth > kMaxYamlDepth) RefuseDepth(mark);
    YamlNode copy = it->second.node;
    copy.line = mark.line + 1;
    copy.column = mark.column + 1;
    Attach(std::move(copy), it->second.depth, size);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    Open(YamlNode::Kind::kSequence, mark, tag, anchor);
  }
  void OnSequenceEnd() override { Close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    Open(YamlNode::Kind::kMap, mark, tag, anchor);
  }
  void OnMapEnd() override { Close(); }

  YamlNode& root() { return root_; }

 private:
  struct Opened {
    YamlNode node;
    YAML::anchor_t anchor;
    int depth = 1;                                      // of the deepest child, plus one
    std::size_t size = 1;                               // nodes of the subtree
    std::unordered_map<std::string, std::size_t> seen;  // keys of a map
    bool expects_value = false;
  };
  struct Anchored {
    YamlNode node;
    int depth;
    std::size_t size;
  };

  SourceLocation Where(const YAML::Mark& mark) const { return {*file_, mark.line + 1, mark.column + 1}; }
  [[noreturn]] void RefuseDepth(const YAML::Mark& mark) const {
    throw Refusal{Status::Invalid("nested deeper than {} levels", kMaxYamlDepth).At(Where(mark))};
  }
  void CheckCount(const YAML::Mark& mark) const {
    if (count_ > kMaxYamlNodes)
      throw Refusal{Status::Invalid("more than {} values in one file", kMaxYamlNodes).At(Where(mark))};
  }
  YamlNode Make(YamlNode::Kind kind, const YAML::Mark& mark) {
    ++count_;
    CheckCount(mark);
    YamlNode node;
    node.kind = kind;
    node.file = file_;
    node.line = mark.line + 1;
    node.column = mark.column + 1;
    return node;
  }
  void Open(YamlNode::Kind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
    if (static_cast<int>(open_.size()) >= kMaxYamlDepth) RefuseDepth(mark);
    if (!open_.empty() && open_.back().node.is_map() && !open_.back().expects_value) {
      throw Refusal{
          Status::Invalid(
              "a key is a single word or string here, not a list or a map (quote plugs that contain "
              "[ ] or {{ }})")
              .At(Where(mark))};
    }
    Opened opened;
    opened.node = Make(kind, mark);
    if (tag != "?" && tag != "!") opened.node.tag = tag;
    opened.anchor = anchor;
    open_.push_back(std::move(opened));
  }
  void Close() {
    Opened closed = std::move(open_.back());
    open_.pop_back();
    if (closed.anchor != 0) anchors_[closed.anchor] = {closed.node, closed.depth, closed.size};
    Attach(std::move(closed.node), closed.depth, closed.size);
  }
  void Add(YamlNode node, YAML::anchor_t anchor) {
    if (anchor != 0) anchors_[anchor] = {node, 1, 1};
    Attach(std::move(node), 1, 1);
  }
  // Puts a finished node where it belongs: the root, an item, a key or a value.
  void Attach(YamlNode node, int depth, std::size_t size) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    Opened& parent = open_.back();
    parent.depth = std::max(parent.depth, depth + 1);
    parent.size += size;
    if (parent.node.is_sequence() || parent.expects_value) {
      parent.node.items.push_back(std::move(node));
      parent.expects_value = false;
      return;
    }
    const SourceLocation where{*file_, node.line, node.column};
    if (!node.is_scalar())
      throw Refusal{Status::Invalid("a key is a single word or string, not {}", node.kind_name()).At(where)};
    if (node.scalar == "<<" && !node.quoted) {
      throw Refusal{Status::Invalid("\"<<\" merges are not read: repeat the keys, or use include").At(where)};
    }
    const auto [it, added] = parent.seen.emplace(node.scalar, parent.node.keys.size());
    if (!added) {
      const YamlNode& first = parent.node.keys[it->second];
      duplicates.Append(
          Status::Invalid("\"{}\" is defined twice in this map: first at line {}", node.scalar, first.line)
              .At(where));
    }
    parent.node.keys.push_back(std::move(node));
    parent.expects_value = true;
  }

  std::shared_ptr<const std::string> file_;
  std::vector<Opened> open_;
  std::map<YAML::anchor_t, Anchored> anchors_;
  std::size_t count_ = 0, aliased_ = 0;
  YamlNode root_;

 public:
  Status duplicates;  // collected: the parse goes on
};

// The first byte that is not well-formed UTF-8 or a control character; npos if there is none.
std::size_t FindBadByte(std::string_view text) {
  const auto is_control = [](char c) {
    return (static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7F;
  };
  const auto control = static_cast<std::size_t>(std::ranges::find_if(text, is_control) - text.begin());
  return std::min(FindNotUtf8(text), control < text.size() ? control : std::string_view::npos);
}

std::string_view LineOf(std::string_view text, int line) {
  for (int i = 1; i < line; ++i) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + 1);
  }
  return text.substr(0, text.find('\n'));
}

// Whether a flow map or list of the line has a character outside of quotes that breaks it there.
template <typename Breaks>
bool HasBare(std::string_view line, const Breaks& breaks) {
  std::size_t open = line.find_first_of("{[");
  while (open != std::string_view::npos && open > 0 && line[open - 1] != ' ')
    open = line.find_first_of("{[", open + 1);
  if (open == std::string_view::npos) return false;
  char quote = 0;
  for (std::size_t i = open; i + 1 < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (breaks(c, line[i + 1])) {
      return true;
    }
  }
  return false;
}
// An identifier directly followed by '['.
bool HasBareBracket(std::string_view line) {
  return HasBare(line, [](char c, char next) {
    return next == '[' && c != ' ' && c != '[' && c != '{' && c != ',' && c != ':';
  });
}
// A name with ?, or one that begins with *, which is an alias to YAML.
bool HasBarePattern(std::string_view line) {
  return HasBare(line, [](char c, char next) {
    return next == '?' || (next == '*' && (c == ' ' || c == '[' || c == '{' || c == ','));
  });
}

class ViewBuffer final : public std::streambuf {
 public:
  explicit ViewBuffer(std::string_view text) {
    char* begin = const_cast<char*>(text.data());
    setg(begin, begin, begin + text.size());
  }
};

Status SyntaxError(const YAML::Exception& error, std::string_view text, const std::string& name) {
  const int line = error.mark.line + 1, column = error.mark.column + 1;
  std::string message = "YAML: " + error.msg;
  if (HasBareBracket(LineOf(text, line)) || (line > 1 && HasBareBracket(LineOf(text, line - 1)))) {
    message += "; quote plugs that contain [ ] inside { } or [ ]";
  }
  const std::string_view here = LineOf(text, line);
  if (HasBarePattern(here)) message += "; quote names with ? or * inside { } or [ ]";
  if (here.substr(0, here.find_first_not_of(" \t")).find('\t') != std::string_view::npos) {
    message += "; indent with spaces, YAML allows no tabs there";
  }
  return Status::Invalid("{}", message).At({name, line, column});
}

}  // namespace

void YamlErrors::Append(Status status) {
  for (const Error& error : status.errors()) {
    if (full()) return;
    const std::string text = error.ToString();
    if (std::ranges::none_of(status_.errors(), [&](const Error& e) { return e.ToString() == text; }))
      status_.Add(error);
  }
}

const char* YamlNode::kind_name() const {
  switch (kind) {
    case Kind::kNull:
      return "nothing";
    case Kind::kScalar:
      return "a single value";
    case Kind::kSequence:
      return "a list";
    case Kind::kMap:
      break;
  }
  return "a map";
}

const YamlNode* YamlNode::Find(std::string_view key) const {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].scalar == key) return &items[i];
  }
  return nullptr;
}

Result<YamlNode> ParseYaml(std::string_view text, const std::string& name) {
  const auto file = std::make_shared<const std::string>(name);
  if (text.size() > kMaxYamlBytes) {
    return Status::Invalid("the file has {} bytes; at most {} are read", text.size(), kMaxYamlBytes)
        .At({name, 0, 0});
  }
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  if (const std::size_t bad = FindBadByte(text); bad != std::string_view::npos) {
    const std::string_view before = text.substr(0, bad);
    const std::size_t start = before.rfind('\n') == std::string_view::npos ? 0 : before.rfind('\n') + 1;
    const int line = 1 + static_cast<int>(std::count(before.begin(), before.end(), '\n'));
    return Status::Invalid("the file is not UTF-8 text: byte 0x{:02x}", static_cast<unsigned char>(text[bad]))
        .At({name, line, static_cast<int>(bad - start) + 1});
  }
  std::string unix_text;  // line ends as \n, so that positions are the same
  unix_text.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n') continue;
    unix_text += text[i];
  }

  TreeBuilder builder(file);
  try {
    ViewBuffer buffer(unix_text);
    std::istream stream(&buffer);
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder) || builder.root().is_null()) {
      return Status::Invalid("the file holds no YAML document").At({name, 1, 1});
    }
    YamlNode root = std::move(builder.root());
    TreeBuilder second(file);
    if (parser.HandleNextDocument(second)) {
      return Status::Invalid("the file holds several YAML documents; one is expected")
          .At({name, std::max(1, second.root().line), std::max(1, second.root().column)});
    }
    if (!builder.duplicates.ok()) return std::move(builder.duplicates);
    return root;
  } catch (const Refusal& refusal) {
    return refusal.status;
  } catch (const YAML::Exception& error) {
    return SyntaxError(error, unix_text, name);
  } catch (const std::exception& error) {
    return Status::Invalid("YAML: {}", error.what()).At({name, 0, 0});
  }
}

Result<YamlNode> ReadYamlFile(const std::string& path) {
  Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kMaxYamlBytes);
  if (!bytes.ok()) return bytes.status();
  return ParseYaml(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()), path);
}

}  // namespace kpsa::engine
