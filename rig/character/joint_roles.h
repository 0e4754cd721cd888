// What the joints of a character are for, judged by their names and their place in the hierarchy, as common
// skeletons have them (MakeHuman, Mixamo, Rigify, 3ds Max, game exporters).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gltf/import.h"

namespace kpsa::engine {

enum class BodySide : std::uint8_t { kMiddle, kLeft, kRight };
// "upperarm01.L", "eye-left-slit", "mixamorig:LeftHand", "L_thigh".
BodySide SideOfName(std::string_view name);
const char* SideName(BodySide side);  // "", "left", "right"

enum class BodyPart : std::uint8_t { kOther, kBody, kHead, kFace, kArm, kFingers, kLeg, kTail };
const char* PartName(BodyPart part);  // "body", "head and neck", ...

struct JointRole {
  BodyPart part = BodyPart::kOther;
  BodySide side = BodySide::kMiddle;
};
// By glTF node. A name that says nothing is of its parent's part and side; below the head it is of the face.
std::vector<JointRole> JointRoles(const gltf::Character& character);

// An arm or a leg: two bones, each a chain of one or more joints, and what is at their end.
struct Limb {
  BodyPart part = BodyPart::kArm;
  BodySide side = BodySide::kMiddle;
  Index start = kNoIndex, mid = kNoIndex, end = kNoIndex;  // glTF nodes, each below the one before
};
std::vector<Limb> FindLimbs(const gltf::Character& character, const std::vector<JointRole>& roles);

// The node whose name has the word, the first one in the order of the hierarchy; kNoIndex if there is none.
Index FindJoint(const gltf::Character& character, std::string_view word);

}  // namespace kpsa::engine
