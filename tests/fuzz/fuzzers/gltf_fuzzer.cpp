// glTF, text and binary, with the decoders of compressed geometry; what is read becomes a graph and is played.
#include <cmath>

#include "gltf/import.h"
#include "tests/fuzz/fuzzer.h"
#include "tests/fuzz/played_rig.h"

namespace kpsa::engine {

KPSA_FUZZER(gltf) {
  static const std::string kFolder =
      FuzzedFile("empty", {}) + ".folder";  // buffers of other files: there is none
  const Result<gltf::Character> character = gltf::LoadGltfFromMemory(bytes, kFolder, "fuzzed.gltf");
  if (!character.ok()) {
    RequireRefusal(character.status());
    for (const Error& error : character.status().errors())
      Require(error.where.file == "fuzzed.gltf", "an error without its file");
    return;
  }
  Reached("read");
  const std::string text = AsText(bytes);
  if (text.find("KHR_draco_mesh_compression") != text.npos && !character->meshes.empty()) Reached("draco");
  if (text.find("EXT_meshopt_compression") != text.npos && !character->meshes.empty()) Reached("meshopt");
  if (!character->clips.empty()) Reached("clip");
  if (!character->skins.empty()) Reached("skin");
  Require(character->order.size() == character->nodes.size(), "nodes without an order");
  Require(character->UniqueNames().size() == character->nodes.size(), "nodes without names");
  for (const gltf::Mesh& mesh : character->meshes) {
    if (!mesh.targets.empty()) Reached("morph");
    for (const float number : mesh.positions) Require(std::isfinite(number), "a position that is not finite");
  }
  for (const gltf::Clip& clip : character->clips)
    Require(std::isfinite(clip.duration), "a clip without an end");
  for (const bool rest : {false, true}) {
    Graph graph(FuzzedRegistry());
    CharacterOptions options;
    options.rest = rest;
    const Result<CharacterGraph> scene = BuildCharacterGraph(*character, options, &graph);
    if (!scene.ok()) return RequireRefusal(scene.status());
    PlayMeshes(graph, *scene, {});
  }
}

}  // namespace kpsa::engine
