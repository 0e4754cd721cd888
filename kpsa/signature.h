// The identity of the rig that a subspace was trained on: one digest for every node and attribute that its
// points depend on. Controls and clips are no part of it; their ranges are (kpsa/signals.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "graph/graph.h"

namespace kpsa {

using Signature =
    std::map<std::string, std::string>;  // "mush.iterations" -> digest; "mush" -> type and connections

// A rig within another one: its nodes' names begin with `prefix`, and hang under `root`. It has the identity
// of the rig alone, and in a subspace things are called as there.
struct RigWithin {
  std::string prefix;
  NodeId root;
  std::string Inner(const std::string& name) const {
    return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
  }
};

// Everything upstream of `outputs` and `space`. Poses (Graph::Pose) of the plugs in `controls` and of the
// transforms from `space` up to the root are left out, and clips with what they drive; what is set for the
// rest state is not.
Signature RigSignature(const Graph& graph, const std::vector<PlugRef>& outputs,
                       const std::vector<PlugRef>& space, const std::vector<PlugRef>& controls,
                       const RigWithin& within = {});
// "" if they agree, else what differs, at most three entries by name.
std::string SignatureDifference(const Signature& trained, const Signature& now);
std::string SignatureDigest(const Signature& signature);

}  // namespace kpsa
