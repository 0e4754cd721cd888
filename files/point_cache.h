// Animated points as files: PC2 and MDD (one mesh a file, no topology) and usda (all meshes with topology).
// World space in metres, Y up, unless an option says otherwise. NPZ is in files/npz.h, GLB in gltf/export.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

// Consecutive vertices of a mesh, and the triangles on them, that are shaded alike.
struct CachePart {
  Index first_vertex = 0, vertex_count = 0;
  Index material = kNoIndex;  // in PointCache::materials
};
// T frames of V vertices.
struct PointCacheMesh {
  std::string name;
  std::size_t vertex_count = 0;
  std::vector<float> frames;     // T * V * 3: x y z of each vertex, frame after frame
  std::vector<Index> triangles;  // three vertex indices each; empty for points only
  // What usda and GLB show it with. All may be empty.
  std::vector<float> uvs = {};     // 2V, as glTF has them, v downwards; not a number: the vertex has none
  std::vector<float> colors = {};  // 3V, linear, multiplied with the base colour
  // V: the first of the vertices that share its normal; kNoIndex: its triangles are flat. Empty: none share any
  std::vector<Index> smooth = {};
  std::vector<CachePart> parts = {};  // all vertices, in their order; empty: one part without a material
};
struct CacheImage {
  std::string type;  // "image/png" or "image/jpeg"
  std::vector<std::uint8_t> bytes;
};
struct CacheMaterial {
  std::string name;
  std::array<double, 4> base_color = {1, 1, 1, 1};  // linear RGBA
  double metallic = 1, roughness = 1;
  bool double_sided = false;
  std::string alpha_mode = "OPAQUE";  // or MASK, BLEND; GLB only, as alpha_cutoff
  double alpha_cutoff = 0.5;
  Index image = kNoIndex;  // in PointCache::images, multiplied with the base colour; GLB only
};
struct PointCache {
  std::vector<double> times;  // seconds, T of them, ascending
  double fps = 24;            // what frame numbers in files mean
  std::vector<PointCacheMesh> meshes;
  std::vector<CacheMaterial> materials = {};
  std::vector<CacheImage> images = {};
  std::string clip = {};  // the animation's name
  std::string rig = {};   // the file that it was evaluated from, without its folder
};

enum class CacheAxes : std::uint8_t {
  kYUp,     // (x, y, z) as they are
  kBlender  // Z up: (x, -z, y), for a Mesh Cache modifier of a mesh that Blender imported from glTF
};
struct CacheOptions {
  CacheAxes axes = CacheAxes::kYUp;
  // Output vertex i is vertex order[i]; empty: all as they are. See gltf/blender_order.h.
  std::vector<Index> order = {};
  bool force = false;  // replace an existing file
};

// PC2: 32 bytes "POINTCACHE2\0", version 1, points, first frame, frames a sample, samples; then float32 x y
// z, little endian. The format knows evenly spaced samples only: uneven times are written as if even, and
// reported.
Status WritePc2(const std::string& path, const PointCache& cache, std::size_t mesh,
                const CacheOptions& options, std::vector<std::string>* warnings);
// MDD: frames, points, times in seconds, then float32 x y z, big endian.
Status WriteMdd(const std::string& path, const PointCache& cache, std::size_t mesh,
                const CacheOptions& options);

// One mesh without name and topology. Counts are checked against the file's size, positions for NaN and Inf.
// A PC2 file counts in frames; `fps` makes them seconds.
Result<PointCache> ReadPc2(const std::string& path, double fps = 24);
Result<PointCache> ReadMdd(const std::string& path, double fps = 24);

// The file of mesh `index` where one is written for each: "out.pc2" alone, "out.<name>.pc2" of several;
// characters that file systems dislike become '_', and names that would collide get their index.
std::string CachePathForMesh(const std::string& path, const PointCache& cache, std::size_t index);

// USD text: an Xform "cache" with one Mesh a mesh; time codes are frames (seconds * fps). Points, normals and
// extents are time samples. Base colours and vertex colours are displayColor; a mesh without the latter is
// bound to UsdPreviewSurfaces, too. Texture coordinates are primvars:st, v upwards. Warns above 100 MB.
Status WriteUsda(const std::string& path, const PointCache& cache, bool force,
                 std::vector<std::string>* warnings);

}  // namespace kpsa::engine
