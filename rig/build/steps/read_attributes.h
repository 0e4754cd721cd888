// A step of rig_builder.cpp. What nodes of the file write for their attributes.
// Reads: their keys. Writes: values in the graph, connections to make (in the reader), and in the nodes the keys that
// are no attributes.
#pragma once

#include "rig/build/plug_reader.h"

namespace kpsa::engine {

void ReadAttributes(const BuildInput& in, MadeNodes* nodes, PlugReader* reader, Graph* graph);

}  // namespace kpsa::engine
