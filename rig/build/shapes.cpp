// Blend shapes of a rig: nodes that take targets of meshes by name, combinations and in-betweens, on the
// rig's own nodes and on the file's; and the weights of the file's skins.
#include <algorithm>

#include "rig/character/mesh_weights.h"
#include "rig/build/rig_build.h"
#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

constexpr const char* kMethods[] = {"multiply", "lowestWeighting", "smooth"};

}  // namespace

// Overrides of such keys of the file's own deformers: `head_mesh_blendShape.combinations`, or by the mesh,
// `head_mesh.combinations`.
bool RigBuild::TakeOwnSpecial(const RigOverride& override_) {
  const std::string& text = override_.plug.text;
  const std::size_t dot = text.rfind('.');
  if (dot == std::string::npos || dot == 0) return false;
  const std::string name = text.substr(0, dot), key = text.substr(dot + 1);
  for (std::size_t m = 0; m < rig_->scene.meshes.size(); ++m) {
    const CharacterMesh& mesh = rig_->scene.meshes[m];
    for (const NodeId id : {mesh.blend_shape, mesh.skin_cluster}) {
      if (key != "combinations" && key != "inbetweens" && key != "blendWeights" && key != "influences")
        continue;
      if (id.version == 0 || !IsRigWord(graph().def(id), key)) continue;
      if (name != graph().name(id) && name != graph().name(mesh.transform)) continue;
      auto made =
          std::find_if(own_made_.begin(), own_made_.end(), [&](const Made& other) { return other.id == id; });
      if (made == own_made_.end()) {
        own_nodes_.push_back({graph().name(id), graph().def(id).name, override_.plug.where, 0, {}, {}});
        Made fresh{&own_nodes_.back(), id};
        fresh.geometries.push_back({mesh.name, m, mesh.mesh().point_count()});
        made = own_made_.insert(own_made_.end(), std::move(fresh));
      }
      if (const auto earlier = made->special.find(key); earlier != made->special.end()) {
        Fail(override_.plug.where,
             Status::Invalid("{}.{} is overridden twice: here and at {}", made->from->name, key,
                             earlier->second->key.where().ToString()));
        return true;
      }
      own_attributes_.push_back(SpecialOf(key, override_));
      made->special[key] = &own_attributes_.back();
      return true;
    }
  }
  return false;
}

// `targets: [smile, open]`: how the weights are written.
void RigBuild::NameTargets(const Made& made) {
  const auto& attributes = made.from->attributes;
  const auto targets = std::find_if(attributes.begin(), attributes.end(),
                                    [](const RigAttribute& a) { return a.name == "targets"; });
  if (targets == attributes.end()) {
    Fail(made.from->where, Status::Invalid("blendShape \"{}\": the key \"targets\" is missing; it names "
                                           "targets of the meshes that are deformed",
                                           made.from->name));
    return;
  }
  std::vector<std::string> names;
  if (!ReadStrings(targets->value, "targets", &names, errors_)) return;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]) !=
        names.begin() + static_cast<std::ptrdiff_t>(i)) {
      errors_->Add(targets->value, "targets: \"{}\" is named twice", names[i]);
      return;
    }
  }
  graph().SetElementNames(made.id, graph().def(made.id).FindAttribute("weight"), std::move(names));
}

void RigBuild::AddShapeRules(Made* made) {
  if (graph().def(made->id).name != "blendShape" || errors_->full()) return;
  if (const auto it = made->special.find("combinations"); it != made->special.end()) {
    const YamlNode& value = it->second->value;
    if (!value.is_map()) {
      errors_->Add(value, "combinations: expected {{TARGET: {{targets: [...], method: multiply}}}}");
    } else {
      for (std::size_t i = 0; i < value.keys.size(); ++i)
        AddCombination(*made, value.keys[i], value.items[i]);
    }
  }
  if (const auto it = made->special.find("inbetweens"); it != made->special.end())
    AddInbetweens(*made, it->second->value);
}

bool RigBuild::FindTarget(const Made& made, const YamlNode& at, const std::string& name, PlugRef* weight) {
  const int attribute = graph().def(made.id).FindAttribute("weight");
  const std::vector<std::string>* known = graph().ElementNames(made.id, attribute);
  const std::vector<std::string> names = known == nullptr ? std::vector<std::string>() : *known;
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) {
    return errors_->Add(at, "\"{}\" has no target \"{}\"{}", made.from->name, name, DidYouMean(name, names));
  }
  if (std::find(it + 1, names.end(), name) != names.end())
    return errors_->Add(at, "\"{}\" is the name of several targets of \"{}\"", name, made.from->name);
  *weight = {made.id, attribute, static_cast<int>(it - names.begin()), -1};
  return true;
}

