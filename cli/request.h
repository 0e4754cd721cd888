// What a command is to look at, as users name it: meshes, stages and plugs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/acceleration.h"
#include "graph/plan.h"
#include "io/rig_builder.h"

namespace kpsa {

// A mesh's points: "head_mesh" (the final ones) or "head_mesh@mush" (up to and including a stage). Errors
// name the nearest mesh or stage.
struct MeshStage {
  const CharacterMesh* mesh = nullptr;
  PlugRef points;
};
Result<MeshStage> FindMeshStage(const Rig& rig, std::string_view text);

// A plug ("jaw.worldMatrix", "cage.points[2,0,4].y") or a mesh's points.
struct WantedPlug {
  PlugRef plug;                         // as written, with element and component
  const CharacterMesh* mesh = nullptr;  // of a mesh's points
};
Result<WantedPlug> FindWanted(const Rig& rig, std::string_view text);

// A request for plugs (the final points of the meshes that are shown where there are none), restricted to
// some vertices of the file: ranges and indices ("0:99,120") into each wanted mesh. Time varies.
Result<Request> BuildRequest(const Rig& rig, const std::vector<std::string>& wanted,
                             const std::optional<std::string>& vertices);

// The same with the subspaces in place that the flags ask for, if they do. Colours that a subspace gives are
// asked of it, and are wanted besides the meshes where nothing is named.
Result<Request> AcceleratedRequest(Rig* rig, Compiler* compiler, const AccelerationFlags& flags,
                                   const std::vector<std::string>& wanted,
                                   const std::optional<std::string>& vertices);

}  // namespace kpsa
