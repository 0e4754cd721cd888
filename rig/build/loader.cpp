// LoadRig: the files of a rig and of those that it references, read and put together.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>

#include "graph/plugin_loader.h"
#include "rig/build/build_rig.h"
#include "rig/build/references.h"
#include "rig/file/values.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxReferences = 256;
constexpr std::size_t kMaxLevels = 16;  // each renames all that is below it

bool IsCharacterFile(const std::string& path) {
  std::string lower = path;
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  const std::string extension = std::filesystem::path(lower).extension().string();
  return extension == ".glb" || extension == ".gltf" || extension == ".vrm";
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

// An override takes the place of an earlier one of the same plug.
void Override(const RigOverride& override_, RigFile* file) {
  std::erase_if(file->overrides,
                [&](const RigOverride& other) { return other.plug.text == override_.plug.text; });
  file->overrides.push_back(override_);
}

// The variant's overrides take the place of the rig's own of the same plug.
Status ApplyVariant(const std::string& name, RigFile* file) {
  std::vector<std::string> names;
  for (const RigVariant& variant : file->variants) {
    names.push_back(variant.name);
    if (variant.name != name) continue;
    for (const RigOverride& override_ : variant.overrides) Override(override_, file);
    return Status();
  }
  const std::string& path = file->sources.front().path;
  if (names.empty()) return Status::Usage("{} has no variants, so none named \"{}\"", path, name);
  return Status::Usage("{} has no variant \"{}\"{}; it has {}", path, name, DidYouMean(name, names),
                       fmt::join(names, ", "));
}

// hero:game is the variant `game` of the reference hero, where the rig has no variant of that name.
bool NamesReference(const std::string& variant, const RigFile& file) {
  if (std::any_of(file.variants.begin(), file.variants.end(),
                  [&](const RigVariant& own) { return own.name == variant; }))
    return false;
  return std::any_of(file.references.begin(), file.references.end(), [&](const RigReference& reference) {
    return variant.starts_with(reference.name + ":");
  });
}

// Overrides that a file gives to one that it references, in the latter's names; `sources[i]` has the units
// and the folder of `overrides[i]`. Connections to what the latter does not know come back.
struct GivenOverrides {
  std::vector<RigOverride> overrides;
  std::vector<RigSource> sources;
  std::vector<RigOverride> returned;  // their plug's `source` is a place in `overrides`
};

class Loader {
 public:
  Loader(const NodeRegistry& registry, const RigOptions& options, TrustedFolders trusted)
      : registry_(registry), options_(options), trusted_(std::move(trusted)) {}

  // `given`: of the file that references this one; null for the one that was asked for.
  Result<LoadedRig> Load(const std::string& path, const std::optional<std::string>& variant,
                         GivenOverrides* given);

 private:
  struct Opened {
    std::string identity, path;
    SourceLocation where;
  };

  static void TakeOverrides(const GivenOverrides& given, RigFile* file);
  Status LoadPlugins(const RigFile& file) const;
  Status AddReferences(const std::optional<std::string>& variant, RigFile* file, LoadedRig* to);
  Status LoadReference(const RigReference& reference, const std::optional<std::string>& variant,
                       RigFile* file, LoadedRig* to);
  Status CheckReference(const RigReference& reference);

  const NodeRegistry& registry_;
  const RigOptions& options_;
  const TrustedFolders trusted_;  // of the rig that was asked for, for those that it references, too
  std::vector<Opened> open_;      // the outermost first
  std::size_t references_ = 0;
};

std::string IdentityOf(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::weakly_canonical(path, ignored).string();
}

void Loader::TakeOverrides(const GivenOverrides& given, RigFile* file) {
  for (std::size_t i = 0; i < given.overrides.size(); ++i) {
    RigOverride override_ = given.overrides[i];
    override_.plug.source = static_cast<int>(file->sources.size());
    file->sources.push_back(given.sources[i]);
    Override(override_, file);
  }
}

Status Loader::LoadPlugins(const RigFile& file) const {
  Status status;
  for (const RigString& plugin : file.plugins) {
    status.Append((options_.plugins == nullptr
                       ? Status::Invalid("plugin \"{}\": plugins are not loaded here", plugin.text)
                       : options_.plugins->Load(plugin.text))
                      .At(plugin.where));
  }
  return status;
}

Result<LoadedRig> Loader::Load(const std::string& path, const std::optional<std::string>& variant,
                               GivenOverrides* given) {
  RigFile file;
  YamlErrors errors;
  SourceLocation character_at{path, 0, 0};
  std::optional<std::string> inner_variant;
  if (IsCharacterFile(path)) {
    file.trusted = trusted_;
    file.sources.push_back({path, "", FileUnits(), {}});
    file.character = RigString{path, character_at, 0};
    if (options_.fps.has_value()) file.sources[0].units.fps = *options_.fps;
    if (variant.has_value()) return ApplyVariant(*variant, &file);
  } else {
    errors.Append(ReadRigFile(path, options_.fps, &file, false, &trusted_));
    if ((!file.character.has_value() && file.references.empty()) || !file.complete)
      return InOrder(errors.Take());
    if (file.character.has_value()) character_at = file.character->where;
    if (variant.has_value()) {
      if (NamesReference(*variant, file)) {
        inner_variant = variant;
      } else {
        KPSA_RETURN_IF_ERROR(ApplyVariant(*variant, &file));
      }
    }
  }
  const std::size_t own_sources = file.sources.size();
  if (given != nullptr) TakeOverrides(*given, &file);
  errors.Append(LoadPlugins(file));

  LoadedRig loaded;
  Rig& rig = loaded.rig;
  rig.path = path;
  rig.units = file.sources[0].units;
  rig.fps = rig.units.fps;
  for (std::size_t s = 0; s < own_sources; ++s) {
    if (file.sources[s].scope.empty()) rig.files.push_back(file.sources[s].path);
  }
  for (const RigString& plugin : file.plugins) rig.files.push_back(plugin.text);
  loaded.character = std::make_shared<gltf::Character>();
  loaded.character->path = path;
  if (file.character.has_value()) {
    Result<gltf::Character> character = gltf::LoadGltf(file.character->text);
    if (!character.ok()) {
      Status status = character.status();
      if (IsCharacterFile(path)) return status;
      errors.Append(Status::Invalid("the character cannot be read").At(character_at));
      errors.Append(std::move(status));
      return errors.Take();
    }
    if (!IsCharacterFile(path)) rig.files.push_back(file.character->text);
    *loaded.character = std::move(*character);
  }
  rig.character = loaded.character;
  rig.graph = std::make_unique<Graph>(registry_);
  const bool together = given != nullptr || !file.references.empty();  // clips are for the end
  CharacterOptions character_options;
  const bool own_clip = options_.clip.has_value() &&
                        std::any_of(file.clips.begin(), file.clips.end(),
                                    [&](const RigClip& clip) { return clip.name == *options_.clip; });
  if (!own_clip && !together) character_options.clip = options_.clip;
  character_options.rest = options_.rest || own_clip || together;
  character_options.weld = file.weld;
  Result<CharacterGraph> scene = BuildCharacterGraph(*rig.character, character_options, rig.graph.get());
  if (!scene.ok()) return scene.status();
  rig.scene = std::move(*scene);
  rig.clip_characters.assign(rig.character->clips.size(), 0);
  if (!rig.scene.clips.empty()) rig.played.push_back({rig.scene.clips.front().id, 0});

  if (!file.references.empty()) {
    errors.Append(AddReferences(inner_variant, &file, &loaded));
    if (!errors.ok()) return InOrder(errors.Take());  // without them, names are missing
  }
  RestPose rest(*rig.character, rig.scene);
  BuildRig(&file, &rest, &rig, &errors);
  if (!errors.ok()) return InOrder(errors.Take());
  if (given != nullptr) {
    for (RigOverride& override_ : file.returned) {
      override_.plug.source -= static_cast<int>(own_sources);
      given->returned.push_back(std::move(override_));
    }
  } else if (options_.clip.has_value() && (own_clip || together)) {
    KPSA_RETURN_IF_ERROR(SetClip(&rig, *options_.clip));
  } else if (together && !options_.rest) {
    KPSA_RETURN_IF_ERROR(PlayOwnClips(&rig));
  }
  rig.notes.insert(rig.notes.begin(), rig.scene.notes.begin(), rig.scene.notes.end());
  return loaded;
}

Status Loader::AddReferences(const std::optional<std::string>& variant, RigFile* file, LoadedRig* to) {
  open_.push_back({IdentityOf(to->rig.path), to->rig.path, {}});
  Status all;
  std::set<std::string> said;  // what is wrong with a file is said once
  for (const RigReference& reference : file->references) {
    open_.back().where = reference.file.where;
    const Status status = LoadReference(reference, variant, file, to);
    for (const Error& error : status.errors()) {
      if (said.insert(error.ToString()).second) all.Add(error);
    }
  }
  open_.pop_back();
  return all;
}

// No cycle, not too deep, and not too many.
Status Loader::CheckReference(const RigReference& reference) {
  const std::string identity = IdentityOf(reference.file.text);
  const auto first =
      std::find_if(open_.begin(), open_.end(), [&](const Opened& open) { return open.identity == identity; });
  if (first != open_.end()) {
    std::string chain = first->path;
    for (auto open = first + 1; open != open_.end(); ++open)
      chain += fmt::format(" -> {} (at {})", open->path, (open - 1)->where.ToString());
    return Status::Invalid("references form a cycle: {} -> {} (here)", chain, first->path)
        .At(reference.file.where);
  }
  if (open_.size() > kMaxLevels) {
    return Status::Invalid("references are nested more than {} levels deep", kMaxLevels)
        .At(reference.file.where);
  }
  if (++references_ <= kMaxReferences) return Status();
  return Status::Invalid("more than {} rigs are referenced", kMaxReferences).At(reference.file.where);
}

Status Loader::LoadReference(const RigReference& reference, const std::optional<std::string>& variant,
                             RigFile* file, LoadedRig* to) {
  KPSA_RETURN_IF_ERROR(CheckReference(reference));
  const std::string prefix = reference.name + ":";
  const FileUnits& units = file->sources[static_cast<std::size_t>(reference.source)].units;
  ReferencePlace place;
  place.name = reference.name;
  place.file = reference.file.text;
  place.where = reference.where;
  if (reference.clip.has_value()) place.clip = reference.clip->text;
  YamlErrors errors;
  std::vector<double> translate(3, 0.0);
  if (reference.translate.has_value())
    ReadNumbers(*reference.translate, "translate", Unit::kLength, units, 3, &translate, &errors);
  if (reference.start.has_value()) ReadStart(*reference.start, to->rig.fps, units, &place.start, &errors);
  if (!errors.ok()) return errors.Take();
  place.translate = {translate[0], translate[1], translate[2]};

  GivenOverrides given;
  std::vector<RigOverride> kept, asked;
  for (RigOverride& override_ : file->overrides) {
    if (!override_.plug.text.starts_with(prefix)) {
      kept.push_back(std::move(override_));
      continue;
    }
    asked.push_back(override_);
    RigSource source = file->sources[static_cast<std::size_t>(override_.plug.source)];
    source.referenced_as += prefix;
    given.sources.push_back(std::move(source));
    override_.plug.text.erase(0, prefix.size());
    given.overrides.push_back(std::move(override_));
  }
  file->overrides = std::move(kept);

  const bool names_this = variant.has_value() && variant->starts_with(prefix);
  Result<LoadedRig> loaded =
      Load(place.file, names_this ? std::optional(variant->substr(prefix.size())) : std::nullopt, &given);
  if (!loaded.ok()) {
    Status status;
    for (Error error : loaded.status().errors()) {
      // Nothing of the file: the place that asks for it says more
      if (error.where.line == 0 && error.where.file == place.file) {
        error.message = fmt::format("reference: {}: {}", place.file, error.message);
        error.where = reference.file.where;
      }
      status.Add(std::move(error));
    }
    return status;
  }
  for (RigOverride& override_ : given.returned) {
    const RigString& from = asked[static_cast<std::size_t>(override_.plug.source)].plug;
    file->overrides.push_back({{prefix + override_.plug.text, from.where, from.source}, override_.value});
  }
  Status added = AddReference(place, std::move(*loaded), to);
  return std::move(added).At(reference.clip.has_value() ? reference.clip->where : reference.where);
}

}  // namespace

Result<Rig> LoadRig(const NodeRegistry& registry, const std::string& path, const RigOptions& options) {
  if (options.fps.has_value() && !(*options.fps > 0 && std::isfinite(*options.fps))) {
    return Status::Usage("frames a second: expected a number above 0, found {}", *options.fps);
  }
  Result<TrustedFolders> trusted = TrustedFolders::OfRig(path, options.trust, options.trust_word);
  if (!trusted.ok()) return trusted.status();
  Result<LoadedRig> loaded =
      Loader(registry, options, std::move(*trusted)).Load(path, options.variant, nullptr);
  if (!loaded.ok()) return loaded.status();
  loaded->rig.graph->AdoptPoses();
  return std::move(loaded->rig);
}

SourceLocation PlaceOf(const Rig& rig, const Error& error) {
  const auto it = rig.node_places.find(error.node);
  return it != rig.node_places.end() ? it->second : SourceLocation{rig.path, 0, 0};
}

}  // namespace kpsa::engine
