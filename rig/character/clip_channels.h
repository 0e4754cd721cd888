// The channels of a clip, gathered by the node that they move. Inside of rig/character.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "graph/geometry.h"
#include "gltf/import.h"

namespace kpsa::engine {

struct NodeKeys {
  AnimationKeys::Data data;
  bool moves = false, morphs = false;  // the transform; the weights
};

// By glTF node. What a clip says twice is noted once.
std::map<Index, NodeKeys> KeysByNode(const gltf::Character& character, const gltf::Clip& clip,
                                     std::vector<std::string>* notes);

}  // namespace kpsa::engine
