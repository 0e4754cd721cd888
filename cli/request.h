// What a command is to look at, as users name it: meshes, stages and plugs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/acceleration.h"
#include "graph/plan.h"
#include "host/explain/vertex_story.h"
#include "host/mesh_stage.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// A request for plugs (the final points of the meshes that are shown where there are none), restricted to
// some vertices of the file: ranges and indices ("0:99,120") into each wanted mesh. Time varies.
Result<Request> BuildRequest(const Rig& rig, const std::vector<std::string>& wanted,
                             const std::optional<std::string>& vertices);

// The same with the subspaces in place that the flags ask for, if they do. Colours that a subspace gives are
// asked of it, and are wanted besides the meshes where nothing is named.
Result<Request> AcceleratedRequest(Rig* rig, Compiler* compiler, const AccelerationFlags& flags,
                                   const std::vector<std::string>& wanted,
                                   const std::optional<std::string>& vertices);

// "head_mesh[812]": the vertex counts over the file's primitives of the mesh. No value where the text does
// not look like one; errors (of usage): no such mesh, no such vertex.
Result<std::optional<VertexName>> FindVertex(const Rig& rig, const std::string& text);

}  // namespace kpsa::engine
