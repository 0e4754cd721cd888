// indirectIllumination: the irradiance that arrives after bounces, at what a camera sees and at the points of
// meshes that move through its picture. Demand is local in these shading points and global in the geometry.
#include <algorithm>
#include <memory>
#include <vector>

#include "base/spares.h"
#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/illumination.h"
#include "nodes/kernels/path_tracer.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using IlluminationInputs =
    NodeContext<In<"points", ArrayView<ConstPointsView>>, In<"worldFromScreen", Matrix4>,
                In<"lightMatrix", ArrayView<Matrix4>>, In<"lightColor", ArrayView<Double3>>>;
using IlluminationContext =
    NodeContext<In<"points", ArrayView<ConstPointsView>>, In<"worldFromScreen", Matrix4>,
                In<"lightMatrix", ArrayView<Matrix4>>, In<"lightColor", ArrayView<Double3>>,
                Out<"irradiance", PointsView>, Out<"pointIrradiance", OutArray<PointsView>>,
                Out<"keyIrradiance", PointsView>, Out<"keyPointIrradiance", OutArray<PointsView>>>;
constexpr Index kLargestSide = 4096;

bool AtPixels(std::string_view output) { return output == "irradiance" || output == "keyIrradiance"; }

// A tracer with room for the inputs of one evaluation.
struct Workplace {
  PathTracer tracer;
  PointBuffer points;
  std::vector<DiffuseLight> lights;
};

// Shading points whose light is computed with the same number of paths.
struct ShadingPoints {
  int samples = 0;
  std::vector<Index> pixels;
  std::vector<std::vector<Index>> carried;  // by element of the output: points, of all meshes' points
};

struct IlluminationKernel {
  ShadingPoints shown, keys;         // of pictures, and where these are measured
  std::vector<Index> triangles;      // over all meshes' points, one after the other
  std::vector<float> albedo;         // three a triangle
  std::vector<std::uint8_t> unseen;  // triangles of carried meshes
  PointBuffer rest;
  std::vector<DiffuseLight::Kind> lights;
  Index width = 0, height = 0;
  PathOptions paths;
  // All are built of the rest points, and what rays meet depends on that layout and on where the points are,
  // not on where they have been. Bind makes the first.
  std::shared_ptr<Spares<Workplace>> workplaces = std::make_shared<Spares<Workplace>>();
};

const std::vector<std::int64_t>& CarriedMeshes(const Structural& s) {
  return s.value("carriedMeshes").get<std::vector<std::int64_t>>();
}

Result<Index> ShadingPointCount(const Structural& s, std::string_view output, int element) {
  if (AtPixels(output)) {
    const int width = s.get_int("width"), height = s.get_int("height");
    return static_cast<Index>(width) * static_cast<Index>(height);
  }
  const std::vector<std::int64_t>& carried = CarriedMeshes(s);
  if (element < 0 || static_cast<std::size_t>(element) >= carried.size()) return 0;
  const auto* mesh = s.asset<Mesh>("mesh", static_cast<int>(carried[static_cast<std::size_t>(element)]));
  return mesh == nullptr ? 0 : mesh->point_count();
}

void DemandGeometry(Demand& demand) {
  for (int m = 0; m < demand.structural().array_size("points"); ++m)
    demand.Require("points", m, PointSet::All(demand.input_total("points", m)));
}

Status BindMeshes(const Binding& binding, IlluminationKernel* kernel, std::vector<Index>* first_points) {
  const Structural& s = binding.structural();
  const std::vector<std::int64_t>& carried = CarriedMeshes(s);
  const int meshes = s.array_size("points");
  if (meshes == 0) return Status::Invalid("points: no mesh to light; connect points[0]");
  Index points = 0;
  std::vector<float> rest;
  for (int m = 0; m < meshes; ++m) {
    const auto* mesh = s.asset<Mesh>("mesh", m);
    if (mesh == nullptr) return Status::Invalid("mesh[{}] is not set: points[{}] need their triangles", m, m);
    const Index total = binding.input("points", m).total();
    if (mesh->point_count() != total)
      return Status::Invalid("mesh[{}] has {} points, points[{}] are {}", m, mesh->point_count(), m, total);
    const bool unseen = std::find(carried.begin(), carried.end(), m) != carried.end();
    for (const Mesh::Primitive& primitive : mesh->data().primitives) {
      for (Index t = primitive.first_triangle; t < primitive.first_triangle + primitive.triangle_count; ++t) {
        for (Index k = 0; k < 3; ++k) {
          kernel->triangles.push_back(points + mesh->data().triangles[3 * t + k]);
          kernel->albedo.push_back(std::clamp(primitive.base_color[k], 0.0f, 1.0f));
        }
        kernel->unseen.push_back(unseen);
      }
    }
    // Where the search structure gets its layout; the mesh's own rest where nothing upstream tells another
    const Value* at_rest = s.rest("points", m);
    const ConstPointsView from = at_rest != nullptr && at_rest->points()->count() == total
                                     ? std::as_const(*at_rest->points()).view()
                                     : std::as_const(mesh->data().rest).view();
    for (std::size_t i = 0; i < from.count; ++i) rest.insert(rest.end(), {from.x[i], from.y[i], from.z[i]});
    first_points->push_back(points);
    points += total;
  }
  kernel->rest = PointBuffer::FromInterleaved(rest);
  return Status();
}

