// Graph's look-up of nodes and plugs by name.
#include <algorithm>
#include <charconv>

#include "base/check.h"
#include "base/near_names.h"
#include "graph/graph.h"

namespace kpsa::engine {
namespace {

bool ParseInt(std::string_view text, int* value) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::vector<std::string> Graph::Names() const {
  std::vector<std::string> names;
  for (const Node& n : nodes_) {
    if (n.def != nullptr) names.push_back(n.name);
  }
  return names;
}

Result<NodeId> Graph::FindNode(std::string_view name) const {
  const std::string key(name);
  if (const auto it = by_name_.find(key); it != by_name_.end())
    return NodeId{it->second, nodes_[it->second].version};
  if (const auto it = by_alias_.find(key); it != by_alias_.end()) {
    if (it->second.size() == 1) return IdAt(it->second.front());
    std::vector<std::string> names;
    for (Index index : it->second) names.push_back(nodes_[index].name);
    return Status::Invalid("\"{}\" is the name of several nodes: write {}", name, fmt::join(names, " or "));
  }
  return Status::Invalid("unknown node \"{}\"{}", name, DidYouMean(name, Names()));
}

Result<PlugRef> Graph::FindPlug(std::string_view text) const {
  // Names may contain dots themselves: of all nodes that are followed by one, the longest that has the rest
  Status longest;
  for (std::size_t dot = text.rfind('.'); dot != std::string_view::npos && dot > 0;
       dot = text.rfind('.', dot - 1)) {
    const std::string key(text.substr(0, dot));
    if (by_name_.count(key) == 0 && by_alias_.count(key) == 0) continue;
    const Result<NodeId> id = FindNode(key);
    Result<PlugRef> plug =
        id.ok() ? FindAttribute(*id, text.substr(dot + 1), true) : Result<PlugRef>(id.status());
    if (plug.ok()) return plug;
    if (longest.ok()) longest = plug.status();
  }
  if (!longest.ok()) return longest;
  const std::size_t dot = text.find('.');
  if (dot == std::string_view::npos)
    return Status::Invalid("\"{}\" is no plug: expected node.attribute", text);
  std::string_view path = text.substr(0, text.find('['));
  // A component, of rotate.x
  const auto dots = std::ranges::count(path, '.');
  if (dots > 1 && path[path.size() - 2] == '.' && path.back() >= 'x' && path.back() <= 'z')
    path.remove_suffix(2);
  const std::string_view guess = path.substr(0, path.rfind('.'));
  return Status::Invalid("unknown node \"{}\" in plug \"{}\"{}", guess, text, DidYouMean(guess, Names()));
}

std::string Graph::AuthoredName(const PlugRef& plug) const {
  if (!IsAlive(plug.node) || plug.component < 0 || plug.element >= 0) return PlugName(plug);
  PlugRef whole = plug;
  whole.component = -1;
  std::string text = PlugName(whole) + "XYZW"[plug.component];
  const Result<PlugRef> read = FindPlug(text);  // an attribute of its own may be called so
  return read.ok() && *read == plug ? text : PlugName(plug);
}

std::string Graph::FreeNodeName(std::string wanted) const {
  while (by_name_.count(wanted) != 0 || by_alias_.count(wanted) != 0) wanted += '_';
  return wanted;
}

Result<PlugRef> Graph::FindAttribute(NodeId id, std::string_view text, bool delegates) const {
  const Node& n = node(id);
  PlugRef plug;
  plug.node = id;

  // attribute [element] .component
  std::string_view attribute = text, element, rest;
  if (const std::size_t open = text.find('['); open != std::string_view::npos) {
    const std::size_t close = text.rfind(']');
    if (close == std::string_view::npos || close < open) return Status::Invalid("\"{}\": [ without ]", text);
    attribute = text.substr(0, open);
    element = text.substr(open + 1, close - open - 1);
    rest = text.substr(close + 1);
  } else if (const std::size_t dot = text.find('.'); dot != std::string_view::npos) {
    attribute = text.substr(0, dot);
    rest = text.substr(dot);
  }
  plug.attribute = n.def->FindAttribute(attribute);
  if (plug.attribute < 0 && attribute.size() > 1 && element.empty()) {  // rotateX is rotate.x
    const int component = static_cast<int>(std::string_view("XYZW").find(attribute.back()));
    const int whole = n.def->FindAttribute(attribute.substr(0, attribute.size() - 1));
    if (component >= 0 && component < 4 && whole >= 0) {
      const Type type = n.def->attributes[static_cast<std::size_t>(whole)].type;
      if ((type == Type::kDouble3 && component < 3) || type == Type::kQuaternion) {
        plug.attribute = whole;
        plug.component = component;
      }
    }
  }
  if (plug.attribute < 0) {
    std::vector<std::string> all = n.def->AttributeNames(), names = all;
    if (!attribute.empty() &&
        std::string_view("xyzwXYZW").find(attribute.back()) != std::string_view::npos) {  // rotatex: rotateX
      for (const AttributeDef& a : n.def->attributes) {
        const int components = a.type == Type::kDouble3 ? 3 : a.type == Type::kQuaternion ? 4 : 0;
        for (int c = 0; c < components; ++c) names.push_back(a.name + "XYZW"[c]);
      }
    }
    for (NodeId delegate : delegates ? n.delegates : std::vector<NodeId>()) {
      if (!IsAlive(delegate)) continue;
      Result<PlugRef> found = FindAttribute(delegate, text, false);
      if (found.ok() || node(delegate).def->FindAttribute(attribute) >= 0) return found;
      for (std::string& name : node(delegate).def->AttributeNames()) {
        names.push_back(name);
        all.push_back(std::move(name));
      }
    }
    return Status::Invalid("node \"{}\" ({}) has no attribute \"{}\"{}", n.name, n.def->name, attribute,
                           NearOrAll(attribute, names, all));
  }
  if (text.find('[') != std::string_view::npos) {
    Result<int> index = ParseElement(id, plug.attribute, element);
    if (!index.ok()) return index.status();
    plug.element = *index;
  }
  if (!rest.empty()) {
    const std::size_t component =
        rest.size() == 2 && rest[0] == '.' ? std::string_view("xyzw").find(rest[1]) : std::string_view::npos;
    if (component == std::string_view::npos || plug.component >= 0) {
      return Status::Invalid("\"{}\": expected .x, .y or .z at \"{}\"", text, rest);
    }
    plug.component = static_cast<int>(component);
  }
  const AttributeDef& a = n.def->attributes[static_cast<std::size_t>(plug.attribute)];
  if (a.array && plug.element < 0) {
    if (a.per_geometry) {
      plug.element = 0;  // the usual case of one geometry
    } else {
      const std::vector<std::string>* names = ElementNames(id, plug.attribute);
      const bool named = names != nullptr && !names->empty();
      return Status::Invalid("{}.{} is an array: name an element, {}[{}]{}", n.name, a.name, a.name,
                             named ? names->front() : "0", named ? NearOrAll("", {}, *names) : Suggestion());
    }
  }
  KPSA_RETURN_IF_ERROR(CheckPlug(plug));
  return plug;
}

Result<int> Graph::ParseElement(NodeId id, int attribute, std::string_view text) const {
  const Node& n = node(id);
  const AttributeDef& a = n.def->attributes[static_cast<std::size_t>(attribute)];
  const int max_elements = MaxElements(a);
  if (!a.array && !IsPointType(a.type)) return Status::Invalid("{}.{} is no array", n.name, a.name);
  for (const auto& [number, names] : n.element_names) {
    if (number != attribute) continue;
    const auto it = std::find(names.begin(), names.end(), text);
    if (it != names.end()) return static_cast<int>(it - names.begin());
    int index = 0;
    if (ParseInt(text, &index) && index >= 0 && index < static_cast<int>(names.size())) return index;
    std::vector<std::string> same;  // told apart by their index
    for (const std::string& name : names) {
      if (name.size() > text.size() && name.starts_with(text) && name[text.size()] == '#')
        same.push_back(name);
    }
    if (!same.empty())
      return Status::Invalid("{}.{} has several elements \"{}\": {}", n.name, a.name, text,
                             fmt::join(same, ", "));
    return Status::Invalid("{}.{} has no element \"{}\"{}", n.name, a.name, text,
                           NearOrAll(text, names, names));
  }
  if (!a.grid.empty() && text.find(',') != std::string_view::npos) {
    const int divisions_attribute = n.def->FindAttribute(a.grid);
    KPSA_CHECK(divisions_attribute >= 0);
    const Value* set = FindValue({id, divisions_attribute, -1, -1});
    const Value& divisions =
        set != nullptr ? *set
                       : n.def->attributes[static_cast<std::size_t>(divisions_attribute)].default_value;
    const auto* sizes = divisions.get_if<std::vector<std::int64_t>>();
    if (sizes != nullptr && sizes->size() != 3)
      return Status::Invalid("{}.{}[{}]: {} takes three numbers, not {}", n.name, a.name, text, a.grid,
                             sizes->size());
    std::int64_t index = 0, stride = 1;
    std::size_t axis = 0;
    for (std::string_view left = text;; ++axis) {
      const std::size_t comma = left.find(',');
      int i = 0;
      if (sizes == nullptr || axis >= sizes->size() || !ParseInt(left.substr(0, comma), &i) || i < 0 ||
          i >= (*sizes)[axis]) {
        return Status::Invalid("{}.{}[{}]: expected three indices within the divisions {}", n.name, a.name,
                               text, divisions.ToString());
      }
      index += stride * i;
      stride =
          std::min<std::int64_t>(stride * std::min<std::int64_t>((*sizes)[axis], max_elements), max_elements);
      if (index >= max_elements)
        return Status::Invalid("{}.{}[{}]: the grid is too large", n.name, a.name, text);
      if (comma == std::string_view::npos) break;
      left = left.substr(comma + 1);
    }
    if (axis != 2) return Status::Invalid("{}.{}[{}]: expected three indices", n.name, a.name, text);
    return static_cast<int>(index);
  }
  int index = 0;
  if (!ParseInt(text, &index) || index < 0 || index >= max_elements) {
    return Status::Invalid("{}.{}[{}]: expected an index from 0 to {}", n.name, a.name, text,
                           max_elements - 1);
  }
  return index;
}

}  // namespace kpsa::engine
