// What a character consists of, as tables of facts: its tree of nodes, its morph targets, clips and materials.
#pragma once

#include "gltf/import.h"
#include "host/vertex_choice.h"
#include "report/file_facts.h"

namespace kpsa::engine {

// Every node, children after their parents; a joint with the skins that it is of.
FactTable TreeFacts(const gltf::Character& character);
FactTable MorphFacts(const gltf::Character& character);
FactTable MaterialFacts(const gltf::Character& character);
// From the first frame to the last at `fps` frames a second, both counted.
std::uint64_t FrameCount(double seconds, double fps);

// Which vertices something has, and which vertex is nearest to a place (host/vertex_choice.h).
Result<FileFacts> VerticesFacts(const Rig& rig, const std::string& name);
Result<FileFacts> NearestFacts(const Rig& rig, Double3 place);

}  // namespace kpsa::engine
