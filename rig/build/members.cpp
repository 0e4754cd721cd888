// Members and weight maps of deformers: one float a point, their product.
#include <algorithm>
#include <charconv>
#include <limits>

#include "rig/character/mesh_weights.h"
#include "rig/build/rig_build.h"

namespace kpsa::engine {
namespace {

bool ParseVertex(std::string_view text, std::uint64_t* vertex) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *vertex);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

}  // namespace

Index RigBuild::VertexCount(const Geometry& of) const {
  return of.mesh.has_value() ? rig_->scene.meshes[*of.mesh].vertex_count : static_cast<Index>(of.count);
}
Index RigBuild::PointOf(const Geometry& of, Index vertex) const {
  return of.mesh.has_value() ? rig_->scene.meshes[*of.mesh].mesh().data().vertex_to_point[vertex] : vertex;
}

// Sets weights[g] of the geometries that were added since the last call. Nothing is set where the rig says
// nothing.
void RigBuild::SetWeights(Made* made) {
  if (made->weighted == made->geometries.size()) return;
  const std::size_t first = made->weighted;
  made->weighted = made->geometries.size();
  const auto find = [&](const char* key) {
    return made->special.count(key) != 0 ? made->special[key] : nullptr;
  };
  const RigAttribute* members = find("members");
  const RigAttribute* maps = find("weights");
  const RigAttribute* falloff = find("falloff");
  if (falloff != nullptr && falloff->value.is_scalar()) falloff = nullptr;  // a node: ConnectFalloffs
  if (members == nullptr && maps == nullptr && falloff == nullptr) return;
  for (const RigAttribute* key : {members, falloff}) {
    if (key != nullptr) NoteWeights(*made, *key, "");
  }

  std::vector<std::vector<float>> weights;
  for (const Geometry& of : made->geometries)
    weights.emplace_back(of.count, members == nullptr ? 1.0f : 0.0f);
  bool good = true;
  for (std::size_t g = first; g < weights.size() && members != nullptr; ++g) {
    const Geometry& of = made->geometries[g];
    good = AddMembers(members->value, members->source, *made, of, &weights[g]) && good;
    if (good && std::all_of(weights[g].begin(), weights[g].end(), [](float w) { return w == 0; })) {
      rig_->notes.push_back(fmt::format("{}: the members of \"{}\" are no point of {}",
                                        members->value.where().ToString(), made->from->name, of.name));
    }
  }
  if (maps != nullptr) good = MultiplyByMaps(*maps, *made, &weights) && good;
  for (std::size_t g = first; g < weights.size() && falloff != nullptr; ++g) {
    good = MultiplyByFalloff(*falloff, *made, made->geometries[g], &weights[g]) && good;
  }
  if (!good) return;
  GraphEditor edit(&graph());
  for (std::size_t g = first; g < weights.size(); ++g) {
    edit.Set(made->id, "weights", static_cast<int>(g),
             std::make_shared<const WeightMap>(std::move(weights[g])));
  }
  Fail(made->from->where, edit.Take());
}

// For those that look for the map of a deformer; a deformer with several geometries comes here several times.
void RigBuild::NoteWeights(const Made& made, const RigAttribute& key, const std::string& geometry,
                           const std::string& path, const std::string& map) {
  WeightSource note{made.id, key.name, key.key.where(), geometry, path, map};
  if (std::find(rig_->weights.begin(), rig_->weights.end(), note) == rig_->weights.end())
    rig_->weights.push_back(std::move(note));
}

// "0:99,120" (both ends included), a number, or a list of numbers.
bool RigBuild::ReadVertices(const YamlNode& node, std::size_t count, const std::string& of,
                            std::vector<Index>* vertices) {
  const auto refuse = [&](const YamlNode& at, std::string_view text) {
    return errors_->Add(
        at, "vertices: \"{}\" is none of {}: expected numbers and ranges from 0 to {}, as in \"0:99,120\"",
        text, of, count == 0 ? 0 : count - 1);
  };
  const auto read = [&](const YamlNode& item) {
    std::string_view left = item.scalar;
    while (true) {
      const std::size_t comma = left.find(',');
      const std::string_view part = left.substr(0, comma);
      const std::size_t colon = part.find(':');
      std::uint64_t begin = 0, end = 0;
      bool good = ParseVertex(part.substr(0, colon), &begin);
      end = begin;
      if (colon != std::string_view::npos) good = ParseVertex(part.substr(colon + 1), &end) && good;
      if (!good || begin > end || end >= count) return refuse(item, part);
      if (vertices->size() + (end - begin) > 4 * count + 1024)
        return errors_->Add(item, "vertices: the ranges overlap too often");
      for (std::uint64_t v = begin; v <= end; ++v) vertices->push_back(static_cast<Index>(v));
      if (comma == std::string_view::npos) return true;
      left = left.substr(comma + 1);
    }
  };
  vertices->clear();
  if (node.is_scalar()) return read(node);
  if (!node.is_sequence())
    return errors_->Add(node, "vertices: expected numbers, found {}", node.kind_name());
  for (const YamlNode& item : node.items) {
    if (!item.is_scalar())
      return errors_->Add(item, "vertices: expected a number, found {}", item.kind_name());
    if (!read(item)) return false;
  }
  return true;
}

