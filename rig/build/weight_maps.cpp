#include "rig/build/weight_maps.h"

#include <algorithm>
#include <limits>

#include "rig/character/mesh_weights.h"

namespace kpsa::engine {

const WeightFile* WeightMaps::FindFile(const YamlNode& reference, const std::string& path) {
  const auto [it, added] = files_.try_emplace(path);
  if (added) {
    Result<WeightFile> file = ReadWeightFile(path);
    if (file.ok()) {
      it->second = std::move(*file);
      rig_->files.push_back(path);
    } else {
      in_.errors->Add(reference, "the weight file cannot be read");
      in_.errors->Append(file.status());
    }
  }
  return it->second.has_value() ? &*it->second : nullptr;
}

bool WeightMaps::FindMap(const YamlNode& reference, const std::string& key, int source, const MadeNode& made,
                         const WeightFile** file, const NamedWeights** map, const DeformedGeometry** of) {
  std::string text;
  if (!ReadString(reference, key, &text, in_.errors)) return false;
  const WeightReference parts = SplitWeightReference(text);
  if (parts.path.empty())
    return in_.errors->Add(reference, "weights \"{}\": expected the file before the #, FILE.json#MAP", text);
  const auto resolved = ResolvePath(in_.file, source, parts.path, reference, in_.errors);
  if (!resolved.has_value()) return false;
  const std::string& path = *resolved;
  *file = FindFile(reference, path);
  if (*file == nullptr) return false;
  const Result<const NamedWeights*> found = FindWeights(**file, path, parts.map);
  if (!in_.Fail(reference.where(), found.status())) return false;
  *map = *found;
  if (!FindGeometry(reference, made, **file, path, of)) return false;
  const auto outside = FirstOutOfRange(**file, **map);
  return !outside.has_value() ||
         in_.errors->Add(reference, "{}: {} is outside of 0 to 1: vertex {} of map \"{}\" in {}", key,
                         outside->second, outside->first, (*map)->name, path);
}

bool WeightMaps::FindGeometry(const YamlNode& reference, const MadeNode& made, const WeightFile& file,
                              const std::string& path, const DeformedGeometry** of) const {
  *of = GeometryOf(made, file);
  if (*of == nullptr) {
    std::vector<std::string> names;
    for (const DeformedGeometry& geometry : made.geometries) names.push_back(geometry.name);
    return in_.errors->Add(reference, "{} is for mesh \"{}\"; \"{}\" deforms {}", path, file.mesh,
                           made.from->name, fmt::join(names, ", "));
  }
  if (file.points != VertexCount(in_.rig.scene, **of)) {
    return in_.errors->Add(reference, "{} is for {} vertices; {} has {}", path, file.points, (*of)->name,
                           VertexCount(in_.rig.scene, **of));
  }
  return true;
}

const DeformedGeometry* WeightMaps::GeometryOf(const MadeNode& made, const WeightFile& file) const {
  for (const DeformedGeometry& geometry : made.geometries) {
    if (geometry.name == file.mesh) return &geometry;
    if (!geometry.mesh.has_value()) continue;
    if (NamesMesh(file, *in_.rig.character, in_.graph(), in_.rig.scene.meshes[*geometry.mesh]))
      return &geometry;
  }
  return nullptr;
}

std::vector<float> WeightMaps::ByPoint(const WeightFile& file, const NamedWeights& map,
                                       const DeformedGeometry& of) const {
  const std::vector<float> dense = DenseWeights(file, map);
  std::vector<float> by_point(of.count, -std::numeric_limits<float>::infinity());
  for (Index v = 0; v < dense.size(); ++v) {
    float& weight = by_point[PointOf(in_.rig.scene, of, v)];
    weight = std::max(weight, dense[v]);
  }
  return by_point;
}

bool WeightMaps::MultiplyByMaps(const RigAttribute& attribute, const MadeNode& made,
                                std::vector<std::vector<float>>* weights) {
  std::vector<const YamlNode*> references;
  if (attribute.value.is_sequence()) {
    for (const YamlNode& item : attribute.value.items) references.push_back(&item);
  } else {
    references.push_back(&attribute.value);
  }
  bool good = true;
  for (const YamlNode* reference : references) {
    const WeightFile* file = nullptr;
    const NamedWeights* map = nullptr;
    const DeformedGeometry* of = nullptr;
    if (!FindMap(*reference, attribute.name, attribute.source, made, &file, &map, &of)) {
      good = false;
      continue;
    }
    Note(made, attribute, of->name, file->path, map->name);
    const std::vector<float> by_point = ByPoint(*file, *map, *of);
    std::vector<float>& product = (*weights)[static_cast<std::size_t>(of - made.geometries.data())];
    for (std::size_t p = 0; p < product.size(); ++p) product[p] *= by_point[p];
  }
  return good;
}

void WeightMaps::Note(const MadeNode& made, const RigAttribute& key, const std::string& geometry,
                      const std::string& path, const std::string& map) {
  WeightSource note{made.id, key.name, key.key.where(), geometry, path, map};
  if (std::find(rig_->weights.begin(), rig_->weights.end(), note) == rig_->weights.end())
    rig_->weights.push_back(std::move(note));
}

}  // namespace kpsa::engine
