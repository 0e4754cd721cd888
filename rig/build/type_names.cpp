#include "rig/build/type_names.h"

#include <algorithm>
#include <cctype>
#include <string>

namespace kpsa::engine {
namespace {

constexpr OtherTypeName kOtherNames[] = {
    // Maya
    {"nonlinear", "bend, flare, sine, squash, twist or wave"},
    {"ffd", "lattice"},
    {"basemesh", "mesh"},
    {"proximitypin", "uvPin"},
    {"pointonpolyconstraint", "uvPin"},
    {"iksplinehandle", "splineIk"},
    {"nurbscurve", "curve"},
    {"aimmatrix", "aimConstraint"},
    {"wtaddmatrix", "blendMatrix"},
    {"pairblend", "blendMatrix"},
    {"multdoublelinear", "multiplyDivide"},
    {"adddoublelinear", "plusMinusAverage"},
    {"reverse", "plusMinusAverage or expression"},
    {"floatmath", "expression"},
    {"weightdriver", "poseInterpolator"},
    // Blender
    {"armature", "skinCluster"},
    {"shapekey", "blendShape"},
    {"shapekeys", "blendShape"},
    {"correctivesmooth", "deltaMush"},
    {"laplaciansmooth", "deltaMush"},
    {"surfacedeform", "wrap"},
    {"meshdeform", "wrap"},
    {"hook", "cluster"},
    {"simpledeform", "bend, flare, squash or twist"},
    {"copyrotation", "orientConstraint"},
    {"copylocation", "pointConstraint"},
    {"copyscale", "scaleConstraint"},
    {"copytransforms", "parentConstraint"},
    {"childof", "parentConstraint"},
    {"armatureconstraint", "parentConstraint"},
    {"dampedtrack", "aimConstraint"},
    {"trackto", "aimConstraint"},
    {"empty", "transform"},
    {"bone", "joint"},
    // Houdini
    {"bonedeform", "skinCluster"},
    {"pointdeform", "wrap"},
    {"softtransform", "softMod"},
    {"softxform", "softMod"},
    {"magnet", "softMod"},
    {"null", "transform"},
    // Unreal
    {"posedriver", "poseInterpolator"},
    {"rbfsolver", "poseInterpolator"},
    {"morphtarget", "blendShape"},
};

std::string Plain(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return plain;
}

}  // namespace

std::span<const OtherTypeName> OtherTypeNames() { return kOtherNames; }

Suggestion SuggestType(std::string_view type, const NodeRegistry& registry) {
  const auto other = std::ranges::find(kOtherNames, Plain(type), &OtherTypeName::name);
  if (other != std::end(kOtherNames))
    return {"", "; what other programs call so is " + std::string(other->here) + " here"};
  return DidYouMean(type, registry.Names());
}

}  // namespace kpsa::engine
