// A rig, loaded and evaluated, with time and all of its controls varying.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "base/matrix.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "tests/rig/rig_fixture.h"

namespace kpsa::engine {

class RigPlayer {
 public:
  explicit RigPlayer(const std::string& path, const RigOptions& options = {}) {
    Result<Rig> loaded = LoadRig(StandardRegistry(), path, options);
    EXPECT_TRUE(loaded.ok()) << loaded.status().ToString();
    if (!loaded.ok()) return;
    rig = std::move(*loaded);
    request_.varying.push_back(rig.scene.time);
    for (const Control& control : rig.controls) {
      if (rig.graph->FindConnection(control.plug) == nullptr) request_.varying.push_back(control.plug);
    }
    for (const CharacterMesh& mesh : rig.scene.meshes) Want(mesh.points);
    Compile();
  }
  bool ok() const { return evaluator_ != nullptr; }

  void Set(const std::string& name, double value) {
    ASSERT_NE(evaluator_, nullptr);
    const Result<PlugRef> plug = rig.graph->FindPlug(name);
    ASSERT_TRUE(plug.ok()) << plug.status().ToString();
    const Result<PlugHandle> handle = evaluator_->FindVarying(*rig.graph, *plug);
    ASSERT_TRUE(handle.ok()) << handle.status().ToString();
    const Status set = evaluator_->Set(*handle, value);
    ASSERT_TRUE(set.ok()) << set.ToString();
    settings_.emplace_back(name, value);
  }
  // Points in their own order: of a mesh's last stage, or of one by name (head_mesh@skin is Points("skin",
  // 0)).
  std::vector<Double3> Points(std::size_t mesh = 0) { return PointsOf(rig.scene.meshes.at(mesh).points); }
  std::vector<Double3> Points(const std::string& stage, std::size_t mesh = 0) {
    const Stage* found = rig.scene.meshes.at(mesh).FindStage(stage);
    EXPECT_NE(found, nullptr) << stage;
    return found == nullptr ? std::vector<Double3>() : PointsOf(found->points);
  }
  Matrix4 World(const std::string& transform) {
    const Result<PlugRef> plug = rig.graph->FindPlug(transform + ".worldMatrix");
    EXPECT_TRUE(plug.ok()) << plug.status().ToString();
    const std::size_t output = Want(*plug);
    Pull(output);
    return evaluator_->Get<Matrix4>(static_cast<Index>(output));
  }
  Index PointOf(Index vertex, std::size_t mesh = 0) const {
    return rig.scene.meshes.at(mesh).mesh().data().vertex_to_point.at(vertex);
  }

  Rig rig;

 private:
  // The output of a plug; a new one needs a new plan, which takes over what was set.
  std::size_t Want(const PlugRef& plug) {
    for (std::size_t i = 0; i < request_.outputs.size(); ++i) {
      if (request_.outputs[i].plug == plug) return i;
    }
    request_.outputs.push_back({plug, {}});
    if (evaluator_ != nullptr) {
      Compile();
      const std::vector<std::pair<std::string, double>> settings = std::move(settings_);
      settings_.clear();
      for (const auto& [name, value] : settings) Set(name, value);
    }
    return request_.outputs.size() - 1;
  }
  void Compile() {
    Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(*rig.graph, request_);
    EXPECT_TRUE(plan.ok()) << plan.status().ToString();
    evaluator_ = plan.ok() ? std::make_unique<Evaluator>(*plan) : nullptr;
  }
  void Pull(std::size_t output) {
    const Status status = evaluator_->Pull(static_cast<Index>(output));
    EXPECT_TRUE(status.ok()) << status.ToString();
  }
  std::vector<Double3> PointsOf(const PlugRef& plug) {
    const std::size_t output = Want(plug);
    Pull(output);
    const ConstPointsView view = evaluator_->Points(static_cast<Index>(output));
    std::vector<Double3> points;
    for (std::size_t i = 0; i < view.count; ++i) points.push_back({view.x[i], view.y[i], view.z[i]});
    return points;
  }

  Request request_;
  std::vector<std::pair<std::string, double>> settings_;
  Compiler compiler_;
  std::unique_ptr<Evaluator> evaluator_;
};

// The largest distance of corresponding points; huge where one is not finite.
inline double MaxDistance(const std::vector<Double3>& a, const std::vector<Double3>& b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const double d = Length(a[i] - b[i]);
    worst = d <= worst ? worst : d;
    if (!(d < 1e30)) worst = 1e30;
  }
  return worst;
}

}  // namespace kpsa::engine
