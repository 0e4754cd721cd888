// Every node type is at work in a rig: those of scenes/ and tests/rigs/nodes, validated, evaluated, and their
// subsets compared with the whole.
#include <cmath>
#include <filesystem>
#include <random>
#include <set>

#include "tests/rig/rig_player.h"

namespace kpsa::engine {
namespace {

struct NodeRig {
  const char* path;  // below the sources
  const char* clip;  // "": none
  bool played;       // evaluated here; scenes are elsewhere
};
const NodeRig kRigs[] = {
    {"scenes/hello/hello.yaml", "wave", false},    {"scenes/face/face.yaml", "talk", false},
    {"scenes/gi/gi.yaml", "dance", false},         {"tests/rigs/nodes/constraints.yaml", "", true},
    {"tests/rigs/nodes/deformers.yaml", "", true}, {"tests/rigs/nodes/drivers.yaml", "shot", true},
    {"tests/rigs/nodes/plate.yaml", "", true},     {"tests/rigs/nodes/utilities.yaml", "", true},
    {"tests/rigs/nodes/doll.yaml", "", true},
};

Result<Rig> Open(const NodeRig& of) {
  RigOptions options;
  options.rest = of.clip[0] == '\0';
  if (!options.rest) options.clip = of.clip;
  return LoadRig(StandardRegistry(), std::string(KPSA_SOURCE_DIR "/") + of.path, options);
}

TEST(NodeRigs, UseEveryTypeOfNode) {
  std::set<std::string> unused;
  for (const std::string& name : StandardRegistry().Names()) unused.insert(name);
  for (const NodeRig& of : kRigs) {
    const Result<Rig> rig = Open(of);
    ASSERT_TRUE(rig.ok()) << of.path << ": " << rig.status().ToString();
    EXPECT_TRUE(!of.played || rig->notes.empty()) << rig->notes[0];
    for (const NodeId node : rig->graph->Nodes()) unused.erase(rig->graph->def(node).name);
  }
  EXPECT_EQ(unused, std::set<std::string>()) << "write a rig that uses them, in tests/rigs/nodes";
}

// One evaluation at a pose of the controls; frame 0 is at the first of them.
std::vector<std::vector<float>> PlayedFrames(const Rig& rig, const PlugRef& points, const PointSet& set) {
  Request request;
  request.varying.push_back(rig.scene.time);
  for (const Control& control : rig.controls) request.varying.push_back(control.plug);
  request.outputs.push_back({points, set});
  Compiler compiler;
  const Result<std::shared_ptr<const Plan>> plan = compiler.Compile(*rig.graph, request);
  EXPECT_TRUE(plan.ok()) << plan.status().ToString();
  std::vector<std::vector<float>> frames;
  if (!plan.ok()) return frames;
  Evaluator evaluator(*plan);
  for (int frame = 0; frame < 4; ++frame) {
    for (std::size_t v = 0; v < request.varying.size(); ++v) {
      const Result<PlugHandle> handle = evaluator.FindVarying(*rig.graph, request.varying[v]);
      if (!handle.ok()) continue;  // nothing wanted depends on it
      if (v == 0) {
        EXPECT_TRUE(evaluator.Set(*handle, 0.25 * frame).ok());
        continue;
      }
      const Control& control = rig.controls[v - 1];
      const double share = 0.5 + 0.45 * std::sin(1.7 * frame + static_cast<double>(v));
      const Status set = evaluator.Set(*handle, control.min + share * (control.max - control.min));
      EXPECT_TRUE(set.ok()) << set.ToString();
    }
    const Status status = evaluator.Evaluate();
    EXPECT_TRUE(status.ok()) << status.ToString();
    const ConstPointsView view = evaluator.Points(0);
    std::vector<float> xyz;
    for (std::size_t i = 0; i < view.count; ++i) xyz.insert(xyz.end(), {view.x[i], view.y[i], view.z[i]});
    frames.push_back(std::move(xyz));
  }
  return frames;
}

TEST(NodeRigs, MoveAndTheirSubsetsHaveTheSameBits) {
  for (const NodeRig& of : kRigs) {
    if (!of.played) continue;
    SCOPED_TRACE(of.path);
    const Result<Rig> rig = Open(of);
    ASSERT_TRUE(rig.ok()) << rig.status().ToString();
    std::mt19937 random(5);
    for (const CharacterMesh& mesh : rig->scene.meshes) {
      SCOPED_TRACE(mesh.name);
      const std::vector<std::vector<float>> whole = PlayedFrames(*rig, mesh.points, {});
      const Index total = mesh.mesh().point_count();
      double moved = 0;
      for (const std::vector<float>& frame : whole) {
        ASSERT_EQ(frame.size(), 3 * std::size_t{total});
        for (std::size_t i = 0; i < frame.size(); ++i) {
          ASSERT_TRUE(std::isfinite(frame[i])) << i;
          moved = std::max(moved, std::fabs(double{frame[i]} - whole[0][i]));
        }
      }
      EXPECT_GT(moved, 1e-3);
      for (const Index size : {1u, 7u, 40u}) {
        std::vector<Index> some;
        for (Index i = 0; i < size; ++i) some.push_back(static_cast<Index>(random() % total));
        const PointSet set = PointSet::Of(some, total);
        const std::vector<std::vector<float>> part = PlayedFrames(*rig, mesh.points, set);
        ASSERT_EQ(part.size(), whole.size());
        for (std::size_t frame = 0; frame < part.size(); ++frame) {
          for (Index i = 0; i < set.size(); ++i) {
            for (std::size_t k = 0; k < 3; ++k)
              ASSERT_EQ(part[frame][3 * std::size_t{i} + k], whole[frame][3 * std::size_t{set[i]} + k]);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace kpsa::engine
