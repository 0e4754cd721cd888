// What glTF can say of a point cache itself: nodes that move, skins of them, morph targets before these.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/types.h"

namespace kpsa::engine {

struct CacheNode {
  std::string name;
  Index parent = kNoIndex;      // in SkinnedScene::nodes
  std::vector<Matrix4> worlds;  // by frame
};

struct CacheTarget {
  std::string name;
  std::vector<Index> vertices;  // ascending; those that move
  std::vector<float> deltas;    // xyz, 3 a vertex; mesh space
};

// How a mesh of V vertices moves in T frames: rest + targets * weights, then by its joints, or with a node.
struct CacheSkin {
  std::vector<float> rest;           // 3V, mesh space
  std::vector<CacheTarget> targets;  // K
  std::vector<double> weights;       // T x K, frame after frame
  Index node = kNoIndex;             // that carries it, where there are no joints
  // Row v: offsets[v] to offsets[v + 1] of `influences` (in `joints`) and `shares`, which sum up to 1
  std::vector<Index> offsets, influences;
  std::vector<float> shares;
  std::vector<Index> joints;           // nodes
  std::vector<Matrix4> inverse_binds;  // by joint: joint_from_mesh at bind time
};

struct SkinnedScene {
  std::vector<CacheNode> nodes;                  // parents first
  std::vector<std::optional<CacheSkin>> meshes;  // by mesh of the cache; none: frames say all
  // By mesh of the cache: why glTF cannot say how it moves, for a sentence after its name; "" where it can.
  std::vector<std::string> reasons;
};

}  // namespace kpsa::engine
