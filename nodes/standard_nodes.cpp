#include "nodes/standard_nodes.h"

namespace kpsa::engine {

void AddTimeNode(NodeRegistry& registry) {
  registry.add("time", "The time of the scene. Read `time.time` as a source.")
      .category("time")
      .in("time", 0.0, {.unit = Unit::kTime, .doc = "seconds"});
}

void AddStandardNodes(NodeRegistry& registry) {
  for (auto* add : {AddTimeNode,
                    AddTransformNodes,
                    AddClipNodes,
                    AddClipLayerNodes,
                    AddMeshNode,
                    AddBlendShapeNode,
                    AddSkinClusterNode,
                    AddTransformGeometryNode,
                    AddLatticeNode,
                    AddClusterNodes,
                    AddDeltaMushNode,
                    AddCurveNodes,
                    AddNonLinearNodes,
                    AddTensionNode,
                    AddWrapNodes,
                    AddShrinkWrapNode,
                    AddFalloffNodes,
                    AddPinNodes,
                    AddSculptNode,
                    AddJiggleNode,
                    AddPoseInterpolatorNode,
                    AddTripwireNode,
                    AddMathNodes,
                    AddExpressionNode,
                    AddUtilityNodes,
                    AddMatrixNodes,
                    AddSelectionNodes,
                    AddConstraintNodes,
                    AddVrmConstraintNodes,
                    AddVrmExpressionNodes,
                    AddIkNodes,
                    AddSpaceSwitchNode,
                    AddSplineIkNode,
                    AddTwistDistributionNode,
                    AddLightNodes,
                    AddIlluminationNodes}) {
    add(registry);
  }
}

}  // namespace kpsa::engine