// A node that drives the weight of a target by those of others, as Maya's combinationShape.
void RigBuild::AddCombination(const Made& made, const YamlNode& key, const YamlNode& body) {
  PlugRef driven;
  bool good = FindTarget(made, key, key.scalar, &driven);
  YamlMap map(body, fmt::format("combination \"{}\"", key.scalar), errors_);
  const YamlNode* targets = map.Required("targets");
  const YamlNode* method_node = map.Find("method");
  map.RejectUnread();
  std::string method = kMethods[0];
  if (method_node != nullptr) {
    if (!ReadString(*method_node, "method", &method, errors_)) return;
    if (std::find(std::begin(kMethods), std::end(kMethods), method) == std::end(kMethods)) {
      errors_->Add(*method_node, "method: expected {}, found \"{}\"", fmt::join(kMethods, ", "), method);
      return;
    }
  }
  if (targets == nullptr) return;
  if (!targets->is_sequence() || targets->items.empty()) {
    errors_->Add(*targets, "targets: expected a list of the targets that act together");
    return;
  }
  std::vector<PlugRef> drivers(targets->items.size());
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    const YamlNode& item = targets->items[i];
    std::string name;
    good = ReadString(item, "targets", &name, errors_) && FindTarget(made, item, name, &drivers[i]) && good;
  }
  if (!good) return;
  GraphEditor edit(&graph());
  const NodeId node =
      edit.AddFresh("combinationShape", fmt::format("{}_{}", graph().name(made.id), key.scalar));
  if (edit.ok()) {
    edit.Set(node, "combinationMethod",
             Value(std::find(std::begin(kMethods), std::end(kMethods), method) - std::begin(kMethods)));
  }
  for (std::size_t i = 0; i < drivers.size(); ++i)
    edit.Connect(drivers[i], edit.Plug(node, "inputWeight", static_cast<int>(i)));
  // A clip that plays the combination gives way, and so do VRM's expressions: it is none of their business
  const Connection* driver = graph().FindConnection(driven);
  const bool clip = IsClipPlug(rig_->scene, graph(), driven) ||
                    (driver != nullptr && graph().def(driver->source.node).name == "vrmMorphWeights");
  const PlugRef weight = edit.Plug(node, "outputWeight");
  if (edit.ok()) edit.Check(graph().Connect(weight, driven, clip));
  Fail(key.where(), edit.Take());
}

// inbetweens: {smile: {0.5: smile_half}}
void RigBuild::AddInbetweens(const Made& made, const YamlNode& value) {
  std::vector<std::int64_t> targets, shapes;
  std::vector<double> weights;
  if (!value.is_map()) {
    errors_->Add(value, "inbetweens: expected {{TARGET: {{0.5: OTHER_TARGET}}}}");
    return;
  }
  bool good = true;
  for (std::size_t i = 0; i < value.keys.size(); ++i) {
    const YamlNode &key = value.keys[i], &stops = value.items[i];
    PlugRef target;
    good = FindTarget(made, key, key.scalar, &target) && good;
    if (!stops.is_map()) {
      good = errors_->Add(stops, "inbetweens: expected {{0.5: TARGET}} for \"{}\"", key.scalar);
      continue;
    }
    for (std::size_t k = 0; k < stops.keys.size(); ++k) {
      double weight = 0;
      std::string name;
      PlugRef through;
      if (!ReadNumber(stops.keys[k], "weight of an in-between", Unit::kNone, FileUnits(), &weight, errors_) ||
          !ReadString(stops.items[k], "in-between", &name, errors_) ||
          !FindTarget(made, stops.items[k], name, &through)) {
        good = false;
        continue;
      }
      if (!(weight > 0 && weight < 1)) {
        good = errors_->Add(stops.keys[k],
                            "an in-between of \"{}\" at {}: expected a weight of more than 0 and less than 1",
                            key.scalar, stops.keys[k].scalar);
      } else if (through == target) {
        good = errors_->Add(stops.items[k], "\"{}\" cannot be its own in-between", name);
      } else if (good) {
        for (std::size_t other = 0; other < targets.size(); ++other) {
          if (targets[other] == target.element && weights[other] == weight)
            good = errors_->Add(stops.keys[k], "\"{}\" has two in-betweens at {}", key.scalar, weight);
        }
        targets.push_back(target.element);
        shapes.push_back(through.element);
        weights.push_back(weight);
      }
    }
  }
  if (!good) return;
  GraphEditor edit(&graph());
  edit.Set(made.id, "inbetweenTarget", Value(std::move(targets)));
  edit.Set(made.id, "inbetweenShape", Value(std::move(shapes)));
  edit.Set(made.id, "inbetweenWeight", Value(std::move(weights)));
  Fail(value.where(), edit.Take());
}

