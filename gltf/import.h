// glTF 2.0 characters (.gltf with data URIs or files beside it, .glb) as plain structs: what deforms, and
// nothing of how it is shaded. Names stay verbatim; indices are those of the file, so that messages can quote
// both.
//
// Units and spaces are glTF's, which are ours: metres, seconds, Y up, right-handed, column-major matrices.
//
// Extensions: KHR_mesh_quantization, EXT_meshopt_compression, KHR_draco_mesh_compression (vertices in the
// order in which Draco decodes them), KHR_animation_pointer (to nodes) and what gltf/vrm.h lists are read. Extensions that cannot move a
// point (KHR_texture_*, KHR_materials_*, KHR_lights_punctual, EXT_texture_*, ...) are ignored even where the
// file requires them. Any other required one is an error that names it. Images are never read here
// (gltf/textures.h).
//
// The file is hostile: JSON depth and size, container lengths, every index, count, stride and offset, every
// float and every allocation are checked first, and a buffer may not lie outside the document's folder.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/points.h"
#include "base/status.h"
#include "base/types.h"
#include "gltf/vrm.h"

namespace kpsa::engine::gltf {

struct Node {
  std::string name;  // verbatim, may be empty or shared
  Index parent = kNoIndex;
  std::vector<Index> children;
  bool has_matrix = false;  // the local transform is `matrix`, else translation, rotation, scale
  Matrix4 matrix;
  Double3 translation;
  Quaternion rotation;  // as in the file: not necessarily of unit length
  Double3 scale = {1, 1, 1};
  Index mesh = kNoIndex;
  Index skin = kNoIndex;        // only where there is a mesh
  std::vector<double> weights;  // overrides Mesh::weights where not empty
  bool in_scene = false;        // reached from the roots of the scene that is shown
  bool visible = true;          // KHR_node_visibility hides neither it nor what it hangs from
  Matrix4 LocalMatrix() const;  // the rest pose: `matrix`, or T * R * S
};

// Triangles as vertex indices into the *mesh* (first_vertex is added), three each; strips and fans are
// unrolled. Points, lines and primitives without POSITION have none.
struct Primitive {
  Index first_vertex = 0;
  Index vertex_count = 0;
  std::vector<Index> triangles;
  Index material = kNoIndex;
  bool skinned = false;  // has JOINTS_0 and WEIGHTS_0; if not, its vertices follow the node even under a skin
};

// A joint, as an index into Skin::joints, and its share.
struct Influence {
  Index joint = 0;
  float weight = 0;
};

// Displacements of some vertices; all others are still. `vertices` is ascending, indices into the mesh.
struct MorphTarget {
  std::string name;  // mesh.extras.targetNames, or ""
  std::vector<Index> vertices;
  std::vector<float> deltas;  // x y z for each of `vertices`, never all zero; mesh-local
};

// All primitives concatenated in their order: V vertices.
struct Mesh {
  std::string name;
  std::vector<float> positions;  // 3V, x y z interleaved, mesh-local
  std::vector<float> colors;     // COLOR_0, 3V linear 0 .. 1, for pictures; empty where no primitive has it
  std::vector<float> uvs;  // TEXCOORD_0, 2V; not a number where a primitive lacks it, empty where all do
  std::array<std::vector<float>, 3> more_uvs;  // TEXCOORD_1 to TEXCOORD_3, likewise
  // NORMAL, 3V, mesh-local, of the length that the file gives; not a number where a vertex has none that is
  // finite, empty where no primitive has it
  std::vector<float> normals;
  std::vector<Primitive> primitives;
  // Row v: the influences of vertex v from all JOINTS_n/WEIGHTS_n in slot order, without zeros; a joint
  // listed twice is summed. Weights are divided by their sum, as the specification wants them to be
  // (glTF 2.0, 3.7.3.3); a skinned vertex whose weights are all zero follows the joint of its first slot.
  std::vector<Index> influence_offsets;  // V + 1, or empty where no primitive is skinned
  std::vector<Influence> influences;
  std::vector<MorphTarget> targets;
  std::vector<double> weights;  // default weights, one a target
  std::size_t vertex_count() const { return positions.size() / 3; }
  // TEXCOORD_n; empty where there are none.
  const std::vector<float>& UvSet(std::size_t n) const;
  bool skinned() const { return !influence_offsets.empty(); }
  CsrView<Influence> influence_rows() const { return {influence_offsets, influences}; }
};

struct Skin {
  std::string name;
  std::vector<Index> joints;  // node indices
  std::vector<Matrix4>
      inverse_bind_matrices;  // joint_from_mesh at bind time, one a joint; identity where absent
  Index skeleton = kNoIndex;  // a hint only: joints need not be below it
};

struct Material {
  std::string name;
  std::array<double, 4> base_color = {1, 1, 1, 1};  // linear RGBA
  std::string file;                                 // where it stands
  Index index = 0;                                  // in the materials of that file
};

enum class Path : std::uint8_t { kTranslation, kRotation, kScale, kWeights };
enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };

// One animated property. Outside the keys the first or the last value holds (glTF 2.0, 3.11; appendix C).
struct Channel {
  Index node = kNoIndex;
  Path path = Path::kTranslation;
  Interpolation interpolation = Interpolation::kLinear;
  int components = 3;         // 3, 4 for rotations (x y z w), the number of targets for weights
  std::vector<double> times;  // seconds, K >= 1 keys, strictly increasing
  std::vector<double>
      values;  // K * components; kCubicSpline: 3K * components (in-tangent, value, out-tangent)
};

struct Clip {
  std::string name;               // verbatim, may be empty or shared
  std::string id;                 // the name, or "anim<index>" for an unnamed clip
  std::vector<Channel> channels;  // channels without a target node are left out
  double duration = 0;            // seconds: the last key of all channels
};

struct Character {
  std::string path;
  std::vector<Node> nodes;
  std::vector<Index> order;  // all nodes, parents before children
  std::vector<Mesh> meshes;
  std::vector<Skin> skins;
  std::vector<Material> materials;
  std::vector<Clip> clips;
  std::vector<Expression> expressions;      // of VRM
  std::vector<NodeConstraint> constraints;  // VRMC_node_constraint, one a node at most
  std::vector<Index> scene_roots;           // of the default scene, else the first, else every root
  std::vector<std::string> warnings;        // what was ignored and might be missed, one line each

  // The name of a node in outputs: its name, `node<index>` if it has none, `<name>#<index>` where it is
  // shared. A mesh node shares with mesh nodes only; any other node with all nodes.
  std::string UniqueName(Index node) const;
  // The same for all nodes at once, in O(nodes); use this in loops.
  std::vector<std::string> UniqueNames() const;
  // Clip by id; the first of several with the same. kNoIndex if there is none.
  Index FindClip(std::string_view id) const;
  // Nodes in the scene that have a mesh, ascending.
  std::vector<Index> MeshNodes() const;
};

// Reads a file. One error, located at the path, that says which object of the file is wrong and why.
Result<Character> LoadGltf(const std::string& path);
// The same from memory; `folder` is where relative buffer URIs are looked up, `name` is used in messages.
Result<Character> LoadGltfFromMemory(std::span<const std::uint8_t> bytes, const std::string& folder,
                                     const std::string& name);

}  // namespace kpsa::engine::gltf
