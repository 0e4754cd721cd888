// The structure of a glTF document, checked against a table of what is read, and copied without the rest.
// What tinygltf gets afterwards has only known keys of the right type with indices in range: it drops or
// wraps others silently, follows URIs, decodes images and recurses into extras.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "gltf/animation_pointer.h"
#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;

enum class Kind {
  kString,
  kBool,
  kSize,
  kInt,
  kIndex,
  kIndices,
  kNumbers,
  kObject,
  kObjects,
  kIndexMap,
  kIndexMaps
};

// One key of an object. `array`: the top-level array that kIndex, kIndices and kIndexMap(s) point into.
// `count`: the length of kNumbers, 0 for any. `fields`: of kObject and kObjects.
struct Field {
  const char* key;
  Kind kind;
  bool required = false;
  const char* array = nullptr;
  std::size_t count = 0;
  const std::vector<Field>* fields = nullptr;
};
using Fields = std::vector<Field>;

constexpr std::uint64_t kLargestSize = std::uint64_t{1} << 53;  // what JSON numbers hold exactly
constexpr std::uint64_t kLargestInt = 0x7fffffff;

const Fields& TopLevel() {
  using enum Kind;
  static const Fields sparse_indices = {
      {"bufferView", kIndex, true, "bufferViews"}, {"byteOffset", kInt}, {"componentType", kInt, true}};
  static const Fields sparse_values = {{"bufferView", kIndex, true, "bufferViews"}, {"byteOffset", kInt}};
  static const Fields sparse = {{"count", kInt, true},
                                {"indices", kObject, true, nullptr, 0, &sparse_indices},
                                {"values", kObject, true, nullptr, 0, &sparse_values}};
  static const Fields accessor = {{"bufferView", kIndex, false, "bufferViews"},
                                  {"byteOffset", kSize},
                                  {"componentType", kInt, true},
                                  {"normalized", kBool},
                                  {"count", kSize, true},
                                  {"type", kString, true},
                                  {"sparse", kObject, false, nullptr, 0, &sparse}};
  static const Fields view = {{"buffer", kIndex, true, "buffers"},
                              {"byteOffset", kSize},
                              {"byteLength", kSize, true},
                              {"byteStride", kSize}};
  static const Fields node = {{"name", kString},
                              {"children", kIndices, false, "nodes"},
                              {"matrix", kNumbers, false, nullptr, 16},
                              {"translation", kNumbers, false, nullptr, 3},
                              {"rotation", kNumbers, false, nullptr, 4},
                              {"scale", kNumbers, false, nullptr, 3},
                              {"mesh", kIndex, false, "meshes"},
                              {"skin", kIndex, false, "skins"},
                              {"weights", kNumbers}};
  static const Fields primitive = {{"attributes", kIndexMap, true, "accessors"},
                                   {"indices", kIndex, false, "accessors"},
                                   {"material", kIndex, false, "materials"},
                                   {"mode", kInt},
                                   {"targets", kIndexMaps, false, "accessors"}};
  static const Fields mesh = {
      {"name", kString}, {"primitives", kObjects, true, nullptr, 0, &primitive}, {"weights", kNumbers}};
  static const Fields skin = {{"name", kString},
                              {"joints", kIndices, true, "nodes"},
                              {"skeleton", kIndex, false, "nodes"},
                              {"inverseBindMatrices", kIndex, false, "accessors"}};
  static const Fields shading = {{"baseColorFactor", kNumbers, false, nullptr, 4}};
  static const Fields material = {{"name", kString},
                                  {"pbrMetallicRoughness", kObject, false, nullptr, 0, &shading}};
  static const Fields sampler = {{"input", kIndex, true, "accessors"},
                                 {"output", kIndex, true, "accessors"},
                                 {"interpolation", kString}};
  static const Fields target = {{"node", kIndex, false, "nodes"}, {"path", kString, true}};
  static const Fields channel = {{"sampler", kInt, true}, {"target", kObject, true, nullptr, 0, &target}};
  static const Fields animation = {{"name", kString},
                                   {"samplers", kObjects, true, nullptr, 0, &sampler},
                                   {"channels", kObjects, true, nullptr, 0, &channel}};
  static const Fields scene = {{"name", kString}, {"nodes", kIndices, false, "nodes"}};
  static const Fields asset = {{"version", kString, true}, {"minVersion", kString}};
  static const Fields top = {{"asset", kObject, true, nullptr, 0, &asset},
                             {"nodes", kObjects, false, nullptr, 0, &node},
                             {"meshes", kObjects, false, nullptr, 0, &mesh},
                             {"skins", kObjects, false, nullptr, 0, &skin},
                             {"materials", kObjects, false, nullptr, 0, &material},
                             {"animations", kObjects, false, nullptr, 0, &animation},
                             {"accessors", kObjects, false, nullptr, 0, &accessor},
                             {"bufferViews", kObjects, false, nullptr, 0, &view},
                             {"scenes", kObjects, false, nullptr, 0, &scene},
                             {"scene", kIndex, false, "scenes"}};
  return top;
}

