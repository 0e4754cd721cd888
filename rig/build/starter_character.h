// Inside of the starter rig's writer: what is known of a character before anything of its rig is written. Nothing
// outside rig/build includes this.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rig/build/rig_builder.h"
#include "rig/character/clip_motion.h"
#include "rig/character/joint_roles.h"

namespace kpsa::engine {

// Smaller motion is noise:
inline constexpr double kLeastDegrees = 0.1;
inline constexpr double kLeastTranslation = 1e-4;  // of the rest diagonal
inline constexpr double kLeastWeight = 0.01;
inline constexpr double kLeastScale = 0.01;  // of the scale at rest

// Refers to the rig, which was loaded from a character alone, at rest.
struct StarterCharacter {
  explicit StarterCharacter(const Rig& rig);

  // A name that nothing else has.
  std::string FreeName(const std::string& wish) const;
  const std::string& NameOf(Index node) const { return rig.graph->name(rig.scene.transforms[node]); }
  // A joint that moves points of some mesh; a joint of some skin.
  bool IsInfluence(Index node) const;
  bool IsJoint(Index node) const;
  // Whether any clip takes anything away from rest.
  bool AnyMotion() const;
  // The deepest transform that carries nearly everything: in its space only what deforms is left to learn.
  std::optional<NodeId> Space() const;
  // "handLGoal": a transform that the end of the limb follows.
  std::string GoalOf(const Limb& limb) const;

  const Rig& rig;
  const gltf::Character& character;
  std::vector<JointRole> roles;  // by glTF node
  std::vector<Limb> limbs;
  std::vector<ClipMotion> clips;
  std::vector<Motion> motions;  // of all clips, by glTF node
  std::vector<double> carries;  // by glTF node: the share of all points that it and its descendants move
};

}  // namespace kpsa::engine
