// The identity of the rig that a subspace was trained on: one digest for every node and attribute that its
// points depend on. Controls and clips are no part of it; their ranges are (kpsa/signals.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "graph/graph.h"

namespace kpsa::engine {

struct NodeSignature {
  std::string node;                               // digest of its type and connections
  std::map<std::string, std::string> attributes;  // by name; only what is set
  friend bool operator==(const NodeSignature&, const NodeSignature&) = default;
};
using Signature = std::map<std::string, NodeSignature>;  // by the node's name, which may hold anything

// What a subspace says of the rig that it was trained on.
struct TrainedRig {
  Signature signature;
  std::vector<std::string>
      controls;  // plugs, as Graph::PlugName: what may be posed within the trained ranges
  friend bool operator==(const TrainedRig&, const TrainedRig&) = default;
};

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

// A value that differs from what the rig says (Graph::WrittenValues): of --set and pose files.
struct SetHere {
  PlugRef plug;             // a component by itself
  std::string name, value;  // as people write them: "upperarm01.L.rotateX", "20 deg"
  bool structural = false;
  bool carries = false;  // of a transform from `space` up to the root
};
// All of them upstream, but those that training had, too. `now` (RigSignature of the same) then has what the
// rig says in their place, so that what still differs from `trained` is the rig.
std::vector<SetHere> TakeSetHere(const Graph& graph, const std::vector<PlugRef>& outputs,
                                 const std::vector<PlugRef>& space, const std::vector<PlugRef>& controls,
                                 const RigWithin& within, const Signature& trained, Signature* now);

}  // namespace kpsa::engine
