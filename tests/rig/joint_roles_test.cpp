// What joints are for, in skeletons as common tools write them.
#include "rig/character/joint_roles.h"

#include <gtest/gtest.h>

#include "rig/character/clip_motion.h"

namespace kpsa::engine {
namespace {

// Nodes by name; each is below the one that its first word names ("" for roots): "parent/name".
gltf::Character Skeleton(const std::vector<std::pair<std::string, std::string>>& joints) {
  gltf::Character character;
  for (const auto& [parent, name] : joints) {
    gltf::Node node;
    node.name = name;
    for (Index i = 0; i < character.nodes.size(); ++i) {
      if (character.nodes[i].name == parent) node.parent = i;
    }
    character.order.push_back(static_cast<Index>(character.nodes.size()));
    character.nodes.push_back(node);
  }
  return character;
}

std::string Describe(const gltf::Character& character) {
  std::string text;
  const std::vector<JointRole> roles = JointRoles(character);
  for (Index i = 0; i < character.nodes.size(); ++i)
    text += character.nodes[i].name + ": " + PartName(roles[i].part) + " " + SideName(roles[i].side) + "\n";
  for (const Limb& limb : FindLimbs(character, roles))
    text += character.nodes[limb.start].name + " " + character.nodes[limb.mid].name + " " +
            character.nodes[limb.end].name + "\n";
  return text;
}

TEST(JointRoles, SidesOfNames) {
  for (const char* name : {"upperarm01.L", "LeftHand", "mixamorig:LeftArm", "L_thigh", "eye-left-slit",
                           "hand_l", "b_LeftLeg01_015", "blink.L"})
    EXPECT_EQ(SideOfName(name), BodySide::kLeft) << name;
  for (const char* name : {"upperarm01.R", "RightUpLeg", "r_hand", "nose-right-elevation", "Toe.R.001"})
    EXPECT_EQ(SideOfName(name), BodySide::kRight) << name;
  for (const char* name : {"", "spine01", "Collar", "jaw", "lower", "relax", "IKROLL"})
    EXPECT_EQ(SideOfName(name), BodySide::kMiddle) << name;
}

TEST(JointRoles, MakeHuman) {
  EXPECT_EQ(
      Describe(Skeleton({{"", "root"},
                         {"root", "spine05"},
                         {"spine05", "clavicle.L"},
                         {"clavicle.L", "shoulder01.L"},
                         {"shoulder01.L", "upperarm01.L"},
                         {"upperarm01.L", "upperarm02.L"},
                         {"upperarm02.L", "lowerarm01.L"},
                         {"lowerarm01.L", "lowerarm02.L"},
                         {"lowerarm02.L", "wrist.L"},
                         {"wrist.L", "finger1-1.L"},
                         {"spine05", "neck01"},
                         {"neck01", "head"},
                         {"head", "jaw"},
                         {"jaw", "oris05"},
                         {"head", "levator06.R"}})),
      "root: body \nspine05: body \nclavicle.L: arm left\nshoulder01.L: arm left\nupperarm01.L: arm left\n"
      "upperarm02.L: arm left\nlowerarm01.L: arm left\nlowerarm02.L: arm left\nwrist.L: arm left\n"
      "finger1-1.L: fingers left\nneck01: head and neck \nhead: head and neck \njaw: face \noris05: face \n"
      "levator06.R: face right\nupperarm01.L lowerarm01.L wrist.L\n");
}

TEST(JointRoles, MixamoAndOthers) {
  EXPECT_EQ(
      Describe(Skeleton({{"", "Armature"},
                         {"Armature", "mixamorig:Hips"},
                         {"mixamorig:Hips", "mixamorig:RightUpLeg"},
                         {"mixamorig:RightUpLeg", "mixamorig:RightLeg"},
                         {"mixamorig:RightLeg", "mixamorig:RightFoot"},
                         {"mixamorig:RightFoot", "mixamorig:RightToeBase"},
                         {"mixamorig:Hips", "mixamorig:RightArm"},
                         {"mixamorig:RightArm", "mixamorig:RightForeArm"},
                         {"mixamorig:RightForeArm", "mixamorig:RightHand"},
                         {"mixamorig:RightHand", "mixamorig:RightHandRing1"},
                         {"mixamorig:Hips", "Tail01"},
                         {"Tail01", "end"}})),
      "Armature: others \nmixamorig:Hips: body \nmixamorig:RightUpLeg: leg right\n"
      "mixamorig:RightLeg: leg right\nmixamorig:RightFoot: leg right\nmixamorig:RightToeBase: leg right\n"
      "mixamorig:RightArm: arm right\nmixamorig:RightForeArm: arm right\nmixamorig:RightHand: arm right\n"
      "mixamorig:RightHandRing1: fingers right\nTail01: tail \nend: tail \n"
      "mixamorig:RightUpLeg mixamorig:RightLeg mixamorig:RightFoot\n"
      "mixamorig:RightArm mixamorig:RightForeArm mixamorig:RightHand\n");
  // A hand that hangs on no arm, and an arm of one bone
  EXPECT_EQ(Describe(Skeleton({{"", "Foot.L"}, {"", "arm.R"}, {"arm.R", "hand.R"}})),
            "Foot.L: leg left\narm.R: arm right\nhand.R: arm right\n");
}

TEST(JointRoles, FindsJointsByAWord) {
  const gltf::Character character = Skeleton({{"", "head"}, {"head", "jawbone"}, {"head", "DEF_Jaw.001"}});
  EXPECT_EQ(FindJoint(character, "jaw"), 2u);
  EXPECT_EQ(FindJoint(character, "eye"), kNoIndex);
}

TEST(ClipMotion, TheTamestClipStaysWithinTheOthers) {
  gltf::Character character = Skeleton({{"", "a"}, {"", "b"}});
  const auto clip = [](const char* id, Index node, double from, double to) {
    gltf::Clip made;
    made.id = id;
    gltf::Channel channel;
    channel.node = node;
    channel.path = gltf::Path::kTranslation;
    channel.times = {0, 1};
    channel.values = {from, 0, 0, to, 0, 0};
    made.channels.push_back(channel);
    return made;
  };
  character.clips = {clip("wild", 0, -2, 2), clip("tame", 0, -1, 1), clip("other", 1, 0, 1)};
  std::vector<ClipMotion> motions;
  for (const gltf::Clip& each : character.clips) motions.push_back(MeasureClip(character, each));
  EXPECT_EQ(motions[0].at(0).translate[0].min, -2);
  EXPECT_EQ(motions[0].at(0).translate[0].max, 2);
  EXPECT_EQ(motions[2].count(0), 0u);
  EXPECT_EQ(TamestClip(character, motions, {true, true, true}), 1u);
  EXPECT_NE(TamestClip(character, motions, {true, false, true}), 1u);
  std::swap(character.clips[0], character.clips[1]);
  std::swap(motions[0], motions[1]);
  EXPECT_EQ(TamestClip(character, motions, {true, true, true}), 0u);
  motions.resize(1);
  character.clips.resize(1);
  EXPECT_EQ(TamestClip(character, motions, {true}), 0u);
}

}  // namespace
}  // namespace kpsa::engine
