#include "rig/file/words.h"

#include <algorithm>

namespace kpsa::engine {
namespace {

bool Has(const NodeDef& def, const char* name) { return def.FindAttribute(name) >= 0; }

bool IsCurve(const NodeDef& def) { return def.name == "curve"; }

bool FollowsCurve(const NodeDef& def) {
  return Has(def, "curve") && Has(def, "displacements") && !IsCurve(def);
}

bool IsBlendShape(const NodeDef& def) { return def.name == "blendShape"; }

bool IsIllumination(const NodeDef& def) { return def.name == "indirectIllumination"; }

bool IsChain(const NodeDef& def) {
  return def.name == "ikHandle" || def.name == "splineIk" || def.name == "twistDistribution";
}

// Deformers, and weight maps of their own.
bool HasWeights(const NodeDef& def) {
  return IsDeformer(def) || (Has(def, "weights") && Has(def, "outputWeights"));
}

struct Rule {
  RigWord word;
  bool (*applies)(const NodeDef&);
};
const Rule kRules[] = {
    {{"parent", "the transform that carries it"}, [](const NodeDef& d) { return Has(d, "parentMatrix"); }},
    {{"at", "where it rests: a curve's vertex, a transform, a vertex of the mesh or [x, y, z]"},
     [](const NodeDef& d) { return Has(d, "offsetParentMatrix"); }},
    {{"members", "the points that it moves"}, HasWeights},
    {{"weights", "a weight map, file.json#map, or a list of them"}, HasWeights},
    {{"falloff", "1 at a place, 0 at the radius and beyond, or a falloff node"}, HasWeights},
    {{"falloffs", "the two falloff nodes that it combines"},
     [](const NodeDef& d) { return Has(d, "input1") && Has(d, "outputWeights"); }},
    {{"vertices", "control vertices at rest, of the mesh"}, IsCurve},
    {{"mesh", "of the vertices, where the character has several"}, IsCurve},
    {{"places", "control vertices at rest, [x, y, z] in the world"}, IsCurve},
    {{"closed", "whether the last vertex is followed by the first"}, IsCurve},
    {{"curve", "the curve that it follows"}, FollowsCurve},
    {{"curves", "several curves that it follows"}, FollowsCurve},
    {{"driver", "the mesh that it follows, mesh or mesh@stage; of a poseInterpolator a transform"},
     [](const NodeDef& d) { return Has(d, "driverPoints") || d.name == "poseInterpolator"; }},
    {{"poses", "poses of the driver by name, angles from rest: {flat: [0, 0, 0], open: [-25, 0, 0]}"},
     [](const NodeDef& d) { return d.name == "poseInterpolator"; }},
    {{"targets",
      "transforms of a constraint; of a blend shape morph targets, or {file: FILE}, shapes of a file"},
     [](const NodeDef& d) {
       return (Has(d, "targetMatrix") && Has(d, "outMatrix")) || d.name == "blendShape";
     }},
    {{"combinations",
      "weights of targets by those of others: {smileOpen: {targets: [smile, open], method: multiply}}"},
     IsBlendShape},
    {{"inbetweens", "other targets that a target goes through: {smile: {0.5: smile_half}}"}, IsBlendShape},
    {{"blendWeights", "a weight map of dual quaternions"},
     [](const NodeDef& d) { return d.name == "skinCluster"; }},
    {{"influences", "a weight file with a map for each joint, instead of the character's own weights"},
     [](const NodeDef& d) { return d.name == "skinCluster"; }},
    {{"constrained", "the transform whose local matrix it owns"},
     [](const NodeDef& d) { return Has(d, "inMatrix") && Has(d, "outMatrix") && d.name != "splineIk"; }},
    {{"meshes", "the meshes that are lit; all of the character if not given"}, IsIllumination},
    {{"carried",
      "lit meshes that move through the picture: light is given at their points, not at their pixels"},
     IsIllumination},
    {{"camera", "the camera that it looks through"}, IsIllumination},
    {{"lights", "the lights that light up what it sees"}, IsIllumination},
    {{"start", "the first joint of the chain"}, IsChain},
    {{"mid", "the joint that bends"}, [](const NodeDef& d) { return d.name == "ikHandle"; }},
    {{"end", "the last joint of the chain"}, IsChain},
};

}  // namespace

std::vector<RigWord> RigWordsOf(const NodeDef& def) {
  std::vector<RigWord> words;
  for (const Rule& rule : kRules) {
    if (rule.applies(def)) words.push_back(rule.word);
  }
  return words;
}

bool IsRigWord(const NodeDef& def, std::string_view key) {
  return std::any_of(std::begin(kRules), std::end(kRules),
                     [&](const Rule& rule) { return key == rule.word.name && rule.applies(def); });
}

bool IsDeformer(const NodeDef& def) {
  const int points = def.FindAttribute("inPoints");
  return points >= 0 && def.attributes[static_cast<std::size_t>(points)].per_geometry &&
         Has(def, "outPoints");
}

}  // namespace kpsa::engine
