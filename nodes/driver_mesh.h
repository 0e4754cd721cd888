// What deformers share that follow another mesh: its points at any stage, its faces, and where it lies at
// rest. Thread-safe.
#pragma once

#include <memory>
#include <vector>

#include "base/triangle_tree.h"
#include "nodes/deformer.h"
#include "nodes/kernels/topology.h"

namespace kpsa {

// The place of driverPoints among the inputs of the group.
inline constexpr int kDriverPoints = kFirstOwnInput;

// Declares driverPoints, driverMesh and driverMatrix; the first inputs of a deformer's own.
void AddDriver(NodeBuilder& builder);

// The driver at rest in the space of the stage, with a tree over its triangles or over its single points.
struct DriverRest {
  std::vector<Double3> points;
  PointBuffer rounded;  // the same as floats: what the tree is over
  TriangleTree tree;
  AlignedFloats boxes;
};

struct Driver {
  const Topology* topology = nullptr;
  std::shared_ptr<const DriverRest> rest;
  Matrix4 stage_from_driver;
};

enum class DriverTree { kTriangles, kPoints };
// Errors: driverPoints not connected, another number of points than the mesh, no faces, driverMatrix
// singular, points that are not finite. The last rest of a mesh is kept beside it, since demand and bind both
// ask.
Result<Driver> BindDriver(const Structural& structural, DriverTree tree);

}  // namespace kpsa
