#include "host/vertex_choice.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "rig/character/joint_roles.h"
#include "rig/character/rest_pose.h"

namespace kpsa::engine {
namespace {

const gltf::Mesh& FileMesh(const Rig& rig, std::size_t mesh) {
  return rig.character->meshes[rig.character->nodes[rig.scene.meshes[mesh].gltf_node].mesh];
}

// What the chosen joints move, mesh by mesh.
std::vector<MeshVertices> MovedBy(const Rig& rig, const std::vector<bool>& chosen) {
  std::vector<MeshVertices> all;
  for (std::size_t m = 0; m < rig.scene.meshes.size(); ++m) {
    const Index skin = rig.character->nodes[rig.scene.meshes[m].gltf_node].skin;
    const gltf::Mesh& mesh = FileMesh(rig, m);
    if (skin == kNoIndex || !mesh.skinned()) continue;
    const std::vector<Index>& joints = rig.character->skins[skin].joints;
    MeshVertices one{m, {}};
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
      const auto row = mesh.influence_rows().row(v);
      if (std::any_of(row.begin(), row.end(),
                      [&](const gltf::Influence& i) { return i.weight > 0 && chosen[joints[i.joint]]; }))
        one.vertices.push_back(v);
    }
    if (!one.vertices.empty()) all.push_back(std::move(one));
  }
  return all;
}

std::vector<MeshVertices> CoveredBy(const Rig& rig, Index material) {
  std::vector<MeshVertices> all;
  for (std::size_t m = 0; m < rig.scene.meshes.size(); ++m) {
    MeshVertices one{m, {}};
    for (const gltf::Primitive& primitive : FileMesh(rig, m).primitives) {
      for (Index v = 0; v < primitive.vertex_count && primitive.material == material; ++v)
        one.vertices.push_back(primitive.first_vertex + v);
    }
    if (!one.vertices.empty()) all.push_back(std::move(one));
  }
  return all;
}

MeshVertices AllOf(const Rig& rig, std::size_t mesh) {
  MeshVertices one{mesh, std::vector<Index>(rig.scene.meshes[mesh].vertex_count)};
  std::iota(one.vertices.begin(), one.vertices.end(), Index{0});
  return one;
}

bool HasWord(std::string text, const char* word) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text.find(word) != std::string::npos;
}

}  // namespace

std::string MaterialName(const gltf::Character& character, Index material) {
  const std::string& name = character.materials[material].name;
  return name.empty() ? fmt::format("material{}", material) : name;
}

std::string RangesText(std::span<const Index> ascending) {
  std::string text;
  for (std::size_t i = 0; i < ascending.size();) {
    std::size_t last = i;
    while (last + 1 < ascending.size() && ascending[last + 1] == ascending[last] + 1) ++last;
    if (!text.empty()) text += ',';
    text += std::to_string(ascending[i]);
    if (last > i) text += ":" + std::to_string(ascending[last]);
    i = last + 1;
  }
  return text;
}

Result<NamedVertices> FindVertices(const Rig& rig, std::string_view name) {
  const gltf::Character& character = *rig.character;
  const std::vector<std::string> nodes = character.UniqueNames();
  std::vector<std::string> known;
  std::vector<bool> is_joint(character.nodes.size());
  for (const gltf::Skin& skin : character.skins) {
    for (Index joint : skin.joints) is_joint[joint] = true;
  }
  for (Index n = 0; n < nodes.size(); ++n) {
    if (!is_joint[n]) continue;
    known.push_back(nodes[n]);
    if (nodes[n] != name) continue;
    std::vector<bool> chosen(nodes.size());
    chosen[n] = true;
    NamedVertices found{NameKind::kJoint, MovedBy(rig, chosen)};
    if (found.meshes.empty()) return Status::Usage("the joint \"{}\" moves no vertex by itself", name);
    return found;
  }
  for (Index m = 0; m < character.materials.size(); ++m) {
    known.push_back(MaterialName(character, m));
    if (known.back() == name) return NamedVertices{NameKind::kMaterial, CoveredBy(rig, m)};
  }
  for (std::size_t m = 0; m < rig.scene.meshes.size(); ++m) {
    known.push_back(rig.scene.meshes[m].name);
    if (known.back() == name) return NamedVertices{NameKind::kMesh, {AllOf(rig, m)}};
  }
  return Status::Usage("no joint, material or mesh is called \"{}\"{}", name, DidYouMean(name, known));
}

Result<std::vector<MeshVertices>> FaceVertices(const Rig& rig) {
  const gltf::Character& character = *rig.character;
  const std::vector<JointRole> roles = JointRoles(character);
  // The neck is of the head's part: all below a joint that is called a head, and what is of the face by its name
  std::vector<bool> chosen(character.nodes.size());
  for (Index n : character.order) {
    const Index parent = character.nodes[n].parent;
    chosen[n] = (parent != kNoIndex && chosen[parent]) || roles[n].part == BodyPart::kFace ||
                (roles[n].part == BodyPart::kHead && HasWord(character.nodes[n].name, "head"));
  }
  std::vector<MeshVertices> face = MovedBy(rig, chosen);
  if (!face.empty()) return face;
  for (const char* word : {"face", "head"}) {
    for (std::size_t m : ShownMeshes(rig.scene)) {
      if (HasWord(rig.scene.meshes[m].name, word)) face.push_back(AllOf(rig, m));
    }
    if (!face.empty()) return face;
  }
  return Status::Usage("no joint and no mesh is called a head or a face: expected the name of one");
}

Result<NearVertex> NearestVertex(const Rig& rig, Double3 place) {
  RestPose rest(*rig.character, rig.scene);
  NearVertex nearest;
  bool any = false;
  for (std::size_t m : ShownMeshes(rig.scene)) {
    const CharacterMesh& mesh = rig.scene.meshes[m];
    const std::vector<Double3>& points = rest.WorldPoints(m);
    const std::vector<Index>& point_of = mesh.mesh().data().vertex_to_point;
    for (Index v = 0; v < mesh.vertex_count; ++v) {
      const Double3 at = points[point_of[v]];
      const double distance = Length(at - place);
      if (any && !(distance < nearest.distance)) continue;
      nearest = {m, v, distance, at};
      any = true;
    }
  }
  if (!any) return Status::Invalid("no mesh is shown").At({rig.path});
  return nearest;
}

}  // namespace kpsa::engine