class Reducer {
 public:
  explicit Reducer(const json& root) : root_(root) {}

  // Copies the fields of `in` to `out`. `where` is the place of `in`, "" for the document.
  Status Copy(const json& in, const Fields& fields, const std::string& where, json* out) const {
    if (!in.is_object()) return Wrong(in, where, "an object");
    *out = json::object();
    for (const Field& field : fields) {
      const auto found = in.find(field.key);
      const std::string place = where.empty() ? field.key : where + "." + field.key;
      if (found == in.end()) {
        if (field.required) return Status::Invalid("{} is missing", place);
        continue;
      }
      KPSA_RETURN_IF_ERROR(CopyField(*found, field, place, &(*out)[field.key]));
    }
    return {};
  }

 private:
  static Status Wrong(const json& value, const std::string& where, std::string_view expected) {
    return Status::Invalid("{} is {}, expected {}", where.empty() ? "the document" : where, Shown(value),
                           expected);
  }

  static std::string Shown(const json& value) {
    if (value.is_number()) return value.dump();
    return value.is_string()   ? "text"
           : value.is_array()  ? "an array"
           : value.is_object() ? "an object"
                               : value.dump();
  }

  Status CopyIndex(const json& in, const Field& field, const std::string& where, json* out) const {
    const auto array = root_.find(field.array);
    const std::size_t size = array == root_.end() || !array->is_array() ? 0 : array->size();
    if (!in.is_number_unsigned() || in.get<std::uint64_t>() >= size) {
      return Wrong(in, where,
                   size == 0 ? fmt::format("an index, and there are no {}", field.array)
                             : fmt::format("an index below {}, the number of {}", size, field.array));
    }
    *out = in;
    return {};
  }

  Status CopyIndexMap(const json& in, const Field& field, const std::string& where, json* out) const {
    if (!in.is_object()) return Wrong(in, where, "an object");
    *out = json::object();
    for (const auto& [key, value] : in.items()) {
      KPSA_RETURN_IF_ERROR(CopyIndex(value, field, where + "." + key, &(*out)[key]));
    }
    return {};
  }

  Status CopyField(const json& in, const Field& field, const std::string& where, json* out) const {
    const auto each = [&](const auto& copy) -> Status {
      if (!in.is_array()) return Wrong(in, where, "an array");
      *out = json::array();
      for (std::size_t i = 0; i < in.size(); ++i) {
        json element;
        KPSA_RETURN_IF_ERROR(copy(in[i], fmt::format("{}[{}]", where, i), &element));
        out->push_back(std::move(element));
      }
      return {};
    };
    switch (field.kind) {
      case Kind::kString:
        if (!in.is_string()) return Wrong(in, where, "text");
        break;
      case Kind::kBool:
        if (!in.is_boolean()) return Wrong(in, where, "true or false");
        break;
      case Kind::kSize:
      case Kind::kInt: {
        const std::uint64_t largest = field.kind == Kind::kInt ? kLargestInt : kLargestSize;
        if (!in.is_number_unsigned() || in.get<std::uint64_t>() > largest) {
          return Wrong(in, where, fmt::format("a whole number from 0 to {}", largest));
        }
        break;
      }
      case Kind::kNumbers:
        if (!in.is_array() || (field.count != 0 && in.size() != field.count) ||
            !std::all_of(in.begin(), in.end(), [](const json& v) { return v.is_number(); })) {
          return Status::Invalid("{} must be an array of {}numbers", where,
                                 field.count == 0 ? "" : fmt::format("{} ", field.count));
        }
        break;
      case Kind::kIndex:
        return CopyIndex(in, field, where, out);
      case Kind::kIndices:
        return each([&](const json& v, const std::string& w, json* o) { return CopyIndex(v, field, w, o); });
      case Kind::kIndexMap:
        return CopyIndexMap(in, field, where, out);
      case Kind::kIndexMaps:
        return each(
            [&](const json& v, const std::string& w, json* o) { return CopyIndexMap(v, field, w, o); });
      case Kind::kObject:
        return Copy(in, *field.fields, where, out);
      case Kind::kObjects:
        return each(
            [&](const json& v, const std::string& w, json* o) { return Copy(v, *field.fields, w, o); });
    }
    *out = in;
    return {};
  }

