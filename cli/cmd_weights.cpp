// kpsa weights: weight maps out of a rig, into it, and from one side to the other.
#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/command.h"
#include "cli/common.h"
#include "cli/options.h"
#include "cli/output.h"
#include "files/quantity.h"
#include "rig/build/deformer_weights.h"

namespace kpsa::engine {
namespace {

namespace fs = std::filesystem;

struct WeightsFlags : Flags {
  std::string deformer, map;
  std::optional<std::string> axis, names, tolerance;
  bool left_to_right = false, right_to_left = false, flip = false;
};

// "wire1: 4,199 vertices of face_mesh, 310 above 0, from 0.01 to 1".
std::string Facts(const NamedWeights& map, const WeightFile& file) {
  const std::vector<float> weights = DenseWeights(file, map);
  std::size_t above = 0;
  float low = 0, high = 0;
  for (float weight : weights) {
    if (weight > 0) low = above++ == 0 ? weight : std::min(low, weight);
    high = std::max(high, weight);
  }
  return fmt::format("{}: {} of {}, {} above 0{}", map.name, Plural(weights.size(), "vertex"), file.mesh,
                     Thousands(above), above == 0 ? "" : fmt::format(", from {:.3g} to {:.3g}", low, high));
}

std::string Facts(const WeightFile& file, bool skin) {
  return skin ? fmt::format("{} of {}, {} with weights", Plural(file.points, "vertex"), file.mesh,
                            Plural(file.maps.size(), "joint"))
              : Facts(file.maps[0], file);
}

// What is refused of an output before the rig is loaded, and after.
Status CheckMapOutput(const Flags& flags) {
  return CheckOutput(flags.output.value_or("-"), flags.force, {".json"});
}

Status WriteMap(const Flags& flags, const Rig& rig, const WeightFile& file, bool skin) {
  const std::string output = flags.output.value_or("-");
  KPSA_RETURN_IF_ERROR(CheckNotInput(output, rig.files));
  KPSA_RETURN_IF_ERROR(WriteText(output, flags.force, WeightFileText(file)));
  if (!flags.quiet && output != "-") Say(fmt::format("{}: {}", output, Facts(file, skin)));
  return Status();
}

CommandResult Export(const WeightsFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckMapOutput(flags));
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  const Result<DeformedMesh> of = FindDeformed(rig, flags.deformer);
  if (!of.ok()) return of.status();
  const Result<WeightFile> file = DeformerWeights(rig, *of);
  if (!file.ok()) return file.status();
  KPSA_RETURN_IF_ERROR(WriteMap(flags, rig, *file, of->is_skin()));
  return 0;
}

// Where an imported map goes, and what the rig's author has to write besides.
struct Destination {
  std::string path;                      // "": nowhere yet
  std::string map;                       // in the file; "" for skins, which are whole files
  std::string instruction;               // "" where the rig refers to it
  std::vector<std::string> shared_with;  // other deformers that read the same map
};

// The path as the file at `from` would write it.
std::string RelativeTo(const std::string& from, const std::string& path) {
  const fs::path folder = fs::path(from).parent_path();
  std::error_code error;
  const fs::path relative = fs::relative(path, folder.empty() ? fs::path(".") : folder, error);
  return error || relative.empty() ? path : relative.generic_string();
}

Destination FindDestination(const WeightsFlags& flags, const Rig& rig, const DeformedMesh& of,
                            const std::string& map_path, const std::string& map_name) {
  std::vector<const WeightSource*> maps, others;
  for (const WeightSource& source : rig.weights) {
    if (source.deformer != of.stage->node || source.key == "blendWeights") continue;
    if (!source.geometry.empty() && source.geometry != of.mesh->name) continue;
    // Members are 0 or 1: a map that was exported has them in it
    if (source.key != "members") (source.path.empty() ? others : maps).push_back(&source);
  }
  Destination to;
  const std::string name = rig.graph->name(of.stage->node), own_name = OwnName(rig, of, name);
  if (!flags.output.has_value() && maps.size() == 1 && others.empty()) {
    to.path = maps[0]->path;
    to.map = maps[0]->map;
    for (const WeightSource& source : rig.weights) {
      if (source.path == to.path && source.map == to.map && source.deformer != of.stage->node)
        to.shared_with.push_back(rig.graph->name(source.deformer));
    }
    return to;
  }
  to.path = flags.output.value_or("");
  to.map = of.is_skin() ? "" : to.path.empty() ? map_name : own_name;
  const auto place = rig.node_places.find(name);
  const SourceLocation at = place == rig.node_places.end() ? SourceLocation{rig.path, 0, 0} : place->second;
  const std::string path = RelativeTo(at.file, to.path.empty() ? map_path : to.path);
  if (of.is_skin()) {
    to.instruction = fmt::format("{}: give the skin this file\n  overrides: {{\"{}.influences\": \"{}\"}}",
                                 rig.path, name, path);
    return to;
  }
  if (maps.size() == 1 && others.empty() && maps[0]->map == to.map &&
      fs::path(maps[0]->path).lexically_normal() == fs::path(to.path).lexically_normal())
    return to;
  std::string instead;
  for (const auto* list : {&maps, &others}) {
    for (const WeightSource* source : *list)
      instead += fmt::format("{}{} (line {})", instead.empty() ? " in place of its " : ", its ", source->key,
                             source->where.line);
  }
  to.instruction = fmt::format("{}: give \"{}\" this map{}\n  weights: \"{}#{}\"", at.ToString(), own_name,
                               instead, path, to.map);
  return to;
}

// The file as it is to be written: the map among the others that are in it already.
Result<WeightFile> Merged(const Rig& rig, const DeformedMesh& of, const Destination& to,
                          const WeightFile& file, const NamedWeights& map) {
  WeightFile merged{OwnName(rig, of, of.mesh->name), file.points, {}};
  std::error_code error;
  if (fs::exists(to.path, error)) {
    Result<WeightFile> before = ReadWeightFile(to.path);
    if (!before.ok()) return before.status();
    KPSA_RETURN_IF_ERROR(CheckWeights(rig, of, *before));
    merged = std::move(*before);
  }
  NamedWeights renamed = map;
  renamed.name = to.map;
  for (NamedWeights& other : merged.maps) {
    if (other.name != to.map) continue;
    other = std::move(renamed);
    return merged;
  }
  merged.maps.push_back(std::move(renamed));
  return merged;
}

CommandResult Import(const WeightsFlags& flags) {
  if (flags.output.has_value()) {
    if (*flags.output == "-") return Status::Usage("-o: expected a file; kpsa weights export prints maps");
    KPSA_RETURN_IF_ERROR(CheckMapOutput(flags));
  }
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  const Result<DeformedMesh> of = FindDeformed(rig, flags.deformer);
  if (!of.ok()) return of.status();
  const WeightReference reference = SplitWeightReference(flags.map);
  const Result<WeightFile> file = ReadWeightFile(reference.path);
  if (!file.ok()) return file.status();
  KPSA_RETURN_IF_ERROR(CheckWeights(rig, *of, *file));
  const NamedWeights* map = nullptr;
  if (!of->is_skin()) {
    const Result<const NamedWeights*> found = FindWeights(*file, reference.path, reference.map);
    if (!found.ok()) return Status(found.status()).At({reference.path});
    map = *found;
    if (const auto outside = FirstOutOfRange(*file, *map); outside.has_value())
      return Status::Invalid("map \"{}\": vertex {} weighs {}, outside of 0 to 1", map->name, outside->first,
                             outside->second)
          .At({reference.path});
  }
  const Destination to = FindDestination(flags, rig, *of, reference.path, map == nullptr ? "" : map->name);
  const std::string facts = map == nullptr ? Facts(*file, true) : Facts(*map, *file);
  if (to.path.empty()) {
    if (!flags.quiet) Say(fmt::format("{}: fine: {}; nothing was written", reference.path, facts));
    Print(to.instruction + "\n");
    return 0;
  }
  Result<WeightFile> merged = map == nullptr ? *file : Merged(rig, *of, to, *file, *map);
  if (!merged.ok()) return merged.status();
  KPSA_RETURN_IF_ERROR(CheckOutput(to.path, flags.force, {}));
  KPSA_RETURN_IF_ERROR(AsUsage(WriteWeightFile(to.path, *merged, flags.force)));
  if (!flags.quiet)
    Say(fmt::format("{}: {}", to.path, map == nullptr ? facts : Facts(*merged->Find(to.map), *merged)));
  if (!flags.quiet && !to.shared_with.empty())
    Say(fmt::format("note: the map is that of {}, too", fmt::join(to.shared_with, ", ")));
  if (!to.instruction.empty()) Print(to.instruction + "\n");
  return 0;
}

// ".L=.R,_l=_r"
Result<NamePairs> ParseNames(const std::string& text) {
  NamePairs pairs;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string pair = text.substr(begin, end - begin);
    const std::size_t equal = pair.find('=');
    if (equal == std::string::npos || equal == 0 || equal + 1 == pair.size())
      return Status::Usage("--names \"{}\": expected pairs as in .L=.R,_l=_r, found \"{}\"", text, pair);
    pairs.emplace_back(pair.substr(0, equal), pair.substr(equal + 1));
    begin = end + 1;
  }
  return pairs;
}

