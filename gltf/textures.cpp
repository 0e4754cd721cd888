#include "gltf/textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "base/scalar_math.h"
#include "files/file.h"
#include "files/json_depth.h"
#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

constexpr const char* kTransform = "KHR_texture_transform";

// A top-level array's element, checked: `index` stands at `where`.
Result<const json*> ElementAt(const json& root, const char* array, const json& index,
                              const std::string& where) {
  const auto found = root.find(array);
  const std::size_t count = found == root.end() || !found->is_array() ? 0 : found->size();
  if (!index.is_number_unsigned() || index.get<std::uint64_t>() >= count)
    return Status::Invalid("{} is no index of one of {} {}", where, count, array);
  const json& element = (*found)[index.get<std::size_t>()];
  if (!element.is_object()) return Status::Invalid("{}[{}] is no object", array, index.get<std::size_t>());
  return &element;
}

Result<std::size_t> Whole(const json& object, const char* key, std::size_t usual, const std::string& where) {
  const auto found = object.find(key);
  if (found == object.end()) return usual;
  if (!found->is_number_unsigned()) return Status::Invalid("{}.{} is no whole number", where, key);
  return found->get<std::size_t>();
}

Result<Wrap> ReadWrap(const json& sampler, const char* key, const std::string& where) {
  const Result<std::size_t> mode = Whole(sampler, key, 10497, where);
  if (!mode.ok()) return mode.status();
  switch (*mode) {  // as WebGL numbers them (glTF 2.0, 5.26)
    case 10497:
      return Wrap::kRepeat;
    case 33648:
      return Wrap::kMirror;
    case 33071:
      return Wrap::kClamp;
    default:
      return Status::Invalid("{}.{} is {}, expected 10497, 33648 or 33071", where, key, *mode);
  }
}

// One or two numbers of the extension.
Status ReadFactors(const json& extension, const char* key, const std::string& where, std::span<double> to) {
  const auto found = extension.find(key);
  if (found == extension.end()) return {};
  const json list = found->is_array() ? *found : json::array({*found});
  bool good = list.size() == to.size();
  for (std::size_t i = 0; good && i < to.size(); ++i) {
    good = list[i].is_number() && std::isfinite(list[i].get<double>());
    if (good) to[i] = list[i].get<double>();
  }
  return good ? Status() : Status::Invalid("{}.{} is not {} finite number(s)", where, key, to.size());
}

