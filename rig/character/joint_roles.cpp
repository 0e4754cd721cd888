#include "rig/character/joint_roles.h"

#include <algorithm>
#include <initializer_list>
#include <optional>

namespace kpsa::engine {
namespace {

using Words = std::initializer_list<const char*>;
constexpr std::size_t kMostJoints = 16;  // of a limb

bool IsUpper(char c) { return c >= 'A' && c <= 'Z'; }
bool IsLower(char c) { return c >= 'a' && c <= 'z'; }

// The words of a name in lower case: at capitals, digits and anything that is no letter one ends.
std::vector<std::string> WordsOf(std::string_view name) {
  std::vector<std::string> words{""};
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    const bool starts =
        IsUpper(c) && i > 0 && (!IsUpper(name[i - 1]) || (i + 1 < name.size() && IsLower(name[i + 1])));
    if ((starts || (!IsUpper(c) && !IsLower(c))) && !words.back().empty()) words.emplace_back();
    if (IsUpper(c) || IsLower(c)) words.back() += IsUpper(c) ? static_cast<char>(c - 'A' + 'a') : c;
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

std::string Joined(std::string_view name) {
  std::string joined;
  for (const std::string& word : WordsOf(name)) joined += word;
  return joined;
}

bool HasWord(std::string_view name, Words words) {
  const std::vector<std::string> own = WordsOf(name);
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return std::find(own.begin(), own.end(), word) != own.end(); });
}

bool Contains(const std::string& joined, Words words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return joined.find(word) != std::string::npos; });
}

std::optional<BodyPart> PartOfName(std::string_view name, BodySide side, BodyPart above) {
  std::string joined = Joined(name);
  if (const std::size_t at = joined.find("armature"); at != std::string::npos) joined.erase(at, 8);
  if (Contains(joined, {"finger", "thumb", "metacarpal", "pinky"})) return BodyPart::kFingers;
  const bool at_hand = above == BodyPart::kArm || above == BodyPart::kFingers;
  if (at_hand && HasWord(name, {"index", "middle", "ring", "little"})) return BodyPart::kFingers;
  if (Contains(joined, {"jaw", "eye", "brow", "mouth", "cheek", "tongue", "nose", "teeth", "chin"}) ||
      HasWord(name, {"lip", "lips", "lid", "ear"}))
    return BodyPart::kFace;
  if (Contains(joined, {"forearm", "upperarm", "lowerarm", "elbow", "wrist", "shoulder", "clavicle", "hand",
                        "palm"}) ||
      HasWord(name, {"arm"}))
    return BodyPart::kArm;
  if (Contains(joined,
               {"upperleg", "lowerleg", "upleg", "thigh", "calf", "shin", "knee", "ankle", "foot", "toe"}) ||
      HasWord(name, {"leg"}))
    return BodyPart::kLeg;
  if (HasWord(name, {"head", "neck"})) return BodyPart::kHead;
  if (HasWord(name, {"tail"})) return BodyPart::kTail;
  if (HasWord(name, {"hip"}) && side != BodySide::kMiddle) return BodyPart::kLeg;
  if (Contains(joined, {"spine", "chest", "torso", "pelvis", "abdomen"}) ||
      HasWord(name, {"hip", "hips", "root", "body"}))
    return BodyPart::kBody;
  return std::nullopt;
}

}  // namespace

BodySide SideOfName(std::string_view name) {
  if (HasWord(name, {"l", "left", "lf", "lft"})) return BodySide::kLeft;
  if (HasWord(name, {"r", "right", "rt", "rgt"})) return BodySide::kRight;
  return BodySide::kMiddle;
}

const char* SideName(BodySide side) {
  return side == BodySide::kLeft ? "left" : side == BodySide::kRight ? "right" : "";
}

const char* PartName(BodyPart part) {
  switch (part) {
    case BodyPart::kBody:
      return "body";
    case BodyPart::kHead:
      return "head and neck";
    case BodyPart::kFace:
      return "face";
    case BodyPart::kArm:
      return "arm";
    case BodyPart::kFingers:
      return "fingers";
    case BodyPart::kLeg:
      return "leg";
    case BodyPart::kTail:
      return "tail";
    case BodyPart::kOther:
      break;
  }
  return "others";
}

std::vector<JointRole> JointRoles(const gltf::Character& character) {
  std::vector<JointRole> roles(character.nodes.size());
  for (Index node : character.order) {
    JointRole& role = roles[node];
    const gltf::Node& of = character.nodes[node];
    JointRole above;
    if (of.parent != kNoIndex) above = roles[of.parent];
    role.side = SideOfName(of.name);
    const std::optional<BodyPart> part = PartOfName(of.name, role.side, above.part);
    if (part.has_value()) {
      role.part = *part;
    } else {
      role.part = above.part == BodyPart::kHead ? BodyPart::kFace : above.part;
      if (role.side == BodySide::kMiddle) role.side = above.side;
    }
  }
  return roles;
}

std::vector<Limb> FindLimbs(const gltf::Character& character, const std::vector<JointRole>& roles) {
  std::vector<Limb> limbs;
  const auto name_of = [&](Index node) { return Joined(character.nodes[node].name); };
  for (Index end : character.order) {
    Limb limb{roles[end].part, roles[end].side, kNoIndex, kNoIndex, end};
    const bool arm = limb.part == BodyPart::kArm;
    if (limb.side == BodySide::kMiddle || (!arm && limb.part != BodyPart::kLeg)) continue;
    const std::string end_name = name_of(end);
    if (!(arm ? Contains(end_name, {"wrist", "hand", "palm"}) : Contains(end_name, {"foot", "ankle"})))
      continue;
    if (std::any_of(limbs.begin(), limbs.end(),
                    [&](const Limb& other) { return other.part == limb.part && other.side == limb.side; }))
      continue;  // what hangs on a hand, or a second one
    // Upwards while it is the same limb: what is named as the lower bone, then what is not, up to the trunk
    std::vector<Index> lower, upper;
    for (Index i = character.nodes[end].parent; i != kNoIndex && lower.size() + upper.size() < kMostJoints;
         i = character.nodes[i].parent) {
      const std::string name = name_of(i);
      if (roles[i].part != limb.part || roles[i].side != limb.side ||
          Contains(name, {"clavicle", "shoulder", "hip", "pelvis"}))
        break;
      const bool is_lower = Contains(name, {"lower", "fore", "elbow", "calf", "shin", "knee"});
      if (is_lower && !upper.empty()) break;
      (is_lower ? lower : upper).push_back(i);
    }
    if (lower.empty() && upper.size() == 2) {
      lower = {upper[0]};
      upper = {upper[1]};
    }
    if (lower.empty() || upper.empty()) continue;
    limb.mid = lower.back();
    limb.start = upper.back();
    limbs.push_back(limb);
  }
  return limbs;
}

Index FindJoint(const gltf::Character& character, std::string_view word) {
  for (Index node : character.order) {
    const std::vector<std::string> words = WordsOf(character.nodes[node].name);
    if (std::find(words.begin(), words.end(), word) != words.end()) return node;
  }
  return kNoIndex;
}

}  // namespace kpsa::engine
