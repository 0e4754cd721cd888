// Rigs: YAML with templates, includes, references and weight files, read, formatted, built, compiled and played. An
// input is several files: a line "#### NAME" begins the next one. What is before the first such line is rig.yaml; NAME
// is one of those below. The character is strip.glb.
#include <array>

#include "files/yaml_document.h"
#include "rig/build/rig_builder.h"
#include "rig/file/format.h"
#include "tests/fuzz/fuzzer.h"
#include "tests/fuzz/played_rig.h"
#include "tests/support/moving_character.h"

namespace kpsa::engine {
namespace {

constexpr std::array<std::string_view, 4> kNames = {"rig.yaml", "part.yaml", "other.yaml", "weights.json"};

std::string WriteFiles(const std::string& text) {
  static const std::string kCharacter = [] {
    MovingCharacter character;
    character.Swing("wave", 30, 1);
    const std::string glb = character.builder.Glb();
    return FuzzedFile("strip.glb", AsBytes(glb));
  }();
  std::array<std::string, kNames.size()> files;
  std::size_t current = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    std::size_t named = kNames.size();
    for (std::size_t i = 0; line.starts_with("#### ") && i < kNames.size(); ++i) {
      if (line.substr(5) == kNames[i]) named = i;
    }
    if (named < kNames.size()) {
      current = named;
    } else {
      files[current].append(line).push_back('\n');
    }
  }
  for (std::size_t i = kNames.size(); i-- > 1;) (void)FuzzedFile(std::string(kNames[i]), AsBytes(files[i]));
  return FuzzedFile("rig.yaml", AsBytes(files[0]));
}

// The canonical form reads back, and is its own canonical form.
void CheckFormat(const std::string& path) {
  const Result<YamlNode> root = ReadYamlFile(path);
  if (!root.ok()) return RequireRefusal(root.status());
  const Result<std::string> text = FormatRig(*root, FuzzedRegistry());
  if (!text.ok()) return RequireRefusal(text.status());
  Reached("formatted");
  const Result<YamlNode> again = ParseYaml(*text, "formatted");
  Require(again.ok(), "a formatted rig does not read back: " + *text + again.status().ToString());
  const Result<std::string> twice = FormatRig(*again, FuzzedRegistry());
  Require(twice.ok() && *twice == *text, "a formatted rig formats as another text: " + *text);
}

}  // namespace

KPSA_FUZZER(rig) {
  const std::string path = WriteFiles(AsText(bytes));
  CheckFormat(path);
  Result<Rig> rig = LoadRig(FuzzedRegistry(), path);
  if (!rig.ok()) {
    RequireRefusal(rig.status());
    for (const Error& error : rig.status().errors())
      Require(!error.where.file.empty(), "an error without its file");
    return;
  }
  Reached("built");
  if (rig->files.size() > 2) Reached("include");
  if (!rig->references.empty()) Reached("reference");
  for (const WeightSource& weights : rig->weights) {
    if (!weights.path.empty()) Reached("weights");
  }
  for (const auto& [name, place] : rig->node_places) {
    if (name.find(':') != name.npos) Reached("template");
  }
  std::vector<PlugRef> varying;
  for (const Control& control : rig->controls) {
    if (rig->graph->FindConnection(control.plug) == nullptr) varying.push_back(control.plug);
  }
  PlayMeshes(*rig->graph, rig->scene, varying);
}

}  // namespace kpsa::engine