Result<MirrorOptions> ParseMirror(const WeightsFlags& flags) {
  MirrorOptions options;
  if (flags.left_to_right + flags.right_to_left + flags.flip > 1)
    return Status::Usage("expected one of --left-to-right, --right-to-left and --flip");
  options.from = flags.flip            ? MirrorOptions::From::kBoth
                 : flags.right_to_left ? MirrorOptions::From::kRight
                                       : MirrorOptions::From::kLeft;
  const std::string axis = flags.axis.value_or("x");
  if (axis != "x" && axis != "y" && axis != "z")
    return Status::Usage("--axis \"{}\": expected x, y or z", axis);
  options.axis = axis[0] - 'x';
  options.names = DefaultNamePairs();
  if (flags.names.has_value()) {
    Result<NamePairs> names = ParseNames(*flags.names);
    if (!names.ok()) return names.status();
    options.names = std::move(*names);
  }
  if (flags.tolerance.has_value()) {
    const Result<double> tolerance = ParseQuantity(*flags.tolerance, Unit::kLength, FileUnits());
    if (!tolerance.ok() || *tolerance < 0)
      return Status::Usage("--tolerance \"{}\": expected a length of 0 or more, as in 0.2mm",
                           *flags.tolerance);
    options.tolerance = *tolerance;
  }
  return options;
}

