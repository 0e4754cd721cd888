// Drivers as nodes bind them: what is wrong with one, and what all that follow a mesh share.
#include "nodes/driver_mesh.h"

#include <cmath>
#include <map>

#include "tests/nodes/driver_rig.h"
#include "tests/nodes/node_support.h"

namespace kpsa::engine {
namespace {

// A node that follows a mesh, without a graph.
class Following : public Structural {
 public:
  explicit Following(const std::shared_ptr<const Mesh>& mesh) {
    values["driverMesh"] = Value(mesh);
    values["driverMatrix"] = values["parentMatrix"] = values["geometryMatrix"] = Value(Matrix4());
    values["space"] = Value(0);
    values["driverPoints"] = Value(PointBufferPtr(std::make_shared<PointBuffer>(mesh->data().rest)));
  }
  const Value& value(std::string_view name, int) const override { return values.at(std::string(name)); }
  bool is_set(std::string_view name, int) const override { return values.count(std::string(name)) != 0; }
  int array_size(std::string_view) const override { return 0; }
  int geometry() const override { return 0; }
  const std::string& node_name() const override { return name; }
  const Value* rest(std::string_view name, int) const override {
    const auto it = values.find(std::string(name));
    return it == values.end() || it->second.empty() ? nullptr : &it->second;
  }
  std::string Error() const {
    const Result<Driver> driver = BindDriver(*this, DriverTree::kTriangles, Matrix4());
    return driver.ok() ? "" : driver.status().ToString();
  }
  std::map<std::string, Value> values;
  std::string name = "n";
};

std::shared_ptr<const Mesh> ASheet() {
  return GridMesh(5, 4, [](double x, double y) { return 0.2 * x * y; });
}

TEST(DriverMeshes, AllThatFollowAMeshShareItsRestAndTree) {
  const auto sheet = ASheet();
  const Following one(sheet), other(sheet);
  const auto rest = [](const Following& node, DriverTree tree, const Matrix4& m) {
    return BindDriver(node, tree, m)->rest;
  };
  const auto shared = rest(one, DriverTree::kTriangles, Matrix4());
  ASSERT_NE(shared, nullptr);
  EXPECT_EQ(rest(one, DriverTree::kTriangles, Matrix4()), shared) << "the next geometry";
  EXPECT_EQ(rest(other, DriverTree::kTriangles, Matrix4()), shared) << "another node";
  EXPECT_EQ(BindDriver(other, DriverTree::kTriangles)->rest, shared) << "a deformer in the world";
  EXPECT_NE(rest(one, DriverTree::kPoints, Matrix4()), shared);
  EXPECT_NE(rest(one, DriverTree::kTriangles, Translation({1, 0, 0})), shared);
  Following raised(sheet);
  auto points = std::make_shared<PointBuffer>(sheet->data().rest);
  points->view().z[3] += 1;
  raised.values["driverPoints"] = Value(PointBufferPtr(points));
  EXPECT_NE(rest(raised, DriverTree::kTriangles, Matrix4()), shared) << "another stage of the mesh";
  EXPECT_EQ(rest(raised, DriverTree::kTriangles, Matrix4())->points[3].z, points->view().z[3]);
}

TEST(DriverMeshes, AreCheckedOnceForAll) {
  const auto sheet = ASheet();
  EXPECT_EQ(Following(sheet).Error(), "");
  const std::string none = "it has no driver: name a mesh, `driver: MESH` or `driver: \"MESH@STAGE\"`";
  for (const char* missing : {"driverMesh", "driverPoints"}) {
    Following node(sheet);
    if (missing == std::string("driverMesh")) {
      node.values[missing] = Value();
    } else {
      node.values.erase(missing);
    }
    EXPECT_EQ(node.Error(), none) << missing;
  }
  Following unknown(sheet);
  unknown.values["driverPoints"] = Value();  // an error of its own, upstream
  EXPECT_EQ(unknown.Error(), "its driver has no rest shape");
  Following fewer(sheet);
  fewer.values["driverPoints"] = PointsOf({0, 0, 0, 1, 0, 0});
  EXPECT_EQ(fewer.Error(), "its driver's mesh has 20 points, driverPoints 2");
  EXPECT_EQ(Following(MeshOf({0, 0, 0, 1, 0, 0, 0, 1, 0}, {})).Error(), "its driver \"mesh\" has no faces");
  for (const float bad : {std::nanf(""), HUGE_VALF}) {
    Following node(sheet);
    auto points = std::make_shared<PointBuffer>(sheet->data().rest);
    points->view().y[7] = bad;
    node.values["driverPoints"] = Value(PointBufferPtr(points));
    EXPECT_EQ(node.Error(), "point 7 of its driver is not finite at rest");
  }
  Following flat(sheet);
  flat.values["driverMatrix"] = Value(Scaling({1, 0, 1}));
  EXPECT_EQ(BindDriver(flat, DriverTree::kTriangles).status().ToString(), "driverMatrix is singular");
}

}  // namespace
}  // namespace kpsa::engine