// Whether another mesh of the deformer has what this one lacks: then this one has no such members, and nobody
// erred.
bool RigBuild::AnyOther(const Made& made, const Geometry& of,
                        const std::function<bool(const CharacterMesh&)>& has) const {
  return std::any_of(made.geometries.begin(), made.geometries.end(), [&](const Geometry& other) {
    return &other != &of && other.mesh.has_value() && has(rig_->scene.meshes[*other.mesh]);
  });
}

// Raises the weights of the members to 1.
bool RigBuild::AddMembers(const YamlNode& node, int source, const Made& made, const Geometry& of,
                          std::vector<float>* weights) {
  if (node.is_scalar() && node.scalar == "all") {
    std::fill(weights->begin(), weights->end(), 1.0f);
    return true;
  }
  if (node.is_sequence()) {
    bool good = true;
    for (const YamlNode& item : node.items) good = AddMembers(item, source, made, of, weights) && good;
    return good;
  }
  if (!node.is_map() || node.keys.empty()) {
    return errors_->Add(node,
                        "members: expected all, {{vertices: \"0:99\"}}, {{primitive: 1}}, {{material: "
                        "NAME}}, {{joint: NAME, above: 0}}, "
                        "{{weights: \"file.json#map\"}} or a list of them");
  }
  YamlMap map(node, "members", errors_);
  const YamlNode* vertices = map.Find("vertices");
  const YamlNode* primitive = map.Find("primitive");
  const YamlNode* material = map.Find("material");
  const YamlNode* joint = map.Find("joint");
  const YamlNode* above = map.Find("above");
  const YamlNode* file_map = map.Find("weights");
  map.RejectUnread();
  if ((vertices != nullptr) + (primitive != nullptr) + (material != nullptr) + (joint != nullptr) +
              (file_map != nullptr) !=
          1 ||
      (above != nullptr && joint == nullptr)) {
    return errors_->Add(
        node, "members: expected one of vertices, primitive, material, joint (with above) or weights");
  }
  if (vertices != nullptr) {
    std::vector<Index> list;
    if (!ReadVertices(*vertices, VertexCount(of), of.name, &list)) return false;
    for (Index v : list) (*weights)[PointOf(of, v)] = 1;
    return true;
  }
  if (file_map != nullptr) {
    const WeightFile* file = nullptr;
    const NamedWeights* values = nullptr;
    const Geometry* owner = nullptr;
    if (!FindMap(*file_map, "weights", source, made, &file, &values, &owner)) return false;
    if (owner->name != of.name) return true;
    const std::vector<float> dense = DenseWeights(*file, *values);
    for (Index v = 0; v < dense.size(); ++v) {
      if (dense[v] > 0) (*weights)[PointOf(of, v)] = 1;
    }
    return true;
  }
  if (!of.mesh.has_value())
    return errors_->Add(node, "members: {} is no mesh: only vertices and weights name its points", of.name);
  const CharacterMesh& mesh = rig_->scene.meshes[*of.mesh];
  const auto& primitives = mesh.mesh().data().primitives;
  if (joint != nullptr) {
    std::string name;
    double threshold = 0;
    if (!ReadString(*joint, "joint", &name, errors_)) return false;
    if (above != nullptr && !ReadNumber(*above, "above", Unit::kNone, FileUnits(), &threshold, errors_))
      return false;
    const std::optional<NodeId> node_id = FindTransform(name, joint->where());
    if (!node_id.has_value()) return false;
    const auto it = std::find(mesh.influence_nodes.begin(), mesh.influence_nodes.end(), *node_id);
    const auto is_joint = [&](const CharacterMesh& other) {
      return std::find(other.influence_nodes.begin(), other.influence_nodes.end(), *node_id) !=
             other.influence_nodes.end();
    };
    if (it == mesh.influence_nodes.end() && AnyOther(made, of, is_joint)) return true;
    if (it == mesh.influence_nodes.end())
      return errors_->Add(*joint, "\"{}\" is no joint of the skin of {}", name, of.name);
    const auto j = static_cast<Index>(it - mesh.influence_nodes.begin());
    for (std::size_t p = 0; p < weights->size(); ++p) {
      for (Index i = mesh.influences->offsets()[p]; i < mesh.influences->offsets()[p + 1]; ++i) {
        if (mesh.influences->joints()[i] == j && mesh.influences->weights()[i] > threshold) (*weights)[p] = 1;
      }
    }
    return true;
  }
  std::int64_t number = 0;
  std::string name;
  std::int64_t most = static_cast<std::int64_t>(primitives.size());
  AnyOther(made, of, [&](const CharacterMesh& other) {
    most = std::max(most, static_cast<std::int64_t>(other.mesh().data().primitives.size()));
    return false;
  });
  if (primitive != nullptr && !ReadInteger(*primitive, "primitive", 0, most - 1, &number, errors_))
    return false;
  if (material != nullptr && !ReadString(*material, "material", &name, errors_)) return false;
  bool found = false;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    names.push_back(primitives[i].material);
    if (primitive != nullptr ? static_cast<std::int64_t>(i) != number : primitives[i].material != name)
      continue;
    found = true;
    for (Index v = 0; v < primitives[i].vertex_count; ++v)
      (*weights)[PointOf(of, primitives[i].first_vertex + v)] = 1;
  }
  const auto has_material = [&](const CharacterMesh& other) {
    const auto& theirs = other.mesh().data().primitives;
    return std::any_of(theirs.begin(), theirs.end(), [&](const auto& p) { return p.material == name; });
  };
  if (found || primitive != nullptr || AnyOther(made, of, has_material)) return true;
  return errors_->Add(*material, "{} has no material \"{}\"{}", of.name, name, DidYouMean(name, names));
}

