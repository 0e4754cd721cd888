#include "tests/fuzz/played_rig.h"

#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "nodes/standard_nodes.h"
#include "tests/fuzz/fuzzer.h"

namespace kpsa::engine {

const NodeRegistry& FuzzedRegistry() {
  static const NodeRegistry* const registry = [] {
    auto* nodes = new NodeRegistry;
    AddStandardNodes(*nodes);
    return nodes;
  }();
  return *registry;
}

void PlayMeshes(const Graph& graph, const CharacterGraph& scene, std::vector<PlugRef> varying) {
  constexpr Index kMostPoints = 20'000;
  Request request;
  std::vector<Index> points;
  for (const CharacterMesh& mesh : scene.meshes) {
    if (mesh.mesh().point_count() > kMostPoints) continue;
    request.outputs.push_back({mesh.points, {}});
    points.push_back(mesh.mesh().point_count());
  }
  if (graph.CheckPlug(scene.time).ok() && graph.FindConnection(scene.time) == nullptr)
    request.varying.push_back(scene.time);
  const std::size_t controls = request.varying.size();
  request.varying.insert(request.varying.end(), varying.begin(), varying.end());
  Compiler compiler;
  const Result<std::shared_ptr<const Plan>> plan = compiler.Compile(graph, request);
  if (!plan.ok()) return RequireRefusal(plan.status());
  Evaluator evaluator(*plan);
  for (const double time : {0.0, 0.4}) {
    for (std::size_t v = 0; v < request.varying.size(); ++v) {
      const Result<PlugHandle> handle = evaluator.FindVarying(graph, request.varying[v]);
      if (!handle.ok()) continue;
      if (v < controls) {
        (void)evaluator.Set(*handle, Value(time));
      } else if (time > 0) {
        (void)evaluator.Set(*handle, Value(handle->IsWholeNumber() ? 1.0 : 0.3));  // where it may be that
      }
    }
    const Status status = evaluator.Evaluate();
    if (!status.ok()) {
      RequireRefusal(status);
      continue;
    }
    if (!points.empty()) Reached("played");
    for (Index output = 0; output < points.size(); ++output)
      Require(evaluator.Points(output).count == points[output], "a mesh of another number of points");
  }
}

}  // namespace kpsa::engine
