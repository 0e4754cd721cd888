// A .glb while it is written. Nothing outside gltf/ includes this.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "files/point_cache.h"

namespace kpsa::engine {

// Numbers are indices into the file's lists; of accessors, where they say so.
struct GlbPrimitive {
  struct Target {
    int position = -1, normal = -1;  // accessors; -1: none
  };
  std::vector<std::pair<std::string, int>> attributes;  // POSITION and so on, with accessors
  int indices = -1;                                     // an accessor; -1: points
  Index material = kNoIndex;
  std::vector<Target> targets;
  bool has_normals() const {
    return std::any_of(attributes.begin(), attributes.end(),
                       [](const auto& a) { return a.first == "NORMAL"; });
  }
};
struct GlbMesh {
  std::string name;
  std::vector<GlbPrimitive> primitives;
  std::vector<float> weights;             // of the targets, without an animation
  std::vector<std::string> target_names;  // as many
};

class GlbFile {
 public:
  GlbFile();
  ~GlbFile();
  GlbFile(const GlbFile&) = delete;
  GlbFile& operator=(const GlbFile&) = delete;

  // Accessors.
  int AddPositions(std::span<const float> xyz);  // with the bounds that POSITION needs
  int AddVectors(std::span<const float> xyz);
  // Of `count` vectors, 0 but at these indices, which ascend; with bounds, as POSITION needs them.
  int AddSparsePositions(std::size_t count, std::span<const Index> indices, std::span<const float> xyz);
  int AddUvs(std::span<const float> uv);
  int AddJoints(std::span<const Index> joints, std::size_t joint_count);  // four a vertex
  int AddWeights(std::span<const float> weights);                         // four a vertex
  int AddIndices(std::span<const Index> indices);
  int AddMatrices(std::span<const float> columns);                // of skins
  int AddTimes(std::span<const float> times);                     // ascending, not empty
  int AddNumbers(std::span<const float> values);                  // of animations
  int AddKeys(std::span<const float> values, std::size_t width);  // vectors of animations: 3 or 4 numbers

  void AddImage(const CacheImage& image);
  void AddMaterial(const CacheMaterial& material);
  std::size_t AddMesh(const GlbMesh& mesh);
  std::size_t AddSkin(const std::vector<std::size_t>& joints, int inverse_binds);
  std::size_t AddNode(const std::string& name);  // below no other one; it is in the scene after AddToScene
  void AddToScene(std::size_t node);
  void AddChild(std::size_t parent, std::size_t node);
  // "translation", "rotation" or "scale".
  void SetTransform(std::size_t node, const char* path, const std::vector<float>& values);
  void SetMesh(std::size_t node, std::size_t mesh);
  void SetSkin(std::size_t node, std::size_t skin);
  // Of the only animation; input and output are accessors.
  void AddChannel(int input, int output, std::size_t node, const char* path);
  void NameAnimation(
      const std::string& name);  // "cache" where that is empty; nothing while there are no channels

  // Errors: more than the 4 GB that a .glb holds; those of WriteFileAtomically.
  Status Write(const std::string& path, bool force);

 private:
  struct Document;
  std::unique_ptr<Document> document_;
};

}  // namespace kpsa::engine