const WeightFile* RigBuild::FindWeightFile(const YamlNode& reference, const std::string& path) {
  const auto [it, added] = weight_files_.try_emplace(path);
  if (added) {
    Result<WeightFile> file = ReadWeightFile(path);
    if (file.ok()) {
      it->second = std::move(*file);
      rig_->files.push_back(path);
    } else {
      errors_->Add(reference, "the weight file cannot be read");
      errors_->Append(file.status());
    }
  }
  return it->second.has_value() ? &*it->second : nullptr;
}

// "w/lips.json#upper": the file, its map, and the geometry of the deformer that it is for.
bool RigBuild::FindMap(const YamlNode& reference, const std::string& key, int source, const Made& made,
                       const WeightFile** file, const NamedWeights** map, const Geometry** of) {
  std::string text;
  if (!ReadString(reference, key, &text, errors_)) return false;
  const WeightReference parts = SplitWeightReference(text);
  if (parts.path.empty())
    return errors_->Add(reference, "weights \"{}\": expected the file before the #, FILE.json#MAP", text);
  const std::string path = ResolvePath(folder(source), parts.path);
  *file = FindWeightFile(reference, path);
  if (*file == nullptr) return false;
  const Result<const NamedWeights*> found = FindWeights(**file, path, parts.map);
  if (!Fail(reference.where(), found.status())) return false;
  *map = *found;
  if (!FindGeometry(reference, made, **file, path, of)) return false;
  const auto outside = FirstOutOfRange(**file, **map);
  return !outside.has_value() ||
         errors_->Add(reference, "{}: {} is outside of 0 to 1: vertex {} of map \"{}\" in {}", key,
                      outside->second, outside->first, (*map)->name, path);
}

// The geometry of the deformer that a weight file is for.
bool RigBuild::FindGeometry(const YamlNode& reference, const Made& made, const WeightFile& file,
                            const std::string& path, const Geometry** of) {
  *of = GeometryOf(made, file);
  if (*of == nullptr) {
    std::vector<std::string> names;
    for (const Geometry& geometry : made.geometries) names.push_back(geometry.name);
    return errors_->Add(reference, "{} is for mesh \"{}\"; \"{}\" deforms {}", path, file.mesh,
                        made.from->name, fmt::join(names, ", "));
  }
  if (file.points != VertexCount(**of)) {
    return errors_->Add(reference, "{} is for {} vertices; {} has {}", path, file.points, (*of)->name,
                        VertexCount(**of));
  }
  return true;
}

const RigBuild::Geometry* RigBuild::GeometryOf(const Made& made, const WeightFile& file) const {
  for (const Geometry& geometry : made.geometries) {
    if (geometry.name == file.mesh) return &geometry;
    if (!geometry.mesh.has_value()) continue;
    if (NamesMesh(file, *rig_->character, graph(), rig_->scene.meshes[*geometry.mesh])) return &geometry;
  }
  return nullptr;
}

// A welded point takes its vertices' largest.
std::vector<float> RigBuild::ByPoint(const WeightFile& file, const NamedWeights& map,
                                     const Geometry& of) const {
  const std::vector<float> dense = DenseWeights(file, map);
  std::vector<float> by_point(of.count, -std::numeric_limits<float>::infinity());
  for (Index v = 0; v < dense.size(); ++v) {
    float& weight = by_point[PointOf(of, v)];
    weight = std::max(weight, dense[v]);
  }
  return by_point;
}

// One reference or several; each is for the geometry that its file names.
bool RigBuild::MultiplyByMaps(const RigAttribute& attribute, const Made& made,
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
    const Geometry* of = nullptr;
    if (!FindMap(*reference, attribute.name, attribute.source, made, &file, &map, &of)) {
      good = false;
      continue;
    }
    NoteWeights(made, attribute, of->name, file->path, map->name);
    const std::vector<float> by_point = ByPoint(*file, *map, *of);
    std::vector<float>& product = (*weights)[static_cast<std::size_t>(of - made.geometries.data())];
    for (std::size_t p = 0; p < product.size(); ++p) product[p] *= by_point[p];
  }
  return good;
}

}  // namespace kpsa::engine