CommandResult Mirror(const WeightsFlags& flags) {
  KPSA_RETURN_IF_ERROR(CheckMapOutput(flags));
  const Result<MirrorOptions> options = ParseMirror(flags);
  if (!options.ok()) return options.status();
  const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags);
  if (!open.ok()) return open.status();
  const Rig& rig = (*open)->rig;
  const Result<DeformedMesh> of = FindDeformed(rig, flags.deformer);
  if (!of.ok()) return of.status();
  const Result<MirroredWeights> mirrored = MirrorWeights(rig, *of, *options);
  if (!mirrored.ok()) return mirrored.status();
  KPSA_RETURN_IF_ERROR(WriteMap(flags, rig, mirrored->file, of->is_skin()));
  if (flags.quiet) return 0;
  if (!mirrored->unmatched.empty()) {
    std::vector<Index> first = mirrored->unmatched;
    if (first.size() > 5) first.resize(5);
    Say(fmt::format("note: {} without a partner within {} (the farthest is {} away): {}{}",
                    Plural(mirrored->unmatched.size(), "vertex"), LengthText(mirrored->tolerance),
                    LengthText(mirrored->farthest), fmt::join(first, ", "),
                    first.size() < mirrored->unmatched.size() ? ", ..." : ""));
  }
  if (!mirrored->unpaired.empty())
    Say(fmt::format("note: no joint on the other side of {}", fmt::join(mirrored->unpaired, ", ")));
  return 0;
}