Status BindShading(const Binding& binding, const std::vector<Index>& first_points, const char* at_pixels,
                   const char* at_points, ShadingPoints* shading) {
  shading->pixels = binding.output(at_pixels).ToVector();
  int element = 0;
  for (std::int64_t mesh : CarriedMeshes(binding.structural())) {
    if (mesh < 0 || static_cast<std::size_t>(mesh) >= first_points.size())
      return Status::Invalid("carriedMeshes: {} is none of the {} meshes", mesh, first_points.size());
    std::vector<Index>& points =
        shading->carried.emplace_back(binding.output(at_points, element++).ToVector());
    for (Index& point : points) point += first_points[static_cast<std::size_t>(mesh)];
  }
  return Status();
}

Result<std::unique_ptr<Workplace>> MakeWorkplace(const IlluminationKernel& kernel) {
  std::vector<DiffuseLight> lights(kernel.lights.size());
  Result<PathTracer> tracer = PathTracer::Build(std::as_const(kernel.rest).view(), kernel.triangles,
                                                kernel.albedo, lights, kernel.unseen);
  if (!tracer.ok()) return tracer.status();
  return std::make_unique<Workplace>(
      Workplace{std::move(*tracer), PointBuffer(kernel.rest.count()), std::move(lights)});
}

Result<BoundKernel> BindIllumination(const Binding& binding) {
  const Structural& s = binding.structural();
  IlluminationKernel kernel;
  kernel.width = static_cast<Index>(s.get_int("width"));
  kernel.height = static_cast<Index>(s.get_int("height"));
  kernel.paths = {static_cast<std::uint32_t>(s.get_int("seed")), 0, s.get_int("bounces"),
                  s.get_double("largestContribution")};
  std::vector<Index> first_points;
  KPSA_RETURN_IF_ERROR(BindMeshes(binding, &kernel, &first_points));
  const int samples = s.get_int("samples"), key_samples = s.get_int("keySamples");
  KPSA_RETURN_IF_ERROR(BindShading(binding, first_points, "irradiance", "pointIrradiance", &kernel.shown));
  KPSA_RETURN_IF_ERROR(
      BindShading(binding, first_points, "keyIrradiance", "keyPointIrradiance", &kernel.keys));
  kernel.shown.samples = samples;
  kernel.keys.samples = key_samples > 0 ? key_samples : samples;
  const auto& kinds = s.value("lightKinds").get<std::vector<std::int64_t>>();
  for (std::int64_t kind : kinds) {
    if (kind < 0 || kind > 3)
      return Status::Invalid("lightKinds: {} is none of 0 (point), 1 (area), 2 (sun), 3 (sphere)", kind);
    kernel.lights.push_back(static_cast<DiffuseLight::Kind>(kind));
  }
  if (static_cast<int>(kinds.size()) != s.array_size("lightMatrix") ||
      static_cast<int>(kinds.size()) != s.array_size("lightColor")) {
    return Status::Invalid("{} lightKinds, {} matrices and {} colours of lights: expected as many of each",
                           kinds.size(), s.array_size("lightMatrix"), s.array_size("lightColor"));
  }
  Result<std::unique_ptr<Workplace>> first = MakeWorkplace(kernel);
  if (!first.ok()) return first.status();
  kernel.workplaces->Give(std::move(*first));
  return MakeBound(std::move(kernel), 0);
}

// Puts the inputs of this evaluation in place.
Status SetUp(IlluminationInputs c, const IlluminationKernel& kernel, Workplace* place) {
  const ArrayView<ConstPointsView> meshes = c.get<"points">();
  std::size_t at = 0;
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    const ConstPointsView& from = meshes[m];
    std::copy_n(from.x, from.count, place->points.view().x + at);
    std::copy_n(from.y, from.count, place->points.view().y + at);
    std::copy_n(from.z, from.count, place->points.view().z + at);
    at += from.count;
  }
  const ArrayView<Matrix4> matrices = c.get<"lightMatrix">();
  const ArrayView<Double3> colors = c.get<"lightColor">();
  for (std::uint32_t l = 0; l < kernel.lights.size(); ++l)
    place->lights[l] = {kernel.lights[l], matrices[l], colors[l]};
  const Parallel parallel = HostParallel(c);
  return place->tracer.Update(std::as_const(place->points).view(), place->lights, &parallel);
}

