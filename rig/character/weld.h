// From a glTF mesh's vertices to the runtime's points: vertices that are equal in rest position, influences
// and morph deltas become one point (exporters split them at UV seams), and points are put in an order in which
// neighbours on the surface are neighbours in memory, and those that a joint moves are next to each other: what moves
// alike is then reconstructed by few numbers.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gltf/import.h"
#include "graph/geometry.h"

namespace kpsa::engine {

struct WeldedMesh {
  std::shared_ptr<const Mesh> mesh;
  std::vector<Index> point_to_vertex;           // [N] the lowest vertex of each point
  std::shared_ptr<const MorphTargets> targets;  // null where the mesh has none
};

// O(V log V). `weld` false keeps every vertex as a point of its own (still in spatial order). Equal means
// equal as numbers (-0 is 0). Triangles that lose a corner are left out. Unnamed targets are named by their
// index. joint_order: by joint of the mesh's influences, as JointOrder gives it; empty: joints do not count, nor do they where the mesh has morph targets.
WeldedMesh WeldMesh(const gltf::Character& character, Index mesh, std::string name, bool weld,
                    std::span<const Index> joint_order = {});
// A number for each joint of the skin, by which a chain of joints stays together: depth first through the nodes, every
// second child from the end of its chain to itself, so that siblings follow each other where they hang.
std::vector<Index> JointOrder(const gltf::Character& character, const gltf::Skin& skin);

// The influences of the points of a skinned mesh. Vertices of unskinned primitives follow one more "joint",
// number joint_count, which stands for the mesh node; *needs_node says whether there are such. joint_count is
// that of the skin.
std::shared_ptr<const Influences> PointInfluences(const gltf::Mesh& mesh, const WeldedMesh& welded,
                                                  Index joint_count, bool* needs_node);

}  // namespace kpsa::engine
