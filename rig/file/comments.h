// The comments of a YAML file, and which entry each belongs to: the reader drops them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "files/yaml_document.h"

namespace kpsa::engine {

struct Comment {
  int line = 0, column = 0;  // of its #, counted from 1
  bool alone = false;        // on its line
  std::string text;          // "# half"
};
// In the order of the text; unset where they cannot be told from what the file says.
std::optional<std::vector<Comment>> FindComments(std::string_view text);

// What is written about the entries of a document: by value of a map's key, or item of a list.
struct EntryComments {
  std::vector<std::string> before, after;  // lines of their own
  std::string beside;                      // at the end of the line that it begins on
};
struct CommentMap {
  std::vector<std::string> head,
      foot;  // of the file: apart from the first entry by an empty line; after the last
  std::unordered_map<const YamlNode*, EntryComments> entries;
};
// `root` is that of the text, and outlives the map.
CommentMap AttachComments(const YamlNode& root, std::string_view text, const std::vector<Comment>& comments);

}  // namespace kpsa::engine
