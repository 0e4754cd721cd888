// What a primitive's vertices look like: colours, texture coordinates and normals. Nothing outside gltf/ includes
// this.
#pragma once

#include <map>
#include <string>

#include "gltf/document.h"

namespace tinygltf {
struct Primitive;
}

namespace kpsa::engine::gltf {

constexpr unsigned kPositionTypes = kFloat | kAnyInteger16;  // integers: KHR_mesh_quantization

// The accessor of an attribute, or -1.
int FindAttribute(const std::map<std::string, int>& attributes, const std::string& name);
// Whether an accessor has as many elements as POSITION; `what` for messages.
Status CheckCount(const Document& document, int accessor, std::size_t expected, const std::string& what);

// Appends those of a primitive whose positions are read; where it has none of a kind, and others had, what stands for
// none (gltf/import.h).
Status ReadVertexLook(const Document& document, const tinygltf::Primitive& in, const std::string& where,
                      const Primitive& primitive, Mesh* mesh);

}  // namespace kpsa::engine::gltf
