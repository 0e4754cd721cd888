#include "gltf/animation_pointer.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "KHR_animation_pointer";

// In quotes, in one line, not too long.
std::string Shown(const std::string& text) {
  constexpr std::size_t kMost = 80;
  const std::string quoted = json(text.substr(0, kMost)).dump(-1, ' ', true, json::error_handler_t::replace);
  return text.size() <= kMost ? quoted : quoted + "...";
}

// What the extension has put on a target, or null.
const json* FindExtension(const json& target) {
  const auto all = target.find("extensions");
  if (all == target.end() || !all->is_object()) return nullptr;
  const auto found = all->find(kExtension);
  return found == all->end() ? nullptr : &*found;
}

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

// Sets *target where the pointer is one of those that are read; false where it is another one.
Result<bool> Resolve(const std::string& pointer, std::size_t node_count, json* target) {
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
  *target = {{"node", node}, {"path", (*tokens)[2]}};
  return true;
}

}  // namespace

Status ResolvePointers(const json& root, json* reduced, std::vector<std::string>* warnings) {
  if (!reduced->contains("animations")) return {};
  const std::size_t node_count = reduced->contains("nodes") ? (*reduced)["nodes"].size() : 0;
  for (std::size_t a = 0; a < (*reduced)["animations"].size(); ++a) {
    json kept = json::array();
    std::size_t left_out = 0;
    std::string first;
    json& channels = (*reduced)["animations"][a]["channels"];
    for (std::size_t c = 0; c < channels.size(); ++c) {
      json& target = channels[c]["target"];
      const json* extension = FindExtension(root["animations"][a]["channels"][c]["target"]);
      if (target["path"] != "pointer" || extension == nullptr) {
        kept.push_back(std::move(channels[c]));
        continue;
      }
      const std::string where = fmt::format("animations[{}].channels[{}].target", a, c);
      if (!extension->is_object() || !extension->contains("pointer") || !(*extension)["pointer"].is_string())
        return Status::Invalid("{}.extensions.{}.pointer must be text", where, kExtension);
      if (target.contains("node"))
        return Status::Invalid("{} has a node beside the pointer of {}", where, kExtension);
      const std::string& pointer = (*extension)["pointer"].get_ref<const std::string&>();
      const Result<bool> read = Resolve(pointer, node_count, &target);
      if (!read.ok())
        return Status::Invalid("{}: the pointer {} {}", where, Shown(pointer),
                               read.status().errors()[0].message);
      if (*read) {
        kept.push_back(std::move(channels[c]));
      } else if (left_out++ == 0) {
        first = pointer;
      }
    }
    channels = std::move(kept);
    if (left_out > 0) {
      warnings->push_back(
          fmt::format("animations[{}] animates {}{}, which is not supported; ignored", a, Shown(first),
                      left_out == 1 ? std::string() : fmt::format(" and {} more by pointers", left_out - 1)));
    }
  }
  return {};
}

}  // namespace kpsa::engine::gltf
