// kpsa: evaluates character rigs. All of the public face; it includes the standard library and nothing else.
// Link kpsa::kpsa (find_package(kpsa), or add_subdirectory).
//
//   kpsa::Library library;                                  // node types; plugins are added here
//   auto rig = library.Load("face.yaml");                   // or every error with its place
//   if (!rig) return Complain(rig.problems());
//   kpsa::Scene scene(*rig);                                // one a thread
//   scene.Set("jaw.rotateX", -20);                          // in the rig's units: degrees
//   std::span<const float> xyz = *scene.Points("head_mesh");  // x y z a vertex, in the file's order; world,
//   metres
#pragma once

#include "kpsa/bench.h"       // IWYU pragma: export
#include "kpsa/edit.h"        // IWYU pragma: export
#include "kpsa/graph_info.h"  // IWYU pragma: export
#include "kpsa/library.h"     // IWYU pragma: export
#include "kpsa/node_type.h"   // IWYU pragma: export
#include "kpsa/result.h"      // IWYU pragma: export
#include "kpsa/rig.h"         // IWYU pragma: export
#include "kpsa/scene.h"       // IWYU pragma: export
