#include "io/rig_builder.h"

#include "io/rig_build.h"

namespace kpsa {

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

}  // namespace kpsa
