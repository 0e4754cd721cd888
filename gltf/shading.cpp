#include "gltf/shading.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "files/file.h"
#include "files/json_depth.h"
#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

using nlohmann::json;

constexpr std::uint64_t kLargestShaded = std::uint64_t{4} << 30;

// Element `index` of a top-level array; what is not there throws, as all of json does here.
const json& Element(const json& root, const char* array, const json& index) {
  return root.at(array).at(index.get<std::size_t>());
}

// What of a document is read, and where to.
struct Source {
  const json& root;
  std::span<const std::uint8_t> binary;
  PointCache* cache;
  std::map<std::size_t, Index> images;  // by image of the file
};

// The image of the base colour, for `*index`; "" or why it is left out.
std::string ReadImage(const json& texture, Source* source, Index* index) {
  const json& root = source->root;
  if (texture.contains("extensions")) return "has an extension";
  if (texture.value("texCoord", 0) != 0) return "uses other texture coordinates than the first";
  const json& found = Element(root, "textures", texture.at("index"));
  if (!found.contains("source")) return "is no PNG or JPEG";
  const auto number = found["source"].get<std::size_t>();
  if (const auto known = source->images.find(number); known != source->images.end()) {
    *index = known->second;
    return "";
  }
  const json& image = Element(root, "images", found["source"]);
  constexpr const char* kElsewhere = "is not in the file's binary part";
  if (!image.contains("bufferView")) return kElsewhere;
  const std::string type = image.value("mimeType", "");
  if (type != "image/png" && type != "image/jpeg") return "is no PNG or JPEG";
  const json& view = Element(root, "bufferViews", image["bufferView"]);
  const json& buffer = Element(root, "buffers", view.at("buffer"));
  const auto offset = view.value("byteOffset", std::uint64_t{0});
  const auto length = view.at("byteLength").get<std::uint64_t>();
  const std::size_t size = source->binary.size();
  if (view["buffer"] != 0 || buffer.contains("uri") || view.contains("extensions") || length == 0 ||
      offset > size || length > size - offset)
    return kElsewhere;
  const auto bytes = source->binary.subspan(offset, length);
  *index = source->images[number] = static_cast<Index>(source->cache->images.size());
  source->cache->images.push_back({type, {bytes.begin(), bytes.end()}});
  return "";
}

bool RepeatsAsUsual(const json& sampler) {
  constexpr int kRepeat = 10497;  // glTF 2.0, 5.26
  return sampler.value("wrapS", kRepeat) == kRepeat && sampler.value("wrapT", kRepeat) == kRepeat;
}

void ReadMaterial(const json& in, Source* source, CacheMaterial* material, std::vector<std::string>* notes) {
  const auto share = [](const json& object, const char* key, double usual) {
    const double value = object.value(key, usual);
    return value >= 0 && value <= 1 ? value : usual;
  };
  material->double_sided = in.value("doubleSided", false);
  const std::string alpha = in.value("alphaMode", "OPAQUE");
  if (alpha == "MASK" || alpha == "BLEND") material->alpha_mode = alpha;
  material->alpha_cutoff = share(in, "alphaCutoff", 0.5);
  if (!in.contains("pbrMetallicRoughness")) return;
  const json& shading = in["pbrMetallicRoughness"];
  material->metallic = share(shading, "metallicFactor", 1);
  material->roughness = share(shading, "roughnessFactor", 1);
  if (!shading.contains("baseColorTexture")) return;
  const std::string why = ReadImage(shading["baseColorTexture"], source, &material->image);
  if (why.empty()) {
    const json& texture = Element(source->root, "textures", shading["baseColorTexture"].at("index"));
    if (texture.contains("sampler") && !RepeatsAsUsual(Element(source->root, "samplers", texture["sampler"])))
      notes->push_back(fmt::format(
          "the image of material \"{}\" repeats beyond its borders, where the character's ends otherwise",
          material->name));
    return;
  }
  notes->push_back(fmt::format("material \"{}\" goes without its image, which {}", material->name, why));
}

}  // namespace

void ReadShading(const std::string& path, PointCache* cache, std::vector<std::string>* notes) {
  if (cache->materials.empty()) return;
  const auto plain = [&](const std::string& why) {
    notes->push_back(fmt::format("materials have their base colours alone: {} {}", path, why));
  };
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kLargestShaded);
  if (!bytes.ok()) return plain("cannot be read");
  const Result<Container> container = SplitContainer(*bytes);
  if (!container.ok() || !CheckJsonDepth(container->json).ok()) return plain("is no glTF");
  try {
    const json root = json::parse(container->json.begin(), container->json.end());
    const json& all = root.at("materials");
    Source source{root, container->binary, cache, {}};
    for (std::size_t i = 0; i < cache->materials.size(); ++i)
      ReadMaterial(all.at(i), &source, &cache->materials[i], notes);
  } catch (const json::exception&) {
    plain("has materials that are not as glTF says");
  }
}

}  // namespace kpsa::engine::gltf
