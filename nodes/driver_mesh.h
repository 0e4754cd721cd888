// What nodes share that follow another mesh: its points at any stage, its faces, and where it lies at rest.
// Thread-safe.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/triangle_tree.h"
#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/moving_surface.h"
#include "nodes/kernels/topology.h"
#include "nodes/known_influences.h"

namespace kpsa::engine {

// Declares driverPoints, driverMesh and driverMatrix.
void AddDriver(NodeBuilder& builder);

// The mesh of a driver whose points are so many (unset: nobody knows). Errors: driverMesh or driverPoints is
// missing, another number of points than the mesh has, no faces.
Result<const Mesh*> DriverMesh(const Structural& structural, std::optional<std::size_t> points);

// The driver at rest in the space of the stage, and over its points, as floats, what DriverTree says.
struct DriverRest {
  std::vector<Double3> points;
  TriangleTree tree;
  std::optional<MovingSurface> moving;
  std::shared_ptr<KnownInfluences> influences =
      std::make_shared<KnownInfluences>();  // of what wraps itself around it
};

struct Driver {
  const Topology* topology = nullptr;
  std::shared_ptr<const DriverRest> rest;
  Matrix4 stage_from_driver;
};

// A tree over its triangles, one over its single points, or trees that follow the driver.
enum class DriverTree { kTriangles, kPoints, kMoving };
// Of a deformer, in the space of its stage. Errors: those of DriverMesh, driverMatrix singular, points that
// are not finite. The last rests of a mesh are kept beside it: demand and bind both ask, of every geometry.
Result<Driver> BindDriver(const Structural& structural, DriverTree tree);
// The same in any other space.
Result<Driver> BindDriver(const Structural& structural, DriverTree tree, const Matrix4& stage_from_driver);

}  // namespace kpsa::engine
