// A step of rig_builder.cpp. What overrides write for single plugs. Values are set at once; connections wait.
// Reads: what is left of `overrides`. Writes: values in the graph; in the reader connections to make and what is
// overridden.
#pragma once

#include "rig/build/plug_reader.h"

namespace kpsa::engine {

void ReadOverrides(const BuildInput& in, PlugReader* reader, Graph* graph);

}  // namespace kpsa::engine
