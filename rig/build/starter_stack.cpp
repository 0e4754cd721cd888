#include "rig/build/starter_stack.h"

#include <algorithm>
#include <vector>

#include "rig/build/starter_text.h"
#include "rig/build/starter_training.h"

namespace kpsa::engine {
namespace {

// A lattice about the jaw, where there is one that moves points: its name, or "".
std::string WriteCage(const StarterCharacter& in, std::string* text) {
  const Index jaw = FindJoint(in.character, "jaw");
  if (jaw == kNoIndex || in.character.nodes[jaw].parent == kNoIndex || !in.IsInfluence(jaw)) return "";
  const std::string cage = in.FreeName("jawCage");
  *text += fmt::format(
      "  # A cage about what the jaw moves; connect its points, as in chin.outValue -> "
      "{0}.points[1,0,2].y\n"
      "  #{0}: {{type: lattice, parent: {1}, divisions: [3, 3, 3], members: {{joint: {2}, above: "
      "0.05}}}}\n",
      cage, Quoted(in.NameOf(in.character.nodes[jaw].parent), true), Quoted(in.NameOf(jaw), true));
  return cage;
}

void WriteLimbs(const StarterCharacter& in, std::string* text) {
  if (in.limbs.empty()) return;
  *text +=
      "  # IK: the end of a limb follows its goal (blend: 0 is the clip alone); a poleVectorConstraint "
      "turns "
      "the elbow or knee.\n";
  for (const Limb& limb : in.limbs) {
    const std::string goal = in.GoalOf(limb), end = Quoted(in.NameOf(limb.end), true);
    *text += fmt::format(
        "  #{0}: {{type: transform, at: {1}}}\n"
        "  #{2}: {{type: ikHandle, start: {3}, mid: {4}, end: {1}, target: {0}.worldMatrix}}\n",
        goal, end, in.FreeName(goal + "Ik"), Quoted(in.NameOf(limb.start), true),
        Quoted(in.NameOf(limb.mid), true));
  }
}

void WriteSkins(const StarterCharacter& in, std::string* text) {
  std::vector<std::string> skins;
  for (const CharacterMesh& mesh : in.rig.scene.meshes) {
    if (mesh.influences != nullptr) skins.push_back(in.rig.graph->name(mesh.skin_cluster));
  }
  if (skins.empty()) return;
  *text += fmt::format(
      "\n# Keeps the thickness of twisted limbs{}. Skin weights as files to edit: kpsa weights export\n"
      "#overrides:\n  #{}: dualQuaternion\n",
      skins.size() == 1 ? "" : ", here of one skin of several", Quoted(skins[0] + ".skinningMethod", false));
}

}  // namespace

StarterStack WriteStack(const StarterCharacter& in, const std::string& file, int iterations) {
  StarterStack stack;
  stack.mush = in.FreeName("mush");
  std::string& text = stack.text;
  std::vector<std::string> meshes;
  for (const std::size_t m : ShownMeshes(in.rig.scene)) meshes.push_back(in.rig.scene.meshes[m].name);
  text += fmt::format(
      "kpsa: 1\n"
      "units: {{length: cm, angle: deg}}\n"
      "{}"
      "character: {}\n",
      in.rig.fps == kUnsaidFps ? "" : fmt::format("fps: {}  # of the clips' keys\n", in.rig.fps),
      Quoted(file, false));
  if (meshes.empty()) {
    stack.remark = "the scene shows no mesh, so that there is nothing to accelerate";
    text += "# The scene shows no mesh: there is nothing to deform or to accelerate.\n";
    WriteSkins(in, &text);
    return stack;
  }
  text += fmt::format(
      "\nnodes:\n"
      "  # Smooths what the skin does to the surface. Other deformers: lattice, cluster, softMod, wire, "
      "wrap, "
      "... (kpsa nodes).\n"
      "  {}: {{type: deltaMush, iterations: {}}}\n",
      Quoted(stack.mush, false), iterations);
  const std::string cage = WriteCage(in, &text);
  WriteLimbs(in, &text);
  text += fmt::format(
      "\ndeform:\n"
      "  # gltf is the file's own morph targets and skin; deformers act in this order.{}\n"
      "  - meshes: {}\n"
      "    stack: [gltf, {}]\n",
      cage.empty() ? "" : fmt::format(" {} would go before {}.", cage, stack.mush), QuotedList(meshes),
      Quoted(stack.mush, true));
  WriteSkins(in, &text);
  return stack;
}

}  // namespace kpsa::engine
