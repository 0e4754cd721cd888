// The node types that every rig may use, one line each.
#pragma once

#include "graph/node_registry.h"

namespace kpsa {

void AddTimeNode(NodeRegistry& registry);               // time
void AddTransformNodes(NodeRegistry& registry);         // transform, joint
void AddClipNodes(NodeRegistry& registry);              // clipTransform, clipWeights, animCurve
void AddMeshNode(NodeRegistry& registry);               // mesh
void AddBlendShapeNode(NodeRegistry& registry);         // blendShape
void AddSkinClusterNode(NodeRegistry& registry);        // skinCluster
void AddTransformGeometryNode(NodeRegistry& registry);  // transformGeometry
void AddLatticeNode(NodeRegistry& registry);            // lattice
void AddClusterNodes(NodeRegistry& registry);           // cluster, softMod
void AddDeltaMushNode(NodeRegistry& registry);          // deltaMush
void AddCurveNodes(NodeRegistry& registry);             // curve, wire
void AddTripwireNode(NodeRegistry& registry);           // tripwire
void AddMathNodes(NodeRegistry& registry);    // remapValue, multiplyDivide, plusMinusAverage, unitConversion
void AddMatrixNodes(NodeRegistry& registry);  // multMatrix, composeMatrix, decomposeMatrix
void AddSelectionNodes(NodeRegistry& registry);     // condition, choice
void AddLightNodes(NodeRegistry& registry);         // camera, pointLight, areaLight, sunLight
void AddIlluminationNodes(NodeRegistry& registry);  // indirectIllumination

// All of them.
void AddStandardNodes(NodeRegistry& registry);

}  // namespace kpsa