// The targets of each mesh that a blend shape of the rig deforms; one that a mesh lacks moves none of its
// points.
void RigBuild::SetTargets(Made* made) {
  const auto it = made->special.find("targets");
  if (graph().def(made->id).name != "blendShape" || it == made->special.end() || made->geometries.empty())
    return;
  const YamlNode& value = it->second->value;
  std::vector<const YamlNode*> names;
  if (value.is_scalar()) names.push_back(&value);
  for (const YamlNode& item : value.items) names.push_back(&item);
  std::vector<std::vector<MorphTargets::Target>> targets(made->geometries.size());
  std::vector<std::string> known;
  for (const Geometry& of : made->geometries) {
    if (!of.mesh.has_value()) {
      errors_->Add(value, "targets: {} is no mesh", of.name);
      return;
    }
    const MorphTargets* from = rig_->scene.meshes[*of.mesh].geometry.targets.get();
    for (std::size_t k = 0; from != nullptr && k < from->targets().size(); ++k)
      known.push_back(from->targets()[k].name);
  }
  bool good = true;
  for (const YamlNode* name : names) {
    bool found = false;
    for (std::size_t g = 0; g < targets.size(); ++g) {
      const MorphTargets* from = rig_->scene.meshes[*made->geometries[g].mesh].geometry.targets.get();
      targets[g].push_back({name->scalar, {}, {}});
      for (std::size_t k = 0; from != nullptr && k < from->targets().size(); ++k) {
        if (from->targets()[k].name != name->scalar) continue;
        targets[g].back() = from->targets()[k];
        found = true;
        break;
      }
    }
    if (!found)
      good = errors_->Add(*name, "targets: \"{}\" is no target of {}{}", name->scalar,
                          made->geometries.front().name, DidYouMean(name->scalar, known));
  }
  if (!good) return;
  GraphEditor edit(&graph());
  for (std::size_t g = 0; g < targets.size(); ++g) {
    const auto points = static_cast<Index>(made->geometries[g].count);
    edit.Set(made->id, "targets", static_cast<int>(g),
             std::make_shared<const MorphTargets>(std::move(targets[g]), points));
  }
  Fail(made->from->where, edit.Take());
}

// `head_mesh_skinCluster.blendWeights: "w.json#dq"`.
void RigBuild::SetBlendWeights(Made* made) {
  const auto it = made->special.find("blendWeights");
  if (it == made->special.end() || errors_->full()) return;
  std::vector<std::vector<float>> weights{std::vector<float>(made->geometries.front().count, 1.0f)};
  if (!MultiplyByMaps(*it->second, *made, &weights)) return;
  GraphEditor edit(&graph());
  edit.Set(made->id, "blendWeights", 0, std::make_shared<const WeightMap>(std::move(weights[0])));
  Fail(it->second->value.where(), edit.Take());
}

// `head_mesh_skinCluster.influences: "w/skin.json"`: before anything looks at who moves what.
void RigBuild::SetInfluences(Made* made) {
  const auto it = made->special.find("influences");
  if (it == made->special.end() || errors_->full()) return;
  const YamlNode& value = it->second->value;
  std::string text;
  if (!ReadString(value, "influences", &text, errors_)) return;
  const WeightFile* file = FindWeightFile(value, ResolvePath(folder(it->second->source), text));
  const Geometry* of = nullptr;
  if (file == nullptr || !FindGeometry(value, *made, *file, file->path, &of)) return;
  CharacterMesh& mesh = rig_->scene.meshes[*of->mesh];
  Result<std::shared_ptr<const Influences>> influences = InfluencesFrom(*file, mesh, graph());
  if (!errors_->Add(value, influences.status())) return;
  NoteWeights(*made, *it->second, of->name, file->path);
  mesh.influences = std::move(*influences);
  GraphEditor edit(&graph());
  edit.Set(made->id, "influences", 0, mesh.influences);
  Fail(value.where(), edit.Take());
}

}  // namespace kpsa::engine
