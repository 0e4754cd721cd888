#include "rig/build/target_shapes.h"

#include <algorithm>

namespace kpsa::engine {
namespace {

// The shapes of a file that an entry means: of one mesh, by name.
struct ShapeChoice {
  const YamlNode* from = nullptr;    // a mesh of a glTF file
  const YamlNode* shapes = nullptr;  // names
  std::string mesh;
  std::vector<std::string> names;

  bool Read(YamlMap* map, YamlErrors* errors) {
    from = map->Find("from");
    shapes = map->Find("shapes");
    return (from == nullptr || ReadString(*from, "from", &mesh, errors)) &&
           (shapes == nullptr || ReadStrings(*shapes, "shapes", &names, errors));
  }
};

std::vector<std::string> Distinct(const std::vector<const FileShape*>& shapes, std::string FileShape::*part) {
  std::vector<std::string> values;
  for (const FileShape* shape : shapes) {
    if (std::find(values.begin(), values.end(), shape->*part) == values.end()) values.push_back(shape->*part);
  }
  return values;
}

bool Choose(const ShapeFile& file, const YamlNode& entry, const ShapeChoice& choice, YamlErrors* errors,
            std::vector<const FileShape*>* chosen) {
  std::vector<const FileShape*> all;
  for (const FileShape& shape : file.shapes) all.push_back(&shape);
  const std::vector<std::string> meshes = Distinct(all, &FileShape::mesh);
  if (choice.from != nullptr) {
    std::erase_if(all, [&](const FileShape* shape) { return shape->mesh != choice.mesh; });
    if (meshes.front().empty()) return errors->Add(*choice.from, "from: {} is no glTF file", file.path);
    if (all.empty()) {
      return errors->Add(*choice.from, "from: \"{}\" is no mesh of {}{}; it has {}", choice.mesh, file.path,
                         DidYouMean(choice.mesh, meshes), fmt::join(meshes, ", "));
    }
  }
  const std::string several = fmt::format("say which one, from: {}", fmt::join(meshes, " or from: "));
  if (choice.shapes == nullptr) {
    if (choice.from == nullptr && meshes.size() > 1)
      return errors->Add(entry, "targets: {} has several meshes: {}", file.path, several);
    *chosen = all;
    return true;
  }
  for (const std::string& name : choice.names) {
    const auto is = [&](const FileShape* shape) { return shape->name == name; };
    const auto found = std::find_if(all.begin(), all.end(), is);
    if (found == all.end()) {
      const std::vector<std::string> names = Distinct(all, &FileShape::name);
      return errors->Add(*choice.shapes, "shapes: \"{}\" is no shape of {}{}; it has {}", name, file.path,
                         DidYouMean(name, names), fmt::join(names, ", "));
    }
    if (const auto second = std::find_if(found + 1, all.end(), is); second != all.end()) {
      return errors->Add(*choice.shapes, "shapes: \"{}\" is the name of several shapes of {}{}", name,
                         file.path, (*second)->mesh == (*found)->mesh ? "" : ": " + several);
    }
    chosen->push_back(*found);
  }
  return true;
}

// `as: positions` or `as: displacements`, where the file does not say.
bool ReadMeaning(const YamlNode* as, const ShapeFile& file, const FileShape& shape, YamlErrors* errors,
                 bool* displacements) {
  *displacements = shape.displacements.value_or(false);
  if (as == nullptr) return true;
  std::string word;
  if (!ReadString(*as, "as", &word, errors)) return false;
  if (word != "positions" && word != "displacements")
    return errors->Add(*as, "as: expected positions or displacements, found \"{}\"{}", word,
                       DidYouMean(word, {"positions", "displacements"}));
  const bool wanted = word == "displacements";
  if (shape.displacements.value_or(wanted) != wanted) {
    return errors->Add(*as, "as: shape \"{}\" of {} has {}", shape.name, file.path,
                       *shape.displacements ? "displacements" : "positions");
  }
  *displacements = wanted;
  return true;
}

}  // namespace

const std::vector<NamedTarget>* TargetShapes::Find(NodeId node) const {
  const auto it = targets_.find(node.index);
  return it == targets_.end() ? nullptr : &it->second;
}

bool TargetShapes::Read(NodeId node, const RigAttribute& targets) {
  const YamlNode& value = targets.value;
  std::vector<NamedTarget> read;
  bool good = true;
  if (value.is_sequence()) {
    for (const YamlNode& entry : value.items) good = ReadEntry(entry, targets.source, &read) && good;
  } else {
    good = ReadEntry(value, targets.source, &read);
  }
  if (good && read.size() > kMaxMorphTargets)
    good = in_.errors->Add(value, "targets: there are {}; at most {} are supported", read.size(),
                           kMaxMorphTargets);
  if (good) targets_[node.index] = std::move(read);
  return good;
}

bool TargetShapes::ReadEntry(const YamlNode& entry, int source, std::vector<NamedTarget>* targets) {
  if (entry.is_map()) return ReadFileEntry(entry, source, targets);
  if (!entry.is_scalar()) {
    return in_.errors->Add(entry, "targets: expected names of targets, or {{file: FILE}}, found {}",
                           entry.kind_name());
  }
  return Add(entry.scalar, {&entry, nullptr, nullptr}, targets);
}

bool TargetShapes::ReadFileEntry(const YamlNode& entry, int source, std::vector<NamedTarget>* targets) {
  YamlMap map(entry, "targets", in_.errors);
  const std::size_t before = in_.errors->count();
  const YamlNode *file_node = map.Required("file"), *as = map.Find("as"), *unit = map.Find("unit"),
                 *mesh = map.Find("mesh"), *name = map.Find("name");
  ShapeChoice choice;
  choice.Read(&map, in_.errors);
  map.RejectUnread();
  TargetSource from{&entry, nullptr, nullptr};
  std::string path, text;
  if (file_node != nullptr) ReadString(*file_node, "file", &path, in_.errors);
  if (mesh != nullptr && ReadString(*mesh, "mesh", &text, in_.errors)) from.mesh = text;
  if (unit != nullptr && ReadString(*unit, "unit", &text, in_.errors)) {
    FileUnits units;
    if (in_.errors->Add(*unit, units.SetLength(text))) from.metres = units.length;
  }
  std::string renamed;
  if (name != nullptr) ReadString(*name, "name", &renamed, in_.errors);
  if (in_.errors->count() != before) return false;

  const auto resolved = ResolvePath(in_.file, source, path, *file_node, in_.errors);
  if (!resolved.has_value()) return false;
  from.file = FindFile(*file_node, *resolved);
  std::vector<const FileShape*> chosen;
  if (from.file == nullptr || !Choose(*from.file, entry, choice, in_.errors, &chosen)) return false;
  if (name != nullptr && chosen.size() != 1) {
    return in_.errors->Add(*name, "name: expected it of one shape, and {} has {}", from.file->path,
                           chosen.size());
  }
  for (const FileShape* shape : chosen) {
    from.shape = shape;
    if (!ReadMeaning(as, *from.file, *shape, in_.errors, &from.displacements) ||
        !Add(name == nullptr ? shape->name : renamed, from, targets))
      return false;
  }
  return true;
}

// Shapes of one name are one target, where they are for different meshes.
bool TargetShapes::Add(const std::string& name, const TargetSource& source,
                       std::vector<NamedTarget>* targets) {
  const auto same =
      std::find_if(targets->begin(), targets->end(), [&](const NamedTarget& t) { return t.name == name; });
  if (same == targets->end()) {
    targets->push_back({name, {source}});
    return true;
  }
  for (const TargetSource& other : same->sources) {
    if (other.mesh.has_value() && source.mesh.has_value() && *other.mesh != *source.mesh) continue;
    return in_.errors->Add(*source.at, "targets: \"{}\" is named twice: here and at {}", name,
                           other.at->where().ToString());
  }
  same->sources.push_back(source);
  return true;
}

const ShapeFile* TargetShapes::FindFile(const YamlNode& reference, const std::string& path) {
  const auto [it, added] = files_.try_emplace(path);
  if (added) {
    Result<ShapeFile> file = ReadShapeFile(path);
    if (file.ok()) {
      it->second = std::move(*file);
      rig_->files.push_back(path);
    } else {
      in_.errors->Add(reference, "the file of shapes cannot be read");
      in_.errors->Append(file.status());
    }
  }
  return it->second.has_value() ? &*it->second : nullptr;
}

}  // namespace kpsa::engine
