// The accelerated points of an evaluation in the space of their target, and how far two such sets are apart.
// Internal to training.
#pragma once

#include <vector>

#include "graph/evaluator.h"
#include "kpsa/accelerate.h"
#include "kpsa/space_frame.h"

namespace kpsa::engine {

// Requests the target's points and, last, the matrix of its space where it has one.
Request SpacePointsRequest(const AccelerationTarget& target);
// Of an evaluator of that request (more outputs may follow), in double: x0 y0 z0 x1 ...; `size`, if given, is
// the largest magnitude of a coordinate before it was taken into the space, which bounds its rounding.
void SpacePoints(const Evaluator& evaluator, const AccelerationTarget& target,
                 const Matrix4& inverse_rest_stretch, std::vector<double>* points, double* size = nullptr);
// The largest distance of a point; infinite where something is not finite.
double LargestDistance(const std::vector<double>& a, const std::vector<double>& b);

// The translate, rotate and scale of a transform that nothing drives: plugs of their components.
struct FreeTransform {
  std::vector<PlugRef> translate, rotate, scale;  // 3 each, or none where driven
};
FreeTransform FreePlugs(const Graph& graph, NodeId node);

// A plug that varies in the evaluator's plan, or whose whole does; nothing where neither does.
void SetPlug(Evaluator* evaluator, const PlugRef& plug, double value);

}  // namespace kpsa::engine
