#include "rig/file/comments.h"

#include <algorithm>

#include "rig/file/format.h"

namespace kpsa::engine {
namespace {

constexpr std::string_view kBlank = " \t\r";

// Whether a line that says `said` ends with | or >, so that the lines below it are a text.
bool OpensBlock(std::string_view said) {
  said = said.substr(0, said.find_last_not_of(kBlank) + 1);
  while (!said.empty() && std::string_view("+-0123456789").find(said.back()) != std::string_view::npos)
    said.remove_suffix(1);
  if (said.empty() || (said.back() != '|' && said.back() != '>')) return false;
  said.remove_suffix(1);
  return said.empty() || kBlank.find(said.back()) != std::string_view::npos;
}

// Reads the text line by line; quotes may go on over lines.
class CommentReader {
 public:
  std::vector<Comment> Read(std::string_view text) {
    for (int number = 1; !text.empty(); ++number) {
      const std::size_t end = text.find('\n');
      Line(text.substr(0, end), number);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
    return std::move(comments_);
  }

 private:
  void Line(std::string_view line, int number) {
    const std::size_t indent = std::min(line.find_first_not_of(kBlank), line.size());
    if (block_.has_value() && (indent == line.size() || indent > *block_)) return;
    block_.reset();
    char before = '\0';  // the last character that is no space
    for (std::size_t i = 0; i < line.size(); ++i) {
      const char c = line[i];
      if (quote_ != '\0') {
        if (quote_ == '"' && c == '\\') {
          ++i;
        } else if (c == quote_) {
          quote_ = '\0', before = c;
        }
        continue;
      }
      const bool apart = i == 0 || kBlank.find(line[i - 1]) != std::string_view::npos;
      if (c == '#' && apart) {
        std::string_view text = line.substr(i);
        text = text.substr(0, text.find_last_not_of(kBlank) + 1);
        comments_.push_back({number, static_cast<int>(i) + 1, i == indent, std::string(text)});
        line = line.substr(0, i);
        break;
      }
      // Within a plain word a quote is a letter
      if ((c == '"' || c == '\'') &&
          (before == '\0' || std::string_view(":-,[{?").find(before) != std::string_view::npos))
        quote_ = c;
      if (kBlank.find(c) == std::string_view::npos) before = c;
    }
    if (quote_ == '\0' && OpensBlock(line)) block_ = indent;
  }

  std::vector<Comment> comments_;
  char quote_ = '\0';
  std::optional<std::size_t> block_;  // the indentation of the line that opened it
};

bool SaysTheSame(const YamlNode& a, const YamlNode& b) {
  const auto same = [](const std::vector<YamlNode>& x, const std::vector<YamlNode>& y) {
    return std::equal(x.begin(), x.end(), y.begin(), y.end(), SaysTheSame);
  };
  return a.kind == b.kind && a.scalar == b.scalar && a.tag == b.tag && same(a.keys, b.keys) &&
         same(a.items, b.items);
}

struct Entry {
  int line = 0, column = 0;
  const YamlNode* value = nullptr;
};
void ListEntries(const YamlNode& node, std::vector<Entry>* entries) {
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    const YamlNode& at = node.is_map() ? node.keys[i] : node.items[i];
    // Of an item, where its dash is
    entries->push_back({at.line, node.is_map() ? at.column : std::max(at.column - 2, 1), &node.items[i]});
    ListEntries(node.items[i], entries);
  }
}

}  // namespace

std::optional<std::vector<Comment>> FindComments(std::string_view text) {
  std::vector<Comment> comments = CommentReader().Read(text);
  // The proof: without them the file says the same, and has no others
  std::string without;
  std::size_t next = 0;
  int number = 1;
  for (std::string_view left = text; !left.empty(); ++number) {
    const std::size_t end = left.find('\n');
    std::string_view line = left.substr(0, end);
    if (next < comments.size() && comments[next].line == number)
      line = line.substr(0, static_cast<std::size_t>(comments[next++].column) - 1);
    without.append(line);
    if (end != std::string_view::npos) without += '\n';
    left.remove_prefix(end == std::string_view::npos ? left.size() : end + 1);
  }
  const Result<YamlNode> with = ParseYaml(text, ""), bare = ParseYaml(without, "");
  if (!with.ok() || !bare.ok() || !SaysTheSame(*with, *bare) || HasComments(without)) return std::nullopt;
  return comments;
}

CommentMap AttachComments(const YamlNode& root, std::string_view text, const std::vector<Comment>& comments) {
  std::vector<Entry> entries;
  ListEntries(root, &entries);
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.line < b.line; });
  std::vector<bool> empty = {false};  // by line
  for (std::string_view left = text; !left.empty();) {
    const std::size_t end = left.find('\n');
    empty.push_back(left.substr(0, end).find_first_not_of(kBlank) == std::string_view::npos);
    left.remove_prefix(end == std::string_view::npos ? left.size() : end + 1);
  }
  CommentMap map;
  // The last comment above the first entry that an empty line follows ends the head
  int head = 0;
  for (const Comment& c : comments) {
    const auto below = static_cast<std::size_t>(c.line) + 1;
    if (!entries.empty() && c.line < entries.front().line && below < empty.size() && empty[below])
      head = c.line;
  }
  for (const Comment& c : comments) {
    if (c.line <= head) {
      map.head.push_back(c.text);
      continue;
    }
    const auto next = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) {
      return c.alone ? e.line > c.line : e.line >= c.line;
    });
    if (!c.alone && next != entries.end() && next->line == c.line) {
      map.entries[next->value].beside = c.text;
      continue;
    }
    // What is further in than the next entry closes the block above that; what stands within a value follows it
    const Entry* above = nullptr;
    for (auto e = entries.begin(); e != next; ++e) {
      if (e->column <= c.column || !c.alone) above = &*e;
    }
    const int outer = next == entries.end() ? 1 : next->column;
    if (above != nullptr && (!c.alone || (c.column > outer && above->column > outer))) {
      map.entries[above->value].after.push_back(c.text);
    } else if (next != entries.end()) {
      map.entries[next->value].before.push_back(c.text);
    } else {
      map.foot.push_back(c.text);
    }
  }
  return map;
}

}  // namespace kpsa::engine
