#include "io/rig_builder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <tuple>

#include "graph/plugin_loader.h"
#include "io/rig_build.h"

namespace kpsa {
namespace {

bool IsCharacterFile(const std::string& path) {
  std::string lower = path;
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  const std::string extension = std::filesystem::path(lower).extension().string();
  return extension == ".glb" || extension == ".gltf";
}

// By file, in the order in which they first come up, then by line.
Status InOrder(const Status& status) {
  std::map<std::string, std::size_t> files;
  for (const Error& error : status.errors()) files.emplace(error.where.file, files.size());
  std::vector<Error> errors = status.errors();
  std::stable_sort(errors.begin(), errors.end(), [&](const Error& a, const Error& b) {
    return std::tuple(files[a.where.file], a.where.line, a.where.column) <
           std::tuple(files[b.where.file], b.where.line, b.where.column);
  });
  Status ordered;
  for (Error& error : errors) ordered.Add(std::move(error));
  return ordered;
}

// The variant's overrides take the place of the rig's own of the same plug.
Status ApplyVariant(const std::string& name, RigFile* file) {
  std::vector<std::string> names;
  for (const RigVariant& variant : file->variants) {
    names.push_back(variant.name);
    if (variant.name != name) continue;
    for (const RigOverride& override_ : variant.overrides) {
      std::erase_if(file->overrides,
                    [&](const RigOverride& other) { return other.plug.text == override_.plug.text; });
      file->overrides.push_back(override_);
    }
    return Status();
  }
  const std::string& path = file->sources.front().path;
  if (names.empty()) return Status::Usage("{} has no variants, so none named \"{}\"", path, name);
  return Status::Usage("{} has no variant \"{}\"{}; it has {}", path, name, DidYouMean(name, names),
                       fmt::join(names, ", "));
}

double RestDiagonal(const CharacterGraph& scene, RestPose* rest) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Double3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    for (const Double3& p : rest->WorldPoints(m)) {
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], p[i]);
        high[i] = std::max(high[i], p[i]);
      }
    }
  }
  const double diagonal = Length(high - low);
  return std::isfinite(diagonal) ? diagonal : 0;
}

}  // namespace

RigBuild::RigBuild(RigFile* file, Rig* rig, RestPose* rest, YamlErrors* errors)
    : file_(file), rig_(rig), rest_(rest), errors_(errors), stack_of_mesh_(rig->scene.meshes.size()) {
  for (std::size_t n = 0; n < file->nodes.size(); ++n) written_.emplace(file->nodes[n].name, n);
  for (Index i = 0; i < rig->character->nodes.size(); ++i) {
    const std::string& name = rig->character->nodes[i].name;
    gltf_by_name_[name.empty() ? fmt::format("node{}", i) : name].push_back(i);
    gltf_by_node_[rig->scene.transforms[i].index] = i;
  }
}

void RigBuild::Run() {
  AddClips();
  ResolveScopes();
  ApplySpecialOverrides();
  AddNodes();
  for (Made& made : made_) {
    if (!errors_->full()) ReadAttributes(&made);
  }
  ReadOverrides();
  for (std::vector<Made>* all : {&made_, &own_made_}) {
    for (Made& made : *all) AddShapeRules(&made);
  }
  AddCurves();
  ConnectParents();
  if (errors_->ok()) PlaceHandles();
  ConnectCurves();
  BuildStacks();
  ConnectLights();
  ConnectDrivers();
  for (Made& made : made_) SetTargets(&made);
  for (Made& made : own_made_) SetBlendWeights(&made);
  MakeConnections();
  AddConstraints();
  ConnectTime();
  PlaceStagesAtHandles();
  PlaceFalloffs();
  ConnectPivots();
  FinishOverrides();
  CheckVariants();
  AddControls();
  AddAccelerations();
}

bool RigBuild::Fail(const SourceLocation& where, Status status) {
  if (status.ok()) return true;
  errors_->Append(std::move(status).At(where));
  return false;
}

RigBuild::Made* RigBuild::FindMade(const std::string& name) {
  const auto it = made_by_name_.find(name);
  return it == made_by_name_.end() ? nullptr : &made_[it->second];
}

RigBuild::Made* RigBuild::FindMade(NodeId id) {
  const auto it = made_by_node_.find(id.index);
  return it == made_by_node_.end() ? nullptr : &made_[it->second];
}

