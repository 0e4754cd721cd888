#include "kpsa/training/space_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/matrix.h"

namespace kpsa::engine {

Request SpacePointsRequest(const AccelerationTarget& target) {
  Request request;
  for (const PlugRef& points : target.outputs()) request.outputs.push_back({points, {}});
  for (const PlugRef& space : target.space) request.outputs.push_back({space, {}});
  request.varying = target.varying;
  return request;
}

void SpacePoints(const Evaluator& evaluator, const AccelerationTarget& target,
                 const Matrix4& inverse_rest_stretch, std::vector<double>* points, double* size) {
  points->clear();
  const auto meshes = static_cast<Index>(target.meshes.size());
  Matrix4 space_from_world;
  if (!target.space.empty()) {
    space_from_world = InverseOrIdentity(
        SpaceFrameOf(evaluator.Get<Matrix4>(meshes), inverse_rest_stretch).world_from_space);
  }
  double largest = 0;
  for (Index m = 0; m < meshes; ++m) {
    const ConstPointsView p = evaluator.Points(m);
    const bool world = target.meshes[m].stages.back().world;
    for (std::size_t i = 0; i < p.count; ++i) {
      const Double3 at{p.x[i], p.y[i], p.z[i]};
      largest = std::max({largest, std::fabs(at.x), std::fabs(at.y), std::fabs(at.z)});
      const Double3 in_space = world ? TransformPoint(space_from_world, at) : at;
      points->insert(points->end(), {in_space.x, in_space.y, in_space.z});
    }
  }
  if (size != nullptr) *size = largest;
}

double LargestDistance(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3) {
    const Double3 d{a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]};
    const double squared = Dot(d, d);
    if (!std::isfinite(squared)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, squared);
  }
  return std::sqrt(largest);
}

FreeTransform FreePlugs(const Graph& graph, NodeId node) {
  FreeTransform free;
  const auto components = [&](const char* name) {
    std::vector<PlugRef> plugs;
    const int attribute = graph.def(node).FindAttribute(name);
    if (attribute < 0 || graph.FindConnection({node, attribute, -1, -1}) != nullptr) return plugs;
    for (int c = 0; c < 3; ++c) {
      plugs.push_back({node, attribute, -1, c});
      if (graph.FindConnection(plugs.back()) != nullptr) return std::vector<PlugRef>();
    }
    return plugs;
  };
  free.translate = components("translate");
  free.rotate = components("rotate");
  free.scale = components("scale");
  return free;
}

void SetPlug(Evaluator* evaluator, const PlugRef& plug, double value) {
  const PlugHandle handle = evaluator->plan().Handle(plug);
  if (!handle) return;
  if (handle.IsWholeNumber()) {
    evaluator->SetInt(handle.varying, static_cast<std::int64_t>(value));
  } else {
    evaluator->Set(handle.varying, value, handle.component);
  }
}

}  // namespace kpsa::engine
