// Inside of the glTF reader: a document whose structure was checked, its buffers, and its accessors.
// Nothing outside gltf/ includes this.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gltf/compressed.h"
#include "gltf/import.h"

namespace tinygltf {
class Model;
}

namespace kpsa::engine::gltf {

constexpr std::uint64_t kLargestFile = std::uint64_t{4} << 30;  // bytes, as the lengths in a GLB

// What a document may still allocate and compute: a few bytes that name one accessor a million times must not
// become gigabytes.
struct Budget {
  std::uint64_t memory = 0;  // bytes kept in the Character
  std::uint64_t work = 0;    // bytes decoded
  Status TakeMemory(std::uint64_t bytes, const std::string& what);
  Status TakeWork(std::uint64_t bytes, const std::string& what);
};

// Every index in `model` is within its array, every number array has its proper length, and lengths, offsets
// and counts are non-negative; whether data lies within the buffers is checked where it is read.
struct Document {
  std::shared_ptr<const tinygltf::Model> model;        // buffers, images and textures left out
  std::vector<std::vector<std::uint8_t>> buffers;      // empty where the file gives no data
  std::vector<std::vector<std::string>> target_names;  // [mesh][target] from mesh.extras.targetNames
  int no_view = 0;                                     // accessors without a buffer view name this one
  std::vector<std::size_t> hidden;                     // nodes that are not shown, nor what is below them
  std::string vrm;                                     // what ReadVrm reads, as JSON; may be empty
  std::vector<std::string> warnings;
  mutable Budget budget;
};

// The container's parts: the JSON text, and the binary chunk of a .glb.
struct Container {
  std::span<const std::uint8_t> json;
  std::span<const std::uint8_t> binary;
  bool is_binary = false;
};
Result<Container> SplitContainer(std::span<const std::uint8_t> bytes);

// A buffer as the document describes it.
struct BufferSource {
  bool has_uri = false;
  std::string uri;
  std::uint64_t byte_length = 0;
  bool is_fallback = false;  // of EXT_meshopt_compression: nobody reads it
};
// The structure of the text, checked and reduced to what is read: `text` for tinygltf, the rest beside it.
struct ReducedJson {
  std::string text;
  std::vector<BufferSource> buffers;
  std::vector<std::vector<std::string>> target_names;
  int no_view = 0;
  std::vector<MeshoptView> meshopt;
  std::vector<DracoPrimitive> draco;
  std::vector<std::size_t> hidden;
  std::string vrm;
  std::vector<std::string> warnings;
};
Result<ReducedJson> ReduceJson(std::span<const std::uint8_t> text);

// The bytes of a data URI (base64 or percent-encoded).
Result<std::vector<std::uint8_t>> DecodeDataUri(const std::string& uri);
// The path below its folder that a relative URI names; an error for schemes, absolute paths and ways out by
// "..".
Result<std::string> RelativePathOfUri(const std::string& uri);

// What a URI stands for: of a data URI its bytes, else the file in `folder`, of at most `most` bytes.
Result<std::vector<std::uint8_t>> ReadUri(const std::string& uri, const std::string& folder,
                                          std::uint64_t most);

Result<Document> LoadDocument(std::span<const std::uint8_t> bytes, const std::string& folder);

// --- Accessors. `what` names the user in messages: "meshes[0].primitives[1].POSITION".
// Component types that a use allows.
enum ComponentTypes : unsigned {
  kByte = 1,
  kUnsignedByte = 2,
  kShort = 4,
  kUnsignedShort = 8,
  kUnsignedInt = 16,
  kFloat = 32,
  kAnyInteger16 = kByte | kUnsignedByte | kShort | kUnsignedShort,
};
std::size_t AccessorCount(const Document& document, int accessor);
// Reads all elements, `components` numbers each; normalised integers become [-1, 1] or [0, 1], others keep
// their value. Everything is finite. T is float or double.
template <typename T>
Status ReadNumbers(const Document& document, int accessor, int components, unsigned types,
                   const std::string& what, std::vector<T>* values);
// The same of directions: an element that is not finite becomes three that are not a number.
Status ReadDirections(const Document& document, int accessor, unsigned types, const std::string& what,
                      std::vector<float>* values);
// Reads elements of unsigned integers.
Status ReadIndices(const Document& document, int accessor, int components, unsigned types,
                   const std::string& what, std::vector<Index>* values);
// As ReadNumbers<float> of three components, but only the elements that are not zero, by ascending index; a
// sparse accessor without a base costs what it stores.
Status ReadSparseVectors(const Document& document, int accessor, unsigned types, const std::string& what,
                         std::vector<Index>* indices, std::vector<float>* values);

// --- The parts of a Character, in this order.
Status ReadScene(const Document& document, Character* character);
Status ReadMeshes(const Document& document, Character* character);
Status ReadSkins(const Document& document, Character* character);
Status ReadClips(const Document& document, Character* character);
Status ReadVrm(const Document& document, Character* character);

}  // namespace kpsa::engine::gltf
