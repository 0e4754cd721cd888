#include "picture/camera_picture.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "nodes/illumination.h"
#include "picture/head_light.h"

namespace kpsa::engine {
namespace {

constexpr int kAreaSamples = 16;  // shadow rays a pixel and light that has a size

// What the textures of the mesh say where a ray hits its triangle `t`, of a sample of `size` metres.
Double3 TextureColor(const MeshLook& look, Index t, const ShadingPlace& hit, ConstPointsView points,
                     const Index* corner, double size) {
  const Index* const at = &look.triangles[3 * std::size_t{t}];
  if (look.texture.empty() || look.texture[*at] == kNoIndex) return {1, 1, 1};
  CoveredPlace place;
  place.weights = {1 - hit.u - hit.v, hit.u, hit.v};
  for (std::size_t k = 0; k < 3; ++k) {
    place.corners[k] = {points.x[corner[k]], points.y[corner[k]], points.z[corner[k]]};
    const float* const uv = &look.uvs[2 * std::size_t{at[k]}];
    place.uvs[k] = {double{uv[0]}, double{uv[1]}};
  }
  return TexelAt(look.textures[look.texture[*at]], place, size);
}

}  // namespace

Result<std::vector<CameraImage>> EvaluateCamera(const Rig& rig, Compiler* compiler, const CameraView& view,
                                                const std::vector<double>& times,
                                                const RigFrameOptions& options, Verdicts* verdicts) {
  Request request;
  request.varying.push_back(rig.scene.time);
  for (std::size_t m : view.meshes) request.outputs.push_back({rig.scene.meshes[m].points, {}});
  const auto camera = static_cast<Index>(request.outputs.size());
  request.outputs.push_back({view.world_from_screen, {}});
  for (const CameraView::Light& light : view.lights) {
    request.outputs.push_back({light.matrix, {}});
    request.outputs.push_back({light.color, {}});
  }
  const auto irradiance = static_cast<Index>(request.outputs.size());
  if (view.irradiance.has_value()) request.outputs.push_back({*view.irradiance, {}});
  for (const CameraView::Carried& carried : view.carried) request.outputs.push_back({carried.irradiance, {}});
  if (verdicts != nullptr) verdicts->Ask(rig, &request);
  const auto plan = CompileFor(rig, compiler, request);
  if (!plan.ok()) return plan.status();

  std::vector<Index> triangles;
  std::vector<float> albedo;
  std::vector<Index> carrier;  // of each triangle: in view.carried, or none
  std::vector<Index> shares;   // of each corner: the number of its normal, if there is a look
  Index normals = 0;
  std::vector<Index> first_point(view.meshes.size()), mesh_of, first_triangle;
  Index count = 0;
  for (std::size_t i = 0; i < view.meshes.size(); ++i) {
    const std::size_t m = view.meshes[i];
    first_point[i] = count;
    Index owner = kNoIndex;
    for (std::size_t k = 0; k < view.carried.size(); ++k) {
      if (view.carried[k].mesh == i) owner = static_cast<Index>(k);
    }
    const Mesh::Data& mesh = rig.scene.meshes[m].mesh().data();
    first_triangle.push_back(static_cast<Index>(triangles.size() / 3));
    mesh_of.insert(mesh_of.end(), mesh.triangles.size() / 3, static_cast<Index>(i));
    for (const Mesh::Primitive& primitive : mesh.primitives) {
      for (Index t = 3 * primitive.first_triangle;
           t < 3 * (primitive.first_triangle + primitive.triangle_count); ++t) {
        if (t % 3 == 0) carrier.push_back(owner);
        triangles.push_back(count + mesh.triangles[t]);
        albedo.push_back(std::clamp(primitive.base_color[t % 3], 0.0f, 1.0f));
      }
    }
    if (view.look != nullptr) {
      const MeshLook& look = (*view.look)[m];
      for (const Index corner : look.triangles) shares.push_back(normals + look.smooth[corner]);
      normals += static_cast<Index>(look.points.size());
    }
    count += rig.scene.meshes[m].mesh().point_count();
  }

  std::vector<CameraImage> images(times.size());
  KPSA_RETURN_IF_ERROR(
      EvaluateTimes(rig, *plan, times, options, [&](std::size_t frame, const Evaluator& evaluator) {
        if (verdicts != nullptr) verdicts->Add(FrameNumber(times[frame], rig.fps), evaluator);
        PointBuffer points(count);
        std::size_t at = 0;
        for (Index m = 0; m < view.meshes.size(); ++m) {
          const ConstPointsView from = evaluator.Points(m);
          std::copy_n(from.x, from.count, points.view().x + at);
          std::copy_n(from.y, from.count, points.view().y + at);
          std::copy_n(from.z, from.count, points.view().z + at);
          at += from.count;
        }
        std::vector<DiffuseLight> lights;
        for (Index l = 0; l < view.lights.size(); ++l) {
          lights.push_back({view.lights[l].kind, evaluator.Get<Matrix4>(camera + 1 + 2 * l),
                            evaluator.Get<Double3>(camera + 2 + 2 * l)});
        }
        const Matrix4 world_from_screen = evaluator.Get<Matrix4>(camera);
        const bool head_light = lights.empty() && !view.irradiance.has_value();
        if (head_light) lights.push_back({DiffuseLight::Kind::kPoint, world_from_screen, {1, 1, 1}});
        Result<PathTracer> tracer =
            PathTracer::Build(std::as_const(points).view(), triangles, albedo, lights, {}, shares);
        if (!tracer.ok()) return tracer.status();
        if (head_light) {
          lights.front().color = HeadLightColor(*tracer, world_from_screen);
          KPSA_RETURN_IF_ERROR(tracer->Update(std::as_const(points).view(), lights));
        }
        CameraImage& image = images[frame];
        const std::size_t pixels = std::size_t{view.width} * view.height;
        image.width = view.width, image.height = view.height;
        for (std::vector<float>* layer : {&image.albedo, &image.direct, &image.indirect})
          layer->assign(3 * pixels, 0);
        image.hit.assign(pixels, 0);
        // Light after bounces, at a pixel: its own, or what the points around say of a carried mesh
        const auto indirect = [&](std::size_t p, const ShadingPlace& place) -> Double3 {
          const auto at = [](const ConstPointsView& light, std::size_t i) {
            return Double3{light.x[i], light.y[i], light.z[i]};
          };
          if (!place.hit || !view.irradiance.has_value()) return {};
          const Index owner = carrier[place.triangle];
          if (owner == kNoIndex) return at(evaluator.Points(irradiance), p);
          const ConstPointsView light = evaluator.Points(irradiance + 1 + owner);
          const Index* corner = &triangles[3 * std::size_t{place.triangle}];
          const Index first = first_point[view.carried[owner].mesh];
          return at(light, corner[0] - first) * (1 - place.u - place.v) +
                 at(light, corner[1] - first) * place.u + at(light, corner[2] - first) * place.v;
        };
        const auto spread = [&](std::size_t p, Double3 direction) {  // from the pixel beside it, in its row
          Double3 origin, other;
          const std::size_t beside = (p + 1) % image.width == 0 && image.width > 1 ? p - 1 : p + 1;
          PixelRay(world_from_screen, static_cast<Index>(beside), view.width, view.height, &origin, &other);
          return Length(UnitOrZero(other) - UnitOrZero(direction));
        };
        const auto shade = [&](std::size_t begin, std::size_t end) {
          for (std::size_t p = begin; p < end; ++p) {
            Double3 origin, direction;
            PixelRay(world_from_screen, static_cast<Index>(p), view.width, view.height, &origin, &direction);
            const ShadingPlace place = tracer->Look(origin, direction);
            const Double3 light =
                tracer->Direct(place, static_cast<std::uint32_t>(p) * 0x9e3779b1u, kAreaSamples);
            image.hit[p] = place.hit;
            const Double3 bounced = indirect(p, place);
            Double3 texel = {1, 1, 1};
            if (place.hit && view.look != nullptr) {
              const Index i = mesh_of[place.triangle];
              texel = TextureColor((*view.look)[view.meshes[i]], place.triangle - first_triangle[i], place,
                                   std::as_const(points).view(), &triangles[3 * std::size_t{place.triangle}],
                                   spread(p, direction) * Length(place.position - origin));
            }
            for (int k = 0; k < 3; ++k) {
              image.albedo[3 * p + static_cast<std::size_t>(k)] =
                  static_cast<float>(place.albedo[k] * texel[k]);
              image.direct[3 * p + static_cast<std::size_t>(k)] = static_cast<float>(light[k]);
              image.indirect[3 * p + static_cast<std::size_t>(k)] = static_cast<float>(bounced[k]);
            }
          }
        };
        ParallelFor(pixels, 256, shade);
        return Status();
      }));
  return images;
}

}  // namespace kpsa::engine
