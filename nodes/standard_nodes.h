// The node types that every rig may use, one line each.
#pragma once

#include "graph/node_registry.h"

namespace kpsa::engine {

void AddTimeNode(NodeRegistry& registry);               // time
void AddTransformNodes(NodeRegistry& registry);         // transform, joint
void AddClipNodes(NodeRegistry& registry);              // clipTransform, clipWeights, animCurve(UU, UA, UL)
void AddClipLayerNodes(NodeRegistry& registry);         // clipLayer, layeredTransform, layeredWeights
void AddMeshNode(NodeRegistry& registry);               // mesh
void AddBlendShapeNode(NodeRegistry& registry);         // blendShape, combinationShape
void AddSkinClusterNode(NodeRegistry& registry);        // skinCluster
void AddTransformGeometryNode(NodeRegistry& registry);  // transformGeometry
void AddLatticeNode(NodeRegistry& registry);            // lattice
void AddClusterNodes(NodeRegistry& registry);           // cluster, softMod
void AddDeltaMushNode(NodeRegistry& registry);          // deltaMush
void AddCurveNodes(NodeRegistry& registry);             // curve, wire
void AddNonLinearNodes(NodeRegistry& registry);         // bend, twist, squash, flare, sine, wave
void AddTensionNode(NodeRegistry& registry);            // tension
void AddWrapNodes(NodeRegistry& registry);              // wrap, proximityWrap
void AddShrinkWrapNode(NodeRegistry& registry);         // shrinkWrap
// sphereFalloff, capsuleFalloff, planeFalloff, proximityFalloff, weightMap, combineFalloff
void AddFalloffNodes(NodeRegistry& registry);
void AddPinNodes(NodeRegistry& registry);              // uvPin, follicle
void AddSculptNode(NodeRegistry& registry);            // sculpt
void AddPoseInterpolatorNode(NodeRegistry& registry);  // poseInterpolator
void AddJiggleNode(NodeRegistry& registry);            // jiggle
void AddTripwireNode(NodeRegistry& registry);          // tripwire
void AddMathNodes(NodeRegistry& registry);  // remapValue, multiplyDivide, plusMinusAverage, unitConversion
void AddExpressionNode(NodeRegistry& registry);  // expression
// clamp, setRange, blendColors, distanceBetween, angleBetween, vectorProduct
void AddUtilityNodes(NodeRegistry& registry);
// multMatrix, composeMatrix, decomposeMatrix, inverseMatrix, blendMatrix, pickMatrix
void AddMatrixNodes(NodeRegistry& registry);
void AddSelectionNodes(NodeRegistry& registry);   // condition, choice
void AddConstraintNodes(NodeRegistry& registry);  // pointConstraint, orient..., parent..., scale..., aim...
// vrmRollConstraint, vrmAimConstraint, vrmRotationConstraint
void AddVrmConstraintNodes(NodeRegistry& registry);
void AddVrmExpressionNodes(NodeRegistry& registry);     // vrmExpressions, vrmMorphWeights
void AddIkNodes(NodeRegistry& registry);                // ikHandle, poleVectorConstraint
void AddSpaceSwitchNode(NodeRegistry& registry);        // spaceSwitch
void AddSplineIkNode(NodeRegistry& registry);           // splineIk
void AddTwistDistributionNode(NodeRegistry& registry);  // twistDistribution
void AddLightNodes(NodeRegistry& registry);         // camera, pointLight, sphereLight, areaLight, sunLight
void AddIlluminationNodes(NodeRegistry& registry);  // indirectIllumination

// All of them.
void AddStandardNodes(NodeRegistry& registry);

}  // namespace kpsa::engine
