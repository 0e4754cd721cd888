#include "rig/build/vertices.h"

#include <charconv>
#include <cstdint>

namespace kpsa::engine {
namespace {

bool ParseVertex(std::string_view text, std::uint64_t* vertex) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *vertex);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

}  // namespace

bool ReadVertices(const YamlNode& node, std::size_t count, const std::string& of,
                  std::vector<Index>* vertices, YamlErrors* errors) {
  const auto refuse = [&](const YamlNode& at, std::string_view text) {
    return errors->Add(
        at, "vertices: \"{}\" is none of {}: expected numbers and ranges from 0 to {}, as in \"0:99,120\"",
        text, of, count == 0 ? 0 : count - 1);
  };
  const auto read = [&](const YamlNode& item) {
    std::string_view left = item.scalar;
    while (true) {
      const std::size_t comma = left.find(',');
      const std::string_view part = left.substr(0, comma);
      const std::size_t colon = part.find(':');
      std::uint64_t begin = 0, end = 0;
      bool good = ParseVertex(part.substr(0, colon), &begin);
      end = begin;
      if (colon != std::string_view::npos) good = ParseVertex(part.substr(colon + 1), &end) && good;
      if (!good || begin > end || end >= count) return refuse(item, part);
      if (vertices->size() + (end - begin) > 4 * count + 1024)
        return errors->Add(item, "vertices: the ranges overlap too often");
      for (std::uint64_t v = begin; v <= end; ++v) vertices->push_back(static_cast<Index>(v));
      if (comma == std::string_view::npos) return true;
      left = left.substr(comma + 1);
    }
  };
  vertices->clear();
  if (node.is_scalar()) return read(node);
  if (!node.is_sequence()) return errors->Add(node, "vertices: expected numbers, found {}", node.kind_name());
  for (const YamlNode& item : node.items) {
    if (!item.is_scalar())
      return errors->Add(item, "vertices: expected a number, found {}", item.kind_name());
    if (!read(item)) return false;
  }
  return true;
}

}  // namespace kpsa::engine
