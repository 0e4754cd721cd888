#include "nodes/driver_mesh.h"

#include <cmath>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "base/digest.h"
#include "graph/geometry.h"
#include "nodes/kernels/wrap.h"
#include "nodes/mesh_topology.h"

namespace kpsa::engine {
namespace {

// Beside the mesh: its latest rests, the newest one last.
struct Latest {
  struct Entry {
    Digest key;
    std::shared_ptr<const DriverRest> rest;
  };
  static constexpr std::size_t kMost = 4;
  struct Shared {
    std::shared_ptr<const DriverRest> Find(const Digest& key) {
      const std::lock_guard<std::mutex> lock(mutex);
      for (const Entry& entry : entries) {
        if (entry.key == key) return entry.rest;
      }
      return nullptr;
    }
    // What is there by now, or this one.
    std::shared_ptr<const DriverRest> Add(const Digest& key, std::shared_ptr<const DriverRest> rest) {
      const std::lock_guard<std::mutex> lock(mutex);
      for (const Entry& entry : entries) {
        if (entry.key == key) return entry.rest;
      }
      if (entries.size() == kMost) entries.erase(entries.begin());
      entries.push_back({key, std::move(rest)});
      return entries.back().rest;
    }

   private:
    std::mutex mutex;
    std::vector<Entry> entries;
  };
  std::shared_ptr<Shared> shared = std::make_shared<Shared>();
};

std::shared_ptr<const DriverRest> MakeRest(ConstPointsView points, const Matrix4& stage_from_driver,
                                           const Topology& topology, DriverTree tree) {
  auto rest = std::make_shared<DriverRest>();
  const bool moved = !(stage_from_driver == Matrix4());
  for (std::size_t i = 0; i < points.count; ++i) {
    const Double3 p{points.x[i], points.y[i], points.z[i]};
    const Double3 placed = moved ? TransformPoint(stage_from_driver, p) : p;
    rest->points.push_back(placed);
  }
  const PointBuffer floats = PointBuffer::FromPlaces(rest->points);
  if (tree == DriverTree::kTriangles) rest->tree = TriangleTree(floats.view(), topology.triangles());
  if (tree == DriverTree::kMoving) rest->moving.emplace(floats.view(), topology.triangles());
  if (tree == DriverTree::kPoints) rest->tree = TriangleTree(floats.view(), PointTriangles(topology));
  return rest;
}

}  // namespace

void AddDriver(NodeBuilder& b) {
  b.points_in("driverPoints", "the driver's points, at any stage of its stack; `driver:` connects them");
  b.structural("driverMesh", Type::kMesh, {.doc = "the topology of the driver"});
  b.structural("driverMatrix", Matrix4(),
               {.doc = "world from the driver's space at rest, where its stage is in mesh space"});
}

Result<const Mesh*> DriverMesh(const Structural& s, std::optional<std::size_t> points) {
  const auto* mesh = s.asset<Mesh>("driverMesh");
  if (mesh == nullptr || !s.is_set("driverPoints"))
    return Status::Invalid("it has no driver: name a mesh, `driver: MESH` or `driver: \"MESH@STAGE\"`");
  if (points.has_value() && *points != mesh->point_count())
    return Status::Invalid("its driver's mesh has {} points, driverPoints {}", mesh->point_count(), *points);
  if (mesh->data().triangles.empty())
    return Status::Invalid("its driver \"{}\" has no faces", mesh->data().name);
  return mesh;
}

Result<Driver> BindDriver(const Structural& s, DriverTree tree) {
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  const Matrix4 world_from_driver = s.value("driverMatrix").get<Matrix4>();
  Matrix4 inverse;
  if (!Invert(world_from_driver, &inverse)) return Status::Invalid("driverMatrix is singular");
  return BindDriver(s, tree,
                    frame->fixed() ? frame->stage_from_world() * world_from_driver : world_from_driver);
}

Result<Driver> BindDriver(const Structural& s, DriverTree tree, const Matrix4& stage_from_driver) {
  const Value* value = s.rest("driverPoints");
  const PointBuffer* rest = value == nullptr ? nullptr : value->points();
  const Result<const Mesh*> mesh =
      DriverMesh(s, rest == nullptr ? std::nullopt : std::optional(rest->count()));
  if (!mesh.ok()) return mesh.status();
  if (rest == nullptr) return Status::Invalid("its driver has no rest shape");
  Status error;
  Driver driver;
  driver.stage_from_driver = stage_from_driver;
  driver.topology = TopologyOf(*mesh, &error);
  if (driver.topology == nullptr) return error;
  const ConstPointsView points = rest->view();
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!std::isfinite(points.x[i]) || !std::isfinite(points.y[i]) || !std::isfinite(points.z[i]))
      return Status::Invalid("point {} of its driver is not finite at rest", i);
  }

  Hasher hasher;
  hasher.Add(tree);
  hasher.Add(std::span<const double>(driver.stage_from_driver.m));
  for (const float* row : {points.x, points.y, points.z})
    hasher.Add(std::span<const float>(row, points.count));
  const Digest key = hasher.Finish();
  Latest::Shared& latest = *(*mesh)->Derived<Latest>([] { return Latest(); }).shared;
  driver.rest = latest.Find(key);
  if (driver.rest == nullptr) {
    // Without the lock: trees take a while, and others may want what is there
    driver.rest = latest.Add(key, MakeRest(points, driver.stage_from_driver, *driver.topology, tree));
  }
  return driver;
}

}  // namespace kpsa::engine