CLI::App* AddAction(CLI::App* group, const std::string& name, const std::string& doc,
                    const std::string& examples, Command* chosen, const std::shared_ptr<WeightsFlags>& flags,
                    CommandResult (*run)(const WeightsFlags&)) {
  CLI::App* action = AddCommand(group, name, doc, examples, chosen, [flags, run] { return run(*flags); });
  AddRequired(action, "RIG", &flags->file, "a rig (.yaml) or a character (.glb, .gltf)");
  AddRequired(action, "DEFORMER", &flags->deformer,
              "a deformer, NODE or MESH@STAGE; a skin is MESH_skinCluster or MESH@skin");
  AddOption(action, "--variant", "NAME", &flags->variant, "a variant of the rig");
  AddPluginFlags(action, flags.get());
  AddQuietFlag(action, flags.get());
  return action;
}

}  // namespace

void AddWeightsCommand(CLI::App* program, Command* chosen) {
  CLI::App* group = AddCommandGroup(
      program, "weights", "Weight maps of deformers and skins as files: export, import, mirror",
      "Vertices are those of the file, the primitives of a mesh one after the other, as in "
      "kpsa eval.\n"
      "Examples:\n"
      "  kpsa weights export face.yaml mush -o mush.json\n"
      "  kpsa weights import face.yaml mush mush.json --force\n"
      "  kpsa weights mirror face.yaml face_mesh@skin --left-to-right -o skin.json");
  auto exported = std::make_shared<WeightsFlags>(), imported = std::make_shared<WeightsFlags>(),
       mirrored = std::make_shared<WeightsFlags>();
  CLI::App* action =
      AddAction(group, "export", "The weights of a deformer, or of a skin by joint",
                "Members, weight maps and falloffs are multiplied: what comes out are numbers.\n"
                "Examples:\n"
                "  kpsa weights export hello.yaml mush -o mush.json\n"
                "  kpsa weights export head.glb head_mesh@skin > skin.json",
                chosen, exported, &Export);
  AddOutputFlags(action, exported.get(), "a weight file, .json; stdout if not given");

  action = AddAction(
      group, "import", "Check a weight map and put it where the rig looks for it",
      "Where the deformer has one weight map, that is replaced; the file's other maps stay. Else, or with "
      "-o, what is to be added to the rig is printed.\n"
      "Examples:\n"
      "  kpsa weights import face.yaml mush painted.json --force\n"
      "  kpsa weights import face.yaml mush painted.json#mush -o w/mush.json\n"
      "  kpsa weights import head.yaml head_mesh@skin skin.json -o w/skin.json",
      chosen, imported, &Import);
  AddRequired(action, "MAP", &imported->map, "a weight file, FILE.json or FILE.json#MAP");
  AddOutputFlags(action, imported.get(), "where to put it, if not where the rig looks for it");

  action = AddAction(
      group, "mirror", "The weights of one side on the other",
      "Partners are the closest points at rest across the plane through the mesh's origin; joints change "
      "sides by their names.\n"
      "Examples:\n"
      "  kpsa weights mirror human.glb body@skin -o skin.json\n"
      "  kpsa weights mirror face.yaml browWireL --flip -o browWireR.json\n"
      "  kpsa weights mirror rig.yaml body@skin --right-to-left --names _lt=_rt -o skin.json",
      chosen, mirrored, &Mirror);
  AddOption(action, "--axis", "AXIS", &mirrored->axis, "x, y or z of the mesh's own space; x if not given");
  AddSwitch(action, "--left-to-right", &mirrored->left_to_right,
            "left is above 0 of the axis; what is done if nothing is said");
  AddSwitch(action, "--right-to-left", &mirrored->right_to_left, "the other way round");
  AddSwitch(action, "--flip", &mirrored->flip, "the sides change places");
  AddOption(action, "--names", "L=R,...", &mirrored->names,
            "parts of joints' names, left=right; .L=.R, _L=_R, Left=Right and the like if not given");
  AddOption(action, "--tolerance", "LENGTH", &mirrored->tolerance,
            "vertices whose partner is farther away are reported; 1/1000 of the mesh's size if not given");
  AddOutputFlags(action, mirrored.get(), "a weight file, .json; stdout if not given");
}

}  // namespace kpsa::engine