  const json& root_;
};

// "2.1" -> {2, 1}; {-1, 0} for anything else.
std::pair<int, int> ParseVersion(const std::string& text) {
  int major = 0, minor = 0, end = 0;
  if (text.size() > 8 || std::sscanf(text.c_str(), "%d.%d%n", &major, &minor, &end) != 2 ||
      static_cast<std::size_t>(end) != text.size()) {
    return {-1, 0};
  }
  return {major, minor};
}

Status CheckVersion(const json& asset) {
  const std::string version = asset.at("version"), minimum = asset.value("minVersion", std::string());
  if (ParseVersion(version).first != 2)
    return Status::Invalid("asset.version is \"{}\", expected 2.0", version);
  if (!minimum.empty() && (ParseVersion(minimum).first < 0 || ParseVersion(minimum) > std::pair(2, 0))) {
    return Status::Invalid("asset.minVersion is \"{}\"; this reader knows glTF 2.0", minimum);
  }
  return {};
}

constexpr const char *kMeshopt = "EXT_meshopt_compression", *kDraco = "KHR_draco_mesh_compression",
                     *kVisibility = "KHR_node_visibility", *kPointer = "KHR_animation_pointer";

bool IsRead(std::string_view extension) {
  return extension == "KHR_mesh_quantization" || extension == kMeshopt || extension == kDraco ||
         extension == kVisibility || extension == kPointer || extension == "VRM" || extension == "VRMC_vrm" ||
         extension == "VRMC_node_constraint";
}

bool CannotMovePoints(std::string_view extension) {
  for (const std::string_view prefix : {"KHR_texture_", "KHR_materials_", "KHR_lights_", "KHR_xmp",
                                        "EXT_texture_", "EXT_lights_", "MSFT_texture_", "VRMC_materials_"}) {
    if (extension.starts_with(prefix)) return true;
  }
  return false;
}

Status CheckExtensions(const json& root) {
  const auto required = root.find("extensionsRequired");
  if (required == root.end()) return {};
  if (!required->is_array()) return Status::Invalid("extensionsRequired must be an array of texts");
  for (const json& name : *required) {
    if (!name.is_string()) return Status::Invalid("extensionsRequired must be an array of texts");
    const std::string& text = name.get_ref<const std::string&>();
    if (IsRead(text) || CannotMovePoints(text)) continue;
    const bool compressed = text.ends_with("_compression");
    return Status::Invalid("requires the extension {}, which is not supported{}", text,
                           compressed ? "; export the file without compression" : "");
  }
  return {};
}

// What an extension has put on an object, or null.
const json* FindExtension(const json& object, const char* name) {
  const auto extensions = object.find("extensions");
  if (extensions == object.end()) return nullptr;
  const auto found = extensions->find(name);
  return found == extensions->end() ? nullptr : &*found;
}

Status CopyMeshopt(const json& root, std::vector<MeshoptView>* views) {
  static const Fields fields = {{"buffer", Kind::kIndex, true, "buffers"},
                                {"byteOffset", Kind::kSize},
                                {"byteLength", Kind::kSize, true},
                                {"byteStride", Kind::kSize, true},
                                {"count", Kind::kSize, true},
                                {"mode", Kind::kString, true},
                                {"filter", Kind::kString}};
  const auto found = root.find("bufferViews");
  if (found == root.end()) return {};
  const Reducer reducer(root);
  for (std::size_t i = 0; i < found->size(); ++i) {
    const json* extension = FindExtension((*found)[i], kMeshopt);
    if (extension == nullptr) continue;
    const std::string where = fmt::format("bufferViews[{}].extensions.{}", i, kMeshopt);
    json copy;
    KPSA_RETURN_IF_ERROR(reducer.Copy(*extension, fields, where, &copy));
    MeshoptView& view = views->emplace_back();
    view.view = i;
    view.buffer = copy["buffer"].get<std::size_t>();
    view.offset = copy.value("byteOffset", std::uint64_t{0});
    view.length = copy["byteLength"].get<std::uint64_t>();
    view.stride = copy["byteStride"].get<std::uint64_t>();
    view.count = copy["count"].get<std::uint64_t>();
    view.mode = copy["mode"].get<std::string>();
    view.filter = copy.value("filter", std::string("NONE"));
    if (view.stride > 256)
      return Status::Invalid("{}.byteStride is {}, expected 256 at most", where, view.stride);
  }
  return {};
}

