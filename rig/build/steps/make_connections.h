// A step of rig_builder.cpp. Connections, with unit conversions. What a node or a connection asks for gives way to
// overrides; what a clip drives is only taken over where the file says so.
// Reads: `connections`, what was read of nodes and overrides. Writes: connections and unitConversion nodes in the
// graph.
#pragma once

#include <vector>

#include "rig/build/build_input.h"
#include "rig/build/plug_keys.h"

namespace kpsa::engine {

void MakeConnections(const BuildInput& in, const std::vector<PendingConnection>& pending,
                     const OverriddenPlugs& overridden, Graph* graph);

}  // namespace kpsa::engine
