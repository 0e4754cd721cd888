// indirectIllumination: the irradiance that arrives after bounces, at what a camera sees. A picture's pixels
// are its points: demand is local in them and global in the geometry.
#include <algorithm>
#include <memory>
#include <vector>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/illumination.h"
#include "nodes/kernels/path_tracer.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

enum Input { kPoints, kCamera, kLightMatrix, kLightColor };
constexpr Index kLargestSide = 4096;

struct IlluminationKernel {
  std::vector<Index> pixels, triangles;  // triangles over all meshes' points, one after the other
  std::vector<float> albedo;             // three a triangle
  std::vector<DiffuseLight::Kind> lights;
  Index width = 0, height = 0, points = 0;
  std::uint32_t seed = 0;
  int samples = 0, bounces = 0;
};

Result<Index> PixelCount(const Structural& s, std::string_view, int) {
  const int width = s.get_int("width"), height = s.get_int("height");
  return static_cast<Index>(width) * static_cast<Index>(height);
}

void DemandGeometry(Demand& demand) {
  for (int m = 0; m < demand.structural().array_size("points"); ++m)
    demand.Require("points", m, PointSet::All(demand.input_total("points", m)));
}

Result<BoundKernel> BindIllumination(const Binding& binding) {
  const Structural& s = binding.structural();
  IlluminationKernel kernel;
  kernel.pixels = binding.output("irradiance").ToVector();
  kernel.width = static_cast<Index>(s.get_int("width"));
  kernel.height = static_cast<Index>(s.get_int("height"));
  kernel.samples = s.get_int("samples");
  kernel.bounces = s.get_int("bounces");
  kernel.seed = static_cast<std::uint32_t>(s.get_int("seed"));
  const int meshes = s.array_size("points");
  if (meshes == 0) return Status::Invalid("points: no mesh to light; connect points[0]");
  for (int m = 0; m < meshes; ++m) {
    const auto* mesh = s.asset<Mesh>("mesh", m);
    if (mesh == nullptr) return Status::Invalid("mesh[{}] is not set: points[{}] need their triangles", m, m);
    const Index total = binding.input("points", m).total();
    if (mesh->point_count() != total)
      return Status::Invalid("mesh[{}] has {} points, points[{}] are {}", m, mesh->point_count(), m, total);
    for (const Mesh::Primitive& primitive : mesh->data().primitives) {
      for (Index t = primitive.first_triangle; t < primitive.first_triangle + primitive.triangle_count; ++t) {
        for (Index k = 0; k < 3; ++k) {
          kernel.triangles.push_back(kernel.points + mesh->data().triangles[3 * t + k]);
          kernel.albedo.push_back(std::clamp(primitive.base_color[k], 0.0f, 1.0f));
        }
      }
    }
    kernel.points += total;
  }
  const auto& kinds = s.value("lightKinds").get<std::vector<std::int64_t>>();
  for (std::int64_t kind : kinds) {
    if (kind < 0 || kind > 2)
      return Status::Invalid("lightKinds: {} is none of 0 (point), 1 (area), 2 (sun)", kind);
    kernel.lights.push_back(static_cast<DiffuseLight::Kind>(kind));
  }
  if (static_cast<int>(kinds.size()) != s.array_size("lightMatrix") ||
      static_cast<int>(kinds.size()) != s.array_size("lightColor")) {
    return Status::Invalid("{} lightKinds, {} matrices and {} colours of lights: expected as many of each",
                           kinds.size(), s.array_size("lightMatrix"), s.array_size("lightColor"));
  }
  return MakeBound(std::move(kernel), 0);
}

void ComputeIllumination(ComputeContext& c) {
  const auto& kernel = c.kernel_as<IlluminationKernel>();
  const ArrayView<ConstPointsView> meshes = c.array<ConstPointsView>(kPoints);
  PointBuffer all(kernel.points);
  std::size_t at = 0;
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    const ConstPointsView& from = meshes[m];
    std::copy_n(from.x, from.count, all.view().x + at);
    std::copy_n(from.y, from.count, all.view().y + at);
    std::copy_n(from.z, from.count, all.view().z + at);
    at += from.count;
  }
  std::vector<DiffuseLight> lights(kernel.lights.size());
  const ArrayView<Matrix4> matrices = c.array<Matrix4>(kLightMatrix);
  const ArrayView<Double3> colors = c.array<Double3>(kLightColor);
  for (std::uint32_t l = 0; l < lights.size(); ++l) lights[l] = {kernel.lights[l], matrices[l], colors[l]};
  const Result<PathTracer> tracer =
      PathTracer::Build(std::as_const(all).view(), kernel.triangles, kernel.albedo, std::move(lights));
  if (!tracer.ok()) return c.host->Fail(tracer.status().errors().front().message);
  const Matrix4& camera = c.get<Matrix4>(kCamera);
  const PointsView& out = c.out_points(0);
  const Parallel parallel = HostParallel(c);
  ForRanges(&parallel, kernel.pixels.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Double3 origin, direction;
      PixelRay(camera, kernel.pixels[i], kernel.width, kernel.height, &origin, &direction);
      const ShadingPlace place = tracer->Look(origin, direction);
      const Double3 light = tracer->Indirect(place, kernel.seed ^ kernel.pixels[i] * 0x9e3779b1u,
                                             kernel.samples, kernel.bounces);
      out.x[i] = static_cast<float>(light.x);
      out.y[i] = static_cast<float>(light.y);
      out.z[i] = static_cast<float>(light.z);
    }
  });
}

}  // namespace

void AddIlluminationNodes(NodeRegistry& registry) {
  NodeBuilder b =
      registry.add("indirectIllumination",
                   "Irradiance that surfaces give each other, at the pixels of a camera: path tracing.");
  b.category("light");
  b.points_in("points", "world positions of a mesh").array();
  b.structural("mesh", Type::kMesh, {.doc = "the triangles and base colours of points[i]"}).array();
  b.in("worldFromScreen", Matrix4(), {.doc = "of a camera"});
  b.in("lightMatrix", Matrix4(), {.doc = "outMatrix of a light"}).array();
  b.in("lightColor", Double3(), {.doc = "outColor of a light"}).array();
  b.structural("lightKinds", Value(std::vector<std::int64_t>()),
               {.doc = "what each light is: 0 point, 1 area, 2 sun"});
  b.structural("width", 400, {.min = 1, .max = kLargestSide, .doc = "pixels"});
  b.structural("height", 400, {.min = 1, .max = kLargestSide, .doc = "pixels"});
  b.structural("samples", 16, {.min = 1, .max = 65536, .doc = "paths a pixel"});
  b.structural("bounces", 2, {.min = 1, .max = 64, .doc = "surfaces a path may meet"});
  b.structural("seed", 0, {.min = 0, .doc = "of the samples"});
  b.out("irradiance", Type::kColors,
        "at each pixel, row by row from the top left; 0 where there is no surface");
  b.compute(&ComputeIllumination)
      .demand(DemandGeometry)
      .bind(BindIllumination)
      .point_count(PixelCount)
      .cost(1e6f, 2e4f);
}

}  // namespace kpsa