Status CopyDraco(const json& root, std::vector<DracoPrimitive>* all) {
  static const Fields ids = {};
  static const Fields fields = {{"bufferView", Kind::kIndex, true, "bufferViews"},
                                {"attributes", Kind::kObject, true, nullptr, 0, &ids}};
  const auto meshes = root.find("meshes");
  if (meshes == root.end()) return {};
  const Reducer reducer(root);
  for (std::size_t m = 0; m < meshes->size(); ++m) {
    const json& primitives = (*meshes)[m]["primitives"];
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const json* extension = FindExtension(primitives[p], kDraco);
      if (extension == nullptr) continue;
      const std::string where = fmt::format("meshes[{}].primitives[{}].extensions.{}", m, p, kDraco);
      json copy;
      KPSA_RETURN_IF_ERROR(reducer.Copy(*extension, fields, where, &copy));
      DracoPrimitive& primitive = all->emplace_back();
      primitive.mesh = m, primitive.primitive = p;
      primitive.view = copy["bufferView"].get<std::size_t>();
      for (const auto& [name, id] : (*extension)["attributes"].items()) {
        if (!id.is_number_unsigned() || id.get<std::uint64_t>() > kLargestInt)
          return Status::Invalid("{}.attributes.{} must be a whole number from 0 to {}", where, name,
                                 kLargestInt);
        primitive.attributes[name] = id.get<std::uint32_t>();
      }
    }
  }
  return {};
}

// Nodes that KHR_node_visibility hides, with all below them.
Status CopyHidden(const json& root, std::vector<std::size_t>* hidden) {
  const auto nodes = root.find("nodes");
  for (std::size_t i = 0; nodes != root.end() && i < nodes->size(); ++i) {
    const json* extension = FindExtension((*nodes)[i], kVisibility);
    if (extension == nullptr) continue;
    if (!extension->is_object())
      return Status::Invalid("nodes[{}].extensions.{} must be an object", i, kVisibility);
    const auto visible = extension->find("visible");
    if (visible == extension->end()) continue;
    if (!visible->is_boolean())
      return Status::Invalid("nodes[{}].extensions.{}.visible must be true or false", i, kVisibility);
    if (!visible->get<bool>()) hidden->push_back(i);
  }
  return {};
}

// The parts of VRM's extensions that are read, for ReadVrm: {"VRM", "VRMC_vrm", "constraints": [[node, it]]}.
std::string VrmText(const json& root) {
  json parts = json::object();
  const auto keep = [&](const char* name, const char* key) {
    const json* extension = FindExtension(root, name);
    if (extension == nullptr || !extension->contains(key)) return;
    parts[name] = (*extension)[key];
  };
  keep("VRM", "blendShapeMaster");
  keep("VRMC_vrm", "expressions");
  const auto nodes = root.find("nodes");
  for (std::size_t i = 0; nodes != root.end() && i < nodes->size(); ++i) {
    if (const json* it = FindExtension((*nodes)[i], "VRMC_node_constraint"))
      parts["constraints"].push_back({i, *it});
  }
  return parts.empty() ? std::string() : parts.dump();
}

// mesh.extras.targetNames, where it is an array of texts; anything else in extras is somebody else's.
std::vector<std::string> TargetNames(const json& mesh) {
  const auto extras = mesh.find("extras");
  if (extras == mesh.end() || !extras->is_object()) return {};
  const auto found = extras->find("targetNames");
  if (found == extras->end() || !found->is_array()) return {};
  std::vector<std::string> names;
  for (const json& name : *found) names.push_back(name.is_string() ? name.get<std::string>() : "");
  return names;
}

Status CopyBuffers(const json& root, std::vector<BufferSource>* buffers) {
  static const Fields fields = {{"uri", Kind::kString}, {"byteLength", Kind::kSize, true}};
  const auto found = root.find("buffers");
  if (found == root.end()) return {};
  if (!found->is_array()) return Status::Invalid("buffers must be an array");
  const Reducer reducer(root);
  for (std::size_t i = 0; i < found->size(); ++i) {
    json copy;
    KPSA_RETURN_IF_ERROR(reducer.Copy((*found)[i], fields, fmt::format("buffers[{}]", i), &copy));
    BufferSource& buffer = buffers->emplace_back();
    buffer.has_uri = copy.contains("uri");
    if (buffer.has_uri) buffer.uri = std::move(copy["uri"].get_ref<std::string&>());
    buffer.byte_length = copy["byteLength"].get<std::uint64_t>();
    const json* extension = FindExtension((*found)[i], kMeshopt);
    buffer.is_fallback =
        extension != nullptr && extension->contains("fallback") && (*extension)["fallback"] == true;
  }
  return {};
}

