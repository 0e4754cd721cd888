// From a glTF mesh's vertices to the runtime's points: vertices that are equal in rest position, influences
// and morph deltas become one point (exporters split them at UV seams), and points are put in an order in which
// neighbours on the surface, and those that move alike, are neighbours in memory (rig/character/point_order.h).
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
// index.
WeldedMesh WeldMesh(const gltf::Character& character, Index mesh, std::string name, bool weld);

// The influences of the points of a skinned mesh. Vertices of unskinned primitives follow one more "joint",
// number joint_count, which stands for the mesh node; *needs_node says whether there are such. joint_count is
// that of the skin.
std::shared_ptr<const Influences> PointInfluences(const gltf::Mesh& mesh, const WeldedMesh& welded,
                                                  Index joint_count, bool* needs_node);

}  // namespace kpsa::engine
