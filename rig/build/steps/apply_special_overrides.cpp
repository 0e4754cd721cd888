#include "rig/build/steps/apply_special_overrides.h"

#include <algorithm>

#include "base/text.h"
#include "rig/file/words.h"

namespace kpsa::engine {
namespace {

// What the file that references this one calls ours, as we call it.
void InOwnNames(const BuildInput& in, YamlNode* value, int source) {
  const std::string& prefix = in.file.sources[static_cast<std::size_t>(source)].referenced_as;
  if (prefix.empty()) return;
  if (value->is_scalar() && value->scalar.starts_with(prefix)) value->scalar.erase(0, prefix.size());
  for (YamlNode& item : value->items) InOwnNames(in, &item, source);
}

RigAttribute SpecialOf(const BuildInput& in, const std::string& key, const RigOverride& override_) {
  YamlNode key_node;
  key_node.kind = YamlNode::Kind::kScalar;
  key_node.scalar = key;
  key_node.file = override_.value.file;
  key_node.line = override_.plug.where.line;
  key_node.column = override_.plug.where.column;
  RigAttribute special{key, key_node, override_.value, override_.plug.source};
  InOwnNames(in, &special.value, special.source);
  return special;
}

// Overrides of such keys of the file's own deformers: `head_mesh_blendShape.combinations`, or by the mesh,
// `head_mesh.combinations`.
bool TakeOwnSpecial(const BuildInput& in, const RigOverride& override_, OwnDeformers* own) {
  const std::string& text = override_.plug.text;
  const std::size_t dot = text.rfind('.');
  if (dot == std::string::npos || dot == 0) return false;
  const std::string name = text.substr(0, dot), key = text.substr(dot + 1);
  for (std::size_t m = 0; m < in.rig.scene.meshes.size(); ++m) {
    const CharacterMesh& mesh = in.rig.scene.meshes[m];
    for (const NodeId id : {mesh.blend_shape, mesh.skin_cluster}) {
      if (key != "combinations" && key != "inbetweens" && key != "blendWeights" && key != "influences")
        continue;
      if (id.version == 0 || !IsRigWord(in.graph().def(id), key)) continue;
      if (name != in.graph().name(id) && name != in.graph().name(mesh.transform)) continue;
      auto made = std::find_if(own->made.begin(), own->made.end(),
                               [&](const MadeNode& other) { return other.id == id; });
      if (made == own->made.end()) {
        own->nodes.push_back({in.graph().name(id), in.graph().def(id).name, override_.plug.where, 0, {}, {}});
        MadeNode fresh{&own->nodes.back(), id};
        fresh.geometries.push_back({mesh.name, m, mesh.mesh().point_count()});
        made = own->made.insert(own->made.end(), std::move(fresh));
      }
      if (const auto earlier = made->special.find(key); earlier != made->special.end()) {
        in.Fail(override_.plug.where,
                Status::Invalid("{}.{} is overridden twice: here and at {}", made->from->name, key,
                                earlier->second->key.where().ToString()));
        return true;
      }
      own->attributes.push_back(SpecialOf(in, key, override_));
      made->special[key] = &own->attributes.back();
      return true;
    }
  }
  return false;
}

}  // namespace

void ApplySpecialOverrides(const BuildInput& in, RigFile* file, OwnDeformers* own) {
  std::vector<RigOverride> others;
  for (RigOverride& override_ : file->overrides) {
    const std::string& text = override_.plug.text;
    const std::size_t dot = LongestBefore(
        '.', text, [&](std::string_view name) { return in.names.IsWritten(std::string(name)); });
    RigNode* const longest =
        dot == std::string::npos ? nullptr : &file->nodes[in.names.Written(text.substr(0, dot))];
    const NodeDef* def = longest == nullptr ? nullptr : in.graph().registry().Find(longest->type);
    const std::string key = longest == nullptr ? "" : text.substr(longest->name.size() + 1);
    if (def == nullptr || !IsRigWord(*def, key)) {
      if (longest == nullptr && TakeOwnSpecial(in, override_, own)) continue;
      others.push_back(std::move(override_));
      continue;
    }
    auto& attributes = longest->attributes;
    attributes.erase(std::remove_if(attributes.begin(), attributes.end(),
                                    [&](const RigAttribute& a) { return a.name == key; }),
                     attributes.end());
    attributes.push_back(SpecialOf(in, key, override_));
  }
  file->overrides = std::move(others);
}

}  // namespace kpsa::engine