// In quotes, in one line, not too long.
std::string ShownPointer(const std::string& text) {
  constexpr std::size_t kMost = 80;
  const std::string quoted = json(text.substr(0, kMost)).dump(-1, ' ', true, json::error_handler_t::replace);
  return text.size() <= kMost ? quoted : quoted + "...";
}

// Makes plain channels of those that point at translation, rotation, scale or weights of a node; those that
// point elsewhere are left out, with a warning for each animation.
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
      const json* extension = FindExtension(root["animations"][a]["channels"][c]["target"], kPointer);
      if (target["path"] != "pointer" || extension == nullptr) {
        kept.push_back(std::move(channels[c]));
        continue;
      }
      const std::string where = fmt::format("animations[{}].channels[{}].target", a, c);
      if (!extension->is_object() || !extension->contains("pointer") || !(*extension)["pointer"].is_string())
        return Status::Invalid("{}.extensions.{}.pointer must be text", where, kPointer);
      if (target.contains("node"))
        return Status::Invalid("{} has a node beside the pointer of {}", where, kPointer);
      const std::string& pointer = (*extension)["pointer"].get_ref<const std::string&>();
      PointedAt at;
      const Result<bool> read = ResolvePointer(pointer, node_count, &at);
      if (!read.ok())
        return Status::Invalid("{}: the pointer {} {}", where, ShownPointer(pointer),
                               read.status().errors()[0].message);
      if (*read) {
        target = {{"node", at.node}, {"path", at.path}};
        kept.push_back(std::move(channels[c]));
      } else if (left_out++ == 0) {
        first = pointer;
      }
    }
    channels = std::move(kept);
    if (left_out > 0) {
      warnings->push_back(
          fmt::format("animations[{}] animates {}{}, which is not supported; ignored", a, ShownPointer(first),
                      left_out == 1 ? std::string() : fmt::format(" and {} more by pointers", left_out - 1)));
    }
  }
  return {};
}

}  // namespace

Result<ReducedJson> ReduceJson(std::span<const std::uint8_t> text) {
  try {
    const json root = json::parse(text.begin(), text.end());
    ReducedJson result;
    json reduced;
    KPSA_RETURN_IF_ERROR(Reducer(root).Copy(root, TopLevel(), "", &reduced));
    KPSA_RETURN_IF_ERROR(CheckVersion(reduced["asset"]));
    KPSA_RETURN_IF_ERROR(CheckExtensions(root));
    KPSA_RETURN_IF_ERROR(CopyBuffers(root, &result.buffers));
    KPSA_RETURN_IF_ERROR(CopyMeshopt(root, &result.meshopt));
    KPSA_RETURN_IF_ERROR(CopyDraco(root, &result.draco));
    KPSA_RETURN_IF_ERROR(CopyHidden(root, &result.hidden));
    result.vrm = VrmText(root);
    if (reduced.contains("meshes")) {
      for (const json& mesh : root["meshes"]) result.target_names.push_back(TargetNames(mesh));
    }

    KPSA_RETURN_IF_ERROR(ResolvePointers(root, &reduced, &result.warnings));
    // tinygltf drops a channel without a target node with an error; the specification has it ignored
    if (reduced.contains("animations")) {
      for (json& animation : reduced["animations"]) {
        json kept = json::array();
        for (json& channel : animation["channels"]) {
          if (channel["target"].contains("node")) kept.push_back(std::move(channel));
        }
        if (kept.size() < animation["channels"].size()) {
          result.warnings.push_back(fmt::format("{} animation channel(s) without a target node are ignored",
                                                animation["channels"].size() - kept.size()));
        }
        animation["channels"] = std::move(kept);
      }
    }
    // tinygltf refuses index accessors without a buffer view, which are legal: give them one that stands for
    // none
    if (!reduced.contains("bufferViews")) reduced["bufferViews"] = json::array();
    result.no_view = static_cast<int>(reduced["bufferViews"].size());
    reduced["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 1}});
    if (reduced.contains("accessors")) {
      for (json& accessor : reduced["accessors"]) {
        if (!accessor.contains("bufferView")) accessor["bufferView"] = result.no_view;
      }
    }
    result.text = reduced.dump();
    return result;
  } catch (const json::parse_error& error) {
    return Status::Invalid("is no valid JSON at byte {}", error.byte);
  } catch (const json::exception& error) {
    return Status::Invalid("is no valid glTF: {}", error.what());
  }
}

}  // namespace kpsa::engine::gltf
