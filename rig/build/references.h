// Inside of the rig builder: rigs within rigs, and what their characters play. Nothing outside rig/build
// includes this.
//
// A referenced rig is loaded as if it stood alone, at rest, and then taken over as a whole: its graph under a
// namespace, its character behind those that are there. At rest every character stands where its own file
// has it, so that all that binds there is what it is alone; `translate` is a pose of the transform that
// carries the character.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// A rig while it is put together: its character can still be changed.
struct LoadedRig {
  Rig rig;
  std::shared_ptr<gltf::Character> character;
};

// How a file asks for a rig.
struct ReferencePlace {
  std::string name;  // "hero"
  std::string file;
  Double3 translate;                // metres
  double start = 0;                 // seconds
  std::optional<std::string> clip;  // unset: the first one
  SourceLocation where;             // of the name
};

// Takes over a rig that was loaded at rest. Errors: a node of that name, an unknown clip, too many points.
Status AddReference(const ReferencePlace& place, LoadedRig from, LoadedRig* to);

// The reference of the rig itself that brought a node; null for its own nodes.
const Reference* ReferenceOf(const Rig& rig, NodeId node);
// Whether the node is the transform that carries a referenced character.
bool IsReferenceRoot(const Rig& rig, NodeId node);

// Every character plays its own clip.
Status PlayOwnClips(Rig* rig);

}  // namespace kpsa::engine
