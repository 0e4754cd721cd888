#include "tests/cli/hello_folder.h"

namespace kpsa::engine {

std::string HelloFolder::Yaml() { return Read(KPSA_SCENES_DIR "/hello/hello.yaml"); }
std::string HelloFolder::Glb() { return Read(KPSA_SCENES_DIR "/hello/hello.glb"); }

std::string HelloFolder::Columns() {
  GlbParts glb(Glb());
  nlohmann::json& nodes = glb.json["nodes"];
  for (int i = 1; i < 5; ++i) {
    nlohmann::json column = nodes[2];
    column["name"] = "column" + std::to_string(i);
    glb.json["scenes"][0]["nodes"].push_back(nodes.size());
    nodes.push_back(std::move(column));
  }
  return glb.Bytes();
}

}  // namespace kpsa::engine