Result<Rig> LoadRig(const NodeRegistry& registry, const std::string& path, const RigOptions& options) {
  if (options.fps.has_value() && !(*options.fps > 0 && std::isfinite(*options.fps))) {
    return Status::Usage("frames a second: expected a number above 0, found {}", *options.fps);
  }
  RigFile file;
  YamlErrors errors;
  SourceLocation character_at{path, 0, 0};
  if (IsCharacterFile(path)) {
    file.sources.push_back({path, "", FileUnits(), {}});
    file.character = RigString{path, character_at, 0};
    if (options.fps.has_value()) file.sources[0].units.fps = *options.fps;
    if (options.variant.has_value()) return ApplyVariant(*options.variant, &file);
  } else {
    errors.Append(ReadRigFile(path, options.fps, &file));
    if (!file.character.has_value() || !file.complete) return InOrder(errors.Take());
    character_at = file.character->where;
    if (options.variant.has_value()) KPSA_RETURN_IF_ERROR(ApplyVariant(*options.variant, &file));
  }

  for (const RigString& plugin : file.plugins) {
    errors.Append((options.plugins == nullptr
                       ? Status::Invalid("plugin \"{}\": plugins are not loaded here", plugin.text)
                       : options.plugins->Load(plugin.text))
                      .At(plugin.where));
  }

  Rig rig;
  rig.path = path;
  rig.units = file.sources[0].units;
  rig.fps = rig.units.fps;
  for (const RigSource& source : file.sources) {
    if (source.scope.empty()) rig.files.push_back(source.path);
  }
  for (const RigString& plugin : file.plugins) rig.files.push_back(plugin.text);
  Result<gltf::Character> character = gltf::LoadGltf(file.character->text);
  if (!character.ok()) {
    Status status = character.status();
    if (IsCharacterFile(path)) return status;
    errors.Append(Status::Invalid("the character cannot be read").At(character_at));
    errors.Append(std::move(status));
    return errors.Take();
  }
  if (!IsCharacterFile(path)) rig.files.push_back(file.character->text);
  rig.character = std::make_shared<const gltf::Character>(std::move(*character));
  rig.graph = std::make_unique<Graph>(registry);
  CharacterOptions character_options;
  const bool own_clip = options.clip.has_value() &&
                        std::any_of(file.clips.begin(), file.clips.end(),
                                    [&](const RigClip& clip) { return clip.name == *options.clip; });
  if (!own_clip) character_options.clip = options.clip;
  character_options.rest = options.rest || own_clip;
  character_options.weld = file.weld;
  Result<CharacterGraph> scene = BuildCharacterGraph(*rig.character, character_options, rig.graph.get());
  if (!scene.ok()) return scene.status();
  rig.scene = std::move(*scene);

  RestPose rest(*rig.character, rig.scene);
  rig.rest_diagonal = RestDiagonal(rig.scene, &rest);
  RigBuild(&file, &rig, &rest, &errors).Run();
  if (!errors.ok()) return InOrder(errors.Take());
  if (own_clip) KPSA_RETURN_IF_ERROR(SetClip(&rig, *options.clip));
  rig.notes.insert(rig.notes.begin(), rig.scene.notes.begin(), rig.scene.notes.end());
  return rig;
}

SourceLocation PlaceOfMessage(const Rig& rig, std::string_view message) {
  constexpr std::string_view kNode = "node \"", kType = "\" (";
  SourceLocation place{rig.path, 0, 0};
  if (!message.starts_with(kNode)) return place;
  message.remove_prefix(kNode.size());
  // Names may hold anything: the longest one that fits
  for (std::size_t end = message.find(kType); end != std::string_view::npos;
       end = message.find(kType, end + 1)) {
    const auto it = rig.node_places.find(std::string(message.substr(0, end)));
    if (it != rig.node_places.end()) place = it->second;
  }
  return place;
}

Status SetClip(Rig* rig, std::optional<std::string_view> clip) {
  KPSA_RETURN_IF_ERROR(SetClip(*rig->character, clip, &rig->scene, rig->graph.get()));
  for (const PlugRef& plug : rig->pinned) {
    if (rig->graph->FindConnection(plug) != nullptr) KPSA_RETURN_IF_ERROR(rig->graph->Disconnect(plug));
  }
  return Status();
}

}  // namespace kpsa
