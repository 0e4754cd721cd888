#include "rig/build/rig_builder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rig/build/rig_build.h"

namespace kpsa::engine {
namespace {

double RestDiagonal(const CharacterGraph& scene, RestPose* rest) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Double3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    for (const Double3& p : rest->WorldPoints(m)) {
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], p[i]);
        high[i] = std::max(high[i], p[i]);
      }
    }
  }
  const double diagonal = Length(high - low);
  return std::isfinite(diagonal) ? diagonal : 0;
}

}  // namespace

RigBuild::RigBuild(RigFile* file, Rig* rig, RestPose* rest, YamlErrors* errors)
    : file_(file), rig_(rig), rest_(rest), errors_(errors), stack_of_mesh_(rig->scene.meshes.size()) {
  for (std::size_t n = 0; n < file->nodes.size(); ++n) written_.emplace(file->nodes[n].name, n);
  for (Index i = 0; i < rig->character->nodes.size(); ++i) {
    const std::string& name = rig->character->nodes[i].name;
    gltf_by_name_[name.empty() ? fmt::format("node{}", i) : name].push_back(i);
    gltf_by_node_[rig->scene.transforms[i].index] = i;
  }
}

void RigBuild::Run() {
  AddClips();
  ResolveScopes();
  ApplySpecialOverrides();
  for (Made& made : own_made_) SetInfluences(&made);
  rig_->rest_diagonal = RestDiagonal(rig_->scene, rest_);
  AddNodes();
  for (Made& made : made_) {
    if (!errors_->full()) ReadAttributes(&made);
  }
  ReadOverrides();
  for (std::vector<Made>* all : {&made_, &own_made_}) {
    for (Made& made : *all) AddShapeRules(&made);
  }
  AddCurves();
  ConnectParents();
  if (errors_->ok()) PlaceHandles();
  ConnectCurves();
  BuildStacks();
  ConnectLights();
  ConnectDrivers();
  for (Made& made : made_) SetTargets(&made);
  for (Made& made : own_made_) SetBlendWeights(&made);
  MakeConnections();
  AddConstraints();
  ConnectTime();
  PlaceStagesAtHandles();
  PlaceFalloffs();
  ConnectPivots();
  FinishOverrides();
  CheckVariants();
  AddControls();
  AddAccelerations();
}

bool RigBuild::Fail(const SourceLocation& where, Status status) {
  if (status.ok()) return true;
  errors_->Append(std::move(status).At(where));
  return false;
}

RigBuild::Made* RigBuild::FindMade(const std::string& name) {
  const auto it = made_by_name_.find(name);
  return it == made_by_name_.end() ? nullptr : &made_[it->second];
}

RigBuild::Made* RigBuild::FindMade(NodeId id) {
  const auto it = made_by_node_.find(id.index);
  return it == made_by_node_.end() ? nullptr : &made_[it->second];
}

}  // namespace kpsa::engine
