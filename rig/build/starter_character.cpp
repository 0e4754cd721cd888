#include "rig/build/starter_character.h"

#include <algorithm>
#include <map>

namespace kpsa::engine {
namespace {

constexpr double kSpaceShare = 0.9;  // of the skin that the space's subtree carries

// By node: the share of all points that it and its descendants move.
std::vector<double> MeasureCarried(const Rig& rig) {
  const gltf::Character& character = *rig.character;
  std::vector<double> carries(character.nodes.size(), 0.0);
  std::map<Index, Index> gltf_of_node;
  for (Index i = 0; i < rig.scene.transforms.size(); ++i) gltf_of_node[rig.scene.transforms[i].index] = i;
  double total = 0;
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    total += mesh.mesh().point_count();
    if (mesh.influences == nullptr) {
      carries[mesh.gltf_node] += mesh.mesh().point_count();
      continue;
    }
    for (std::size_t i = 0; i < mesh.influences->joints().size(); ++i) {
      carries[gltf_of_node[mesh.influence_nodes[mesh.influences->joints()[i]].index]] +=
          mesh.influences->weights()[i];
    }
  }
  for (auto it = character.order.rbegin(); it != character.order.rend(); ++it) {
    if (character.nodes[*it].parent != kNoIndex) carries[character.nodes[*it].parent] += carries[*it];
  }
  for (double& share : carries) share = total > 0 ? share / total : 0;
  return carries;
}

}  // namespace

StarterCharacter::StarterCharacter(const Rig& of)
    : rig(of),
      character(*of.character),
      roles(JointRoles(character)),
      limbs(FindLimbs(character, roles)),
      motions(character.nodes.size()),
      carries(MeasureCarried(of)) {
  for (const gltf::Clip& clip : character.clips) {
    clips.push_back(MeasureClip(character, clip));
    for (const auto& [node, motion] : clips.back()) motions[node].Add(motion);
  }
}

std::string StarterCharacter::FreeName(const std::string& wish) const {
  const auto taken = [&](const std::string& name) {
    return rig.graph->FindNode(name).ok() ||
           std::any_of(character.nodes.begin(), character.nodes.end(),
                       [&](const gltf::Node& node) { return node.name == name; });
  };
  std::string name = wish;
  for (int i = 2; taken(name); ++i) name = fmt::format("{}{}", wish, i);
  return name;
}

bool StarterCharacter::IsInfluence(Index node) const {
  return std::any_of(rig.scene.meshes.begin(), rig.scene.meshes.end(), [&](const CharacterMesh& mesh) {
    return std::find(mesh.influence_nodes.begin(), mesh.influence_nodes.end(), rig.scene.transforms[node]) !=
           mesh.influence_nodes.end();
  });
}

bool StarterCharacter::IsJoint(Index node) const {
  for (const gltf::Skin& skin : character.skins) {
    if (std::find(skin.joints.begin(), skin.joints.end(), node) != skin.joints.end()) return true;
  }
  return false;
}

bool StarterCharacter::AnyMotion() const {
  return std::any_of(motions.begin(), motions.end(), [&](const Motion& motion) {
    const auto beyond = [](double least) {
      return [least](const MotionRange& range) { return range.size() > least; };
    };
    return std::any_of(motion.rotate, motion.rotate + 3, beyond(kLeastDegrees)) ||
           std::any_of(motion.translate, motion.translate + 3,
                       beyond(kLeastTranslation * rig.rest_diagonal)) ||
           std::any_of(motion.scale, motion.scale + 3, beyond(kLeastScale)) ||
           std::any_of(motion.weights.begin(), motion.weights.end(), beyond(kLeastWeight));
  });
}

std::optional<NodeId> StarterCharacter::Space() const {
  std::optional<NodeId> best;
  std::vector<bool> scaled(character.nodes.size(), false);
  // Parents first: later ones are deeper along the one chain that qualifies
  for (Index i : character.order) {
    const auto& scale = motions[i].scale;
    scaled[i] =
        std::any_of(scale, scale + 3, [](const MotionRange& range) { return range.size() > kLeastScale; }) ||
        (character.nodes[i].parent != kNoIndex && scaled[character.nodes[i].parent]);
    if (carries[i] >= kSpaceShare && character.nodes[i].mesh == kNoIndex && !scaled[i])
      best = rig.scene.transforms[i];
  }
  return best;
}

std::string StarterCharacter::GoalOf(const Limb& limb) const {
  return FreeName(fmt::format("{}{}Goal", limb.part == BodyPart::kArm ? "hand" : "foot",
                              limb.side == BodySide::kLeft ? "L" : "R"));
}

}  // namespace kpsa::engine
