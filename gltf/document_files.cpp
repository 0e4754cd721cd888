#include "gltf/document_files.h"

#include <nlohmann/json.hpp>
#include <set>

#include "files/file.h"
#include "files/json_depth.h"
#include "gltf/document.h"

namespace kpsa::engine::gltf {

Result<std::vector<std::string>> FilesBeside(const std::string& path) {
  using nlohmann::json;
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kLargestFile);
  if (!bytes.ok()) return bytes.status();
  const Result<Container> container = SplitContainer(*bytes);
  if (!container.ok()) return Status(container.status()).At({path});
  KPSA_RETURN_IF_ERROR(CheckJsonDepth(container->json).At({path}));
  const json root = json::parse(container->json.begin(), container->json.end(), nullptr, false);
  if (!root.is_object()) return Status::Invalid("is no glTF").At({path});
  std::set<std::string> files;
  for (const char* array : {"buffers", "images"}) {
    const auto elements = root.find(array);
    if (elements == root.end() || !elements->is_array()) continue;
    for (const json& element : *elements) {
      const auto uri = element.is_object() ? element.find("uri") : element.end();
      if (uri == element.end() || !uri->is_string()) continue;
      if (Result<std::string> file = RelativePathOfUri(uri->get_ref<const std::string&>()); file.ok())
        files.insert(std::move(*file));
    }
  }
  return std::vector<std::string>(files.begin(), files.end());
}

}  // namespace kpsa::engine::gltf
