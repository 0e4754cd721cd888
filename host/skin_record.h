// How joints, skins and morph targets alone move the meshes of a rig: recorded frame after frame, for files that can
// say that (gltf/export.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gltf/skinned_scene.h"
#include "graph/evaluator.h"
#include "nodes/kernels/shape_paths.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

class SkinRecord {
 public:
  // Refers to the rig. Looks for meshes (by number) whose stack is blend shapes, then the file's skin or its transform,
  // and which no subspace stands in for; of others it tells the reason. Records nothing where `frames` are so many that
  // it would take more than kMaxBytes.
  SkinRecord(const Rig& rig, const std::vector<std::size_t>& meshes, std::size_t frames);
  static constexpr std::uint64_t kMaxBytes = std::uint64_t{2} << 30;

  // As SkinnedScene::reasons.
  const std::vector<std::string>& reasons() const { return scene_.reasons; }
  // Adds to a request what Add reads: world matrices, weights, envelopes.
  void Ask(Request* request);
  // The next frame.
  void Add(const Evaluator& evaluator);
  const SkinnedScene& scene() const { return scene_; }

 private:
  // Of one blend shape, whose targets follow each other.
  struct StageWeights {
    std::vector<PlugRef> weights;
    PlugRef envelope;
    ShapePaths paths;
  };
  Index NodeOf(Index gltf_node);
  Status Describe(const CharacterMesh& mesh, CacheSkin* skin, std::vector<StageWeights>* weights);
  Status AddTargets(const CharacterMesh& mesh, const Stage& stage, CacheSkin* skin,
                    std::vector<StageWeights>* weights) const;
  void AddJoints(const CharacterMesh& mesh, CacheSkin* skin);

  const Rig& rig_;
  SkinnedScene scene_;
  std::vector<PlugRef> worlds_;                     // by node
  std::vector<Index> nodes_;                        // by glTF node; kNoIndex: not recorded
  std::vector<std::vector<StageWeights>> weights_;  // by mesh and blend shape
  Index first_ = 0;                                 // of the request's outputs
};

}  // namespace kpsa::engine
