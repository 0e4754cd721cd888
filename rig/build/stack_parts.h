// Inside of the rig builder: what the stacks of meshes and of points have in common. Nothing outside rig/build
// includes this.
#pragma once

#include "graph/geometry.h"
#include "rig/build/made_nodes.h"

namespace kpsa::engine {

// Stacks are those of the file that a mesh or an attribute comes from: false, with an error, for a reference's.
bool IsOwn(const BuildInput& in, NodeId node, const RigString& name);

// The deformer that a stack names; null after an error.
MadeNode* FindDeformer(const BuildInput& in, const RigString& name, MadeNodes* nodes);

// The next geometry of a deformer. All that one deformer serves lie before a skin or all after one. False after an
// error.
bool AddGeometry(const BuildInput& in, DeformedGeometry geometry, bool world, const SourceLocation& where,
                 MadeNode* made, Graph* graph);

// Where a geometry of a deformer before the skin lies at rest.
void SetWorldFromStage(const BuildInput& in, std::size_t geometry, const Matrix4& world_from_stage,
                       MadeNode* made, Graph* graph);

// The weights of a deformer's geometry that are set; null: all are 1.
const WeightMap* WeightsOf(const MadeNode& made, std::size_t geometry, Graph* graph);

}  // namespace kpsa::engine