void Illuminate(IlluminationInputs c, const IlluminationKernel& kernel, const ShadingPoints& shading,
                const PathTracer& tracer, const PointsView& at_pixels, OutArray<PointsView> at_points) {
  const Parallel parallel = HostParallel(c);
  const auto gather = [&](const ShadingPlace& at, Index own, const PointsView& out, std::size_t i) {
    PathOptions paths = kernel.paths;
    paths.samples = shading.samples;
    paths.seed ^= own * 0x9e3779b1u;
    const Double3 light = tracer.Indirect(at, paths);
    out.x[i] = static_cast<float>(light.x);
    out.y[i] = static_cast<float>(light.y);
    out.z[i] = static_cast<float>(light.z);
  };
  const Matrix4& camera = c.get<"worldFromScreen">();
  ForRanges(&parallel, shading.pixels.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Double3 origin, direction;
      PixelRay(camera, shading.pixels[i], kernel.width, kernel.height, &origin, &direction);
      gather(tracer.See(origin, direction), shading.pixels[i], at_pixels, i);
    }
  });
  for (std::uint32_t e = 0; e < shading.carried.size(); ++e) {
    const std::vector<Index>& points = shading.carried[e];
    ForRanges(&parallel, points.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        gather(tracer.OnPoint(points[i]), ~points[i], at_points[e], i);
    });
  }
}

void ComputeIllumination(IlluminationContext c) {
  const auto& kernel = c.kernel_as<IlluminationKernel>();
  std::unique_ptr<Workplace> place = kernel.workplaces->Take();
  if (place == nullptr) {  // another evaluation is under way
    Result<std::unique_ptr<Workplace>> made = MakeWorkplace(kernel);
    if (!made.ok()) return c.Fail(made.status().errors().front().message);
    place = std::move(*made);
  }
  if (const Status status = SetUp(c, kernel, place.get()); status.ok()) {
    Illuminate(c, kernel, kernel.shown, place->tracer, c.out<"irradiance">(), c.out<"pointIrradiance">());
    Illuminate(c, kernel, kernel.keys, place->tracer, c.out<"keyIrradiance">(),
               c.out<"keyPointIrradiance">());
  } else {
    c.Fail(status.errors().front().message);
  }
  kernel.workplaces->Give(std::move(place));
}

}  // namespace

KPSA_NODES(indirect_illumination, registry) {
  NodeBuilder b =
      registry.add("indirectIllumination",
                   "Irradiance that surfaces give each other, at the pixels of a camera: path tracing.");
  b.category("light");
  b.version(2);  // one normal where more than 128 triangles meet
  b.points_in("points", "world positions of a mesh").array();
  b.structural("mesh", Type::kMesh, {.doc = "the triangles and base colours of points[i]"}).array();
  b.in("worldFromScreen", Matrix4(), {.doc = "of a camera"});
  b.in("lightMatrix", Matrix4(), {.doc = "outMatrix of a light"}).array();
  b.in("lightColor", Double3(), {.doc = "outColor of a light"}).array();
  b.structural("lightKinds", Value(std::vector<std::int64_t>()),
               {.doc = "what each light is: 0 point, 1 area, 2 sun, 3 sphere"});
  b.structural("carriedMeshes", Value(std::vector<std::int64_t>()),
               {.doc = "numbers of meshes that the pixels look through; light at their points is in "
                       "pointIrradiance"});
  b.structural("width", 400, {.min = 1, .max = kLargestSide, .doc = "pixels"});
  b.structural("height", 400, {.min = 1, .max = kLargestSide, .doc = "pixels"});
  b.structural("samples", 16,
               {.min = 1, .max = 65536, .doc = "paths a shading point; powers of two are even"});
  b.structural(
      "keySamples", 0,
      {.min = 0,
       .max = 65536,
       .doc = "paths where a subspace of the light measures it: the first of the others. 0: as many"});
  b.structural("bounces", 2, {.min = 1, .max = 64, .doc = "surfaces a path may meet"});
  b.structural(
      "largestContribution", 0.0,
      {.min = 0,
       .doc = "of one light to one path at one bounce; what is more is scaled down, which makes the mean "
              "darker. 0: no limit"});
  b.structural("seed", 0, {.min = 0, .doc = "of the samples"});
  b.out("irradiance", Type::kColors,
        "at each pixel, row by row from the top left; 0 where there is no surface");
  b.out("pointIrradiance", Type::kColors, "at each point of a carried mesh").array();
  b.out("keyIrradiance", Type::kColors, "irradiance by keySamples paths");
  b.out("keyPointIrradiance", Type::kColors, "pointIrradiance by keySamples paths").array();
  b.compute<ComputeIllumination>()
      .demand(DemandGeometry)
      .bind(BindIllumination)
      .point_count(ShadingPointCount)
      .cost(1e6f, 2e4f);
}

}  // namespace kpsa::engine
