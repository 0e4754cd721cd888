// Compressed geometry of a glTF document: buffer views of EXT_meshopt_compression and primitives of
// KHR_draco_mesh_compression. What they decode to becomes further buffers, views and accessors of the
// document, so that its readers see plain ones. Nothing outside gltf/ includes this.
//
// The decoders trust no count: what a few bytes may decode to is limited before anything is allocated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace tinygltf {
class Model;
}

namespace kpsa::engine::gltf {

struct Document;

// A buffer view as EXT_meshopt_compression describes it. Numbers are below 2^53, `buffer` is a buffer.
struct MeshoptView {
  std::size_t view = 0;  // which of the document's
  std::size_t buffer = 0;
  std::uint64_t offset = 0, length = 0;  // of the compressed bytes
  std::uint64_t stride = 0, count = 0;   // of what they decode to
  std::string mode, filter;
};

// A primitive as KHR_draco_mesh_compression describes it; all indices are in range.
struct DracoPrimitive {
  std::size_t mesh = 0, primitive = 0;
  std::size_t view = 0;                             // the compressed bytes
  std::map<std::string, std::uint32_t> attributes;  // by glTF name: the unique id in the compressed data
};

// Decodes all of them. Errors name the place in the document.
Status Decompress(const std::vector<MeshoptView>& views, const std::vector<DracoPrimitive>& primitives,
                  tinygltf::Model* model, Document* document);

// --- The decoders, each behind its library.
// count * stride bytes. The rules of the extension for mode, filter and stride are checked here.
Result<std::vector<std::uint8_t>> DecodeMeshopt(const MeshoptView& view, std::span<const std::uint8_t> data);

// One attribute that is wanted of a Draco mesh, in a component type of glTF (5120 ...).
struct DracoAttribute {
  std::string name;  // for messages
  std::uint32_t unique_id = 0;
  int component_type = 0;
  int components = 0;
  std::vector<std::uint8_t> values;  // result: `points` * components, tightly packed
};
struct DracoMesh {
  std::size_t points = 0;        // how many there are to be
  std::size_t most_indices = 0;  // the most indices there may be
  std::vector<DracoAttribute> attributes;
  std::vector<Index> triangles;  // result; not checked against `points`
  std::uint64_t memory = 0;      // result: what decoding took, about
};
// In the order in which Draco decodes points and faces.
Status DecodeDraco(std::span<const std::uint8_t> data, DracoMesh* mesh);

}  // namespace kpsa::engine::gltf
