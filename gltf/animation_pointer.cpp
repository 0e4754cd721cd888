#include "gltf/animation_pointer.h"

#include <algorithm>
#include <charconv>
#include <string_view>

namespace kpsa::engine::gltf {
namespace {

// The tokens of a JSON pointer (RFC 6901).
Result<std::vector<std::string>> Tokens(const std::string& pointer) {
  if (pointer.empty() || pointer[0] != '/') return Status::Invalid("must start with /");
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i < pointer.size(); ++i) {
    if (pointer[i] == '/') {
      tokens.emplace_back();
    } else if (pointer[i] != '~') {
      tokens.back() += pointer[i];
    } else {
      const char escape = i + 1 < pointer.size() ? pointer[++i] : ' ';
      if (escape != '0' && escape != '1') return Status::Invalid("has a ~ that is neither ~0 nor ~1");
      tokens.back() += escape == '0' ? '~' : '/';
    }
  }
  return tokens;
}

}  // namespace

Result<bool> ResolvePointer(const std::string& pointer, std::size_t node_count, PointedAt* at) {
  const Result<std::vector<std::string>> tokens = Tokens(pointer);
  if (!tokens.ok()) return tokens.status();
  if (tokens->size() < 2 || (*tokens)[0] != "nodes") return false;
  const std::string& digits = (*tokens)[1];
  std::uint64_t node = 0;
  const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), node);
  if (end.ec != std::errc() || end.ptr != digits.data() + digits.size() || digits != std::to_string(node) ||
      node >= node_count)
    return Status::Invalid("names no node: there are {}", node_count);
  constexpr std::string_view kRead[] = {"translation", "rotation", "scale", "weights"};
  if (tokens->size() != 3 || std::find(std::begin(kRead), std::end(kRead), (*tokens)[2]) == std::end(kRead))
    return false;
  *at = {node, (*tokens)[2]};
  return true;
}

}  // namespace kpsa::engine::gltf
