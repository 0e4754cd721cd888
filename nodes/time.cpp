#include "nodes/node_file.h"

namespace kpsa::engine {

KPSA_NODES(time, registry) {
  registry.add("time", "The time of the scene. Read `time.time` as a source.")
      .category("time")
      .in("time", 0.0, {.unit = Unit::kTime, .doc = "seconds"});
}

}  // namespace kpsa::engine
