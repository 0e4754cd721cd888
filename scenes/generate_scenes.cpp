// generate_scenes FOLDER: writes the generated files of the scenes into FOLDER/face, FOLDER/boy,
// FOLDER/animal, FOLDER/car, FOLDER/hello and FOLDER/gi. The bytes are the same on every machine; a test
// compares them with the files of the source tree.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "scenes/face_model.h"

namespace {

bool WriteAll(const std::filesystem::path& folder, const kpsa::engine::scenes::SceneFiles& files) {
  for (const auto& [name, bytes] : files) {
    const std::filesystem::path path = folder / name;
    std::error_code error;
    std::filesystem::create_directories(path.parent_path(), error);
    std::ofstream out(path, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) {
      std::fprintf(stderr, "cannot write \"%s\"\n", path.c_str());
      return false;
    }
    std::printf("%s: %zu bytes\n", path.c_str(), bytes.size());
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: generate_scenes FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  bool heads = true;
  for (const auto* design :
       {&kpsa::engine::scenes::FaceDesign(), &kpsa::engine::scenes::BoyDesign(), &kpsa::engine::scenes::AnimalDesign()})
    heads = WriteAll(folder / design->name,
                     kpsa::engine::scenes::GenerateHead(*design, kpsa::engine::scenes::MakeHeadShape(*design))) &&
            heads;
  const bool written = heads && WriteAll(folder / "hello", kpsa::engine::scenes::GenerateHello()) &&
                       WriteAll(folder / "gi", kpsa::engine::scenes::GenerateRoom()) &&
                       WriteAll(folder / "car", kpsa::engine::scenes::GenerateCar());
  return written ? 0 : 4;
}
