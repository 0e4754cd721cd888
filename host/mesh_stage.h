// Plugs and points of meshes as users name them.
#pragma once

#include <string_view>

#include "base/status.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

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

}  // namespace kpsa::engine