// The extension turns and scales coordinates, v downwards, counter-clockwise as one sees them.
Status ReadTransform(const json& extension, const std::string& where, BaseTexture* texture) {
  std::array<double, 2> offset = {0, 0}, scale = {1, 1};
  std::array<double, 1> angle = {0};
  KPSA_RETURN_IF_ERROR(ReadFactors(extension, "offset", where, offset));
  KPSA_RETURN_IF_ERROR(ReadFactors(extension, "rotation", where, angle));
  KPSA_RETURN_IF_ERROR(ReadFactors(extension, "scale", where, scale));
  const Result<std::size_t> set = Whole(extension, "texCoord", texture->uv_set, where);
  if (!set.ok()) return set.status();
  texture->uv_set = *set;
  const double c = Cos(angle[0]), s = Sin(angle[0]);
  texture->place = {c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
  return {};
}

// One file while its textures are read.
class TextureReader {
 public:
  TextureReader(const json& root, std::span<const std::uint8_t> binary, bool is_binary, std::string path,
                std::uint64_t* budget, BaseTextures* to)
      : root_(root),
        binary_(binary),
        is_binary_(is_binary),
        path_(std::move(path)),
        budget_(*budget),
        to_(*to) {}

  // Of one material, if it has any.
  Status Read(Index material) {
    const auto found = root_.find("materials");
    if (found == root_.end() || !found->is_array() || material >= found->size()) return {};
    const json& in = (*found)[material];
    const json* info = &in;
    std::string where = fmt::format("materials[{}]", material);
    for (const char* key : {"pbrMetallicRoughness", "baseColorTexture"}) {
      if (!info->is_object() || !info->contains(key)) return {};
      info = &(*info)[key];
      where += std::string(".") + key;
    }
    if (!info->is_object() || !info->contains("index")) return Status::Invalid("{} has no index", where);
    BaseTexture texture;
    const Result<std::size_t> set = Whole(*info, "texCoord", 0, where);
    if (!set.ok()) return set.status();
    texture.uv_set = *set;
    if (info->contains("extensions") && (*info)["extensions"].is_object() &&
        (*info)["extensions"].contains(kTransform)) {
      KPSA_RETURN_IF_ERROR(
          ReadTransform((*info)["extensions"][kTransform], where + ".extensions." + kTransform, &texture));
    }
    if (texture.uv_set > 3)
      return Status::Invalid("{} lies on TEXCOORD_{}; the first four are read", where, texture.uv_set);
    const Result<const json*> element = ElementAt(root_, "textures", (*info)["index"], where + ".index");
    if (!element.ok()) return element.status();
    const std::string texture_place = fmt::format("textures[{}]", (*info)["index"].get<std::size_t>());
    KPSA_RETURN_IF_ERROR(ReadSampler(**element, texture_place, &texture));
    if (!(*element)->contains("source")) {
      return Status::Invalid("{} has no source that is a PNG or JPEG{}", texture_place,
                             (*element)->contains("extensions") ? ", only one of an extension" : "");
    }
    KPSA_RETURN_IF_ERROR(FindImage((**element)["source"], texture_place + ".source", &texture.image));
    to_.materials[material] = texture;
    return {};
  }

 private:
  Status ReadSampler(const json& in, const std::string& where, BaseTexture* texture) const {
    if (!in.contains("sampler")) return {};
    const Result<const json*> sampler = ElementAt(root_, "samplers", in["sampler"], where + ".sampler");
    if (!sampler.ok()) return sampler.status();
    const std::string place = fmt::format("samplers[{}]", in["sampler"].get<std::size_t>());
    const Result<Wrap> u = ReadWrap(**sampler, "wrapS", place), v = ReadWrap(**sampler, "wrapT", place);
    if (!u.ok()) return u.status();
    if (!v.ok()) return v.status();
    texture->wrap_u = *u, texture->wrap_v = *v;
    constexpr int kNearest = 9728;
    const Result<std::size_t> filter = Whole(**sampler, "magFilter", 0, place);
    if (!filter.ok()) return filter.status();
    texture->nearest = *filter == kNearest;
    return {};
  }

  // Each image is read once, a broken one, too; everybody who wants it is told.
  Status FindImage(const json& source, const std::string& where, std::size_t* index) {
    const Result<const json*> image = ElementAt(root_, "images", source, where);
    if (!image.ok()) return image.status();
    const auto number = source.get<std::size_t>();
    auto known = known_.find(number);
    if (known == known_.end())
      known = known_.emplace(number, AddImage(**image, fmt::format("images[{}]", number))).first;
    if (!known->second.ok()) return known->second.status();
    *index = *known->second;
    return {};
  }

  // Its place in the result.
  Result<std::size_t> AddImage(const json& image, const std::string& place) {
    Result<Bytes> bytes = ImageBytes(image, place);
    if (!bytes.ok()) return Status::Invalid("{}: {}", place, bytes.status().errors().front().message);
    if (bytes->size() > budget_)
      return Status::Invalid("{} has {} bytes, of all that a picture's textures may have {} are left", place,
                             bytes->size(), budget_);
    budget_ -= bytes->size();
    to_.images.push_back({path_ + ": " + place, std::move(*bytes)});
    return to_.images.size() - 1;
  }

  Result<Bytes> ImageBytes(const json& image, const std::string& place) {
    const std::string folder = std::filesystem::path(path_).parent_path().string();
    if (image.contains("uri")) {
      if (!image["uri"].is_string()) return Status::Invalid("its uri is no text");
      return ReadUri(image["uri"].get_ref<const std::string&>(), folder, budget_);
    }
    if (!image.contains("bufferView")) return Status::Invalid("it has neither uri nor bufferView");
    const Result<const json*> view =
        ElementAt(root_, "bufferViews", image["bufferView"], place + ".bufferView");
    if (!view.ok()) return view.status();
    const std::string view_place = fmt::format("bufferViews[{}]", image["bufferView"].get<std::size_t>());
    if (!(*view)->contains("buffer")) return Status::Invalid("{} names no buffer", view_place);
    const Result<std::size_t> offset = Whole(**view, "byteOffset", 0, view_place),
                              length = Whole(**view, "byteLength", 0, view_place);
    if (!offset.ok()) return offset.status();
    if (!length.ok()) return length.status();
    Result<std::span<const std::uint8_t>> buffer = BufferBytes((**view)["buffer"], view_place, folder);
    if (!buffer.ok()) return buffer.status();
    if (*offset > buffer->size() || *length > buffer->size() - *offset)
      return Status::Invalid("{} goes from byte {} for {} bytes, its buffer has {}", view_place, *offset,
                             *length, buffer->size());
    const auto bytes = buffer->subspan(*offset, *length);
    return Bytes(bytes.begin(), bytes.end());
  }

  Result<std::span<const std::uint8_t>> BufferBytes(const json& index, const std::string& where,
                                                    const std::string& folder) {
    const Result<const json*> buffer = ElementAt(root_, "buffers", index, where + ".buffer");
    if (!buffer.ok()) return buffer.status();
    const auto number = index.get<std::size_t>();
    if (!(*buffer)->contains("uri")) {
      if (number != 0 || !is_binary_) return Status::Invalid("buffers[{}] has no data", number);
      return binary_;
    }
    if (!(**buffer)["uri"].is_string()) return Status::Invalid("buffers[{}].uri is no text", number);
    if (const auto known = buffers_.find(number); known != buffers_.end())
      return std::span<const std::uint8_t>(known->second);
    Result<Bytes> bytes = ReadUri((**buffer)["uri"].get_ref<const std::string&>(), folder, kLargestFile);
    if (!bytes.ok()) return bytes.status();
    return std::span<const std::uint8_t>(buffers_[number] = std::move(*bytes));
  }

  const json& root_;
  const std::span<const std::uint8_t> binary_;
  const bool is_binary_;
  const std::string path_;
  std::uint64_t& budget_;
  BaseTextures& to_;
  std::map<std::size_t, Result<std::size_t>> known_;  // by image of the file
  std::map<std::size_t, Bytes> buffers_;              // that are not in the container, by number
};

}  // namespace

BaseTextures ReadBaseTextures(const std::string& path, std::span<const Index> materials,
                              std::uint64_t* budget, std::vector<std::string>* notes) {
  BaseTextures textures;
  const auto note = [&](const std::string& why) { notes->push_back(fmt::format("{}: {}", path, why)); };
  if (materials.empty()) return textures;
  textures.materials.resize(std::size_t{1} + *std::max_element(materials.begin(), materials.end()));
  const Result<Bytes> bytes = ReadFileBytes(path, kLargestFile);
  if (!bytes.ok()) return note("no textures: it cannot be read again"), textures;
  const Result<Container> container = SplitContainer(*bytes);
  if (!container.ok() || !CheckJsonDepth(container->json).ok())
    return note("no textures: it is no glTF"), textures;
  const json root = json::parse(container->json.begin(), container->json.end(), nullptr, false);
  if (!root.is_object()) return note("no textures: it is no glTF"), textures;
  TextureReader reader(root, container->binary, container->is_binary, path, budget, &textures);
  for (const Index material : materials) {
    if (const Status status = reader.Read(material); !status.ok())
      note(status.errors().front().message + "; material goes by its base colour");
  }
  return textures;
}

}  // namespace kpsa::engine::gltf
