// What the viewer's page shows of a rig whatever plays (docs/viewer-data.md): who it is, meshes, controls.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "host/control_reach.h"
#include "report/page_data.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// A text as JSON; what is no UTF-8 is replaced.
std::string PageText(const std::string& text);

// V: the vertices of all shown meshes, one mesh after the other, each in its file's order.
std::size_t StackedVertices(const Rig& rig);
// title, rig, character, program and unit.
void PutRigNames(const Rig& rig, PageData* page);
// points, meshes and rest. `rest` is [V, 3]: x y z, metres, world space, no clip plays.
void PutMeshes(const Rig& rig, std::span<const float> rest, PageData* page);
// Its own key: those of the rig in its order, values in the file's units; and what each moves, where that is known
// (reaches: one a control, or none).
void PutControls(const Rig& rig, PageData* page, std::span<const ControlReach> reaches = {});

}  // namespace kpsa::engine
