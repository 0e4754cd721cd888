#include "tests/cli/hello_folder.h"

namespace kpsa::engine {

std::string HelloFolder::Yaml() { return Read(KPSA_SCENES_DIR "/hello/hello.yaml"); }
std::string HelloFolder::Glb() { return Read(KPSA_SCENES_DIR "/hello/hello.glb"); }

}  // namespace kpsa::engine
