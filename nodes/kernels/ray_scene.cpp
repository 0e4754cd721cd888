#include "nodes/kernels/ray_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/check.h"
#include "base/embree.h"

namespace kpsa::engine {
namespace {

RTCRay ToEmbree(const Ray& ray) {
  RTCRay out = {};
  out.org_x = ray.origin[0];
  out.org_y = ray.origin[1];
  out.org_z = ray.origin[2];
  out.tnear = ray.near;
  out.dir_x = ray.direction[0];
  out.dir_y = ray.direction[1];
  out.dir_z = ray.direction[2];
  out.tfar = ray.far;
  out.mask = 0xffffffffu;
  return out;
}

}  // namespace

struct RayScene::Impl {
  EmbreeScene scene;
  RTCGeometry geometry = nullptr;  // the scene's; null without triangles
  float* xyz = nullptr;            // the geometry's
  std::size_t points = 0;
};

RayScene::RayScene(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;

namespace {

Status CheckFinite(ConstPointsView points) {
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!std::isfinite(points.x[i]) || !std::isfinite(points.y[i]) || !std::isfinite(points.z[i]))
      return Status::Invalid("point {} is not finite", i);
  }
  return Status();
}

void Interleave(ConstPointsView points, float* xyz) {
  for (std::size_t i = 0; i < points.count; ++i) {
    xyz[3 * i] = points.x[i];
    xyz[3 * i + 1] = points.y[i];
    xyz[3 * i + 2] = points.z[i];
  }
}

}  // namespace

Result<RayScene> RayScene::Build(ConstPointsView points, std::span<const Index> triangles) {
  if (triangles.size() % 3 != 0) {
    return Status::Invalid("{} triangle indices are not a multiple of 3", triangles.size());
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (triangles[i] >= points.count) {
      return Status::Invalid("triangle {} names point {}, there are {} points", i / 3, triangles[i],
                             points.count);
    }
  }
  KPSA_RETURN_IF_ERROR(CheckFinite(points));
  auto impl = std::make_unique<Impl>();
  impl->points = points.count;
  if (triangles.empty()) return RayScene(std::move(impl));
  RTCDevice device = EmbreeDevice();
  if (device == nullptr) return Status::Evaluation("the ray tracer (Embree) cannot start on this machine");
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* xyz = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points.count));
  auto* corner = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles.size() / 3));
  if (xyz == nullptr || corner == nullptr) {
    rtcReleaseGeometry(geometry);
    return Status::Evaluation("no memory for {} triangles in the ray tracer", triangles.size() / 3);
  }
  Interleave(points, xyz);
  for (std::size_t i = 0; i < triangles.size(); ++i) corner[i] = triangles[i];
  impl->geometry = geometry;
  impl->xyz = xyz;
  RTCError error = RTC_ERROR_NONE;
  impl->scene = CommitEmbreeScene(geometry, &error);
  if (error != RTC_ERROR_NONE) {
    return Status::Evaluation("the ray tracer failed to build over {} triangles (Embree error {})",
                              triangles.size() / 3, static_cast<int>(error));
  }
  return RayScene(std::move(impl));
}

Status RayScene::Update(ConstPointsView points) {
  KPSA_CHECK_EQ(points.count, impl_->points);
  KPSA_RETURN_IF_ERROR(CheckFinite(points));
  if (impl_->geometry == nullptr) return Status();
  Interleave(points, impl_->xyz);
  rtcUpdateGeometryBuffer(impl_->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  if (const RTCError error = RefitEmbreeScene(impl_->scene, impl_->geometry); error != RTC_ERROR_NONE)
    return Status::Evaluation("the ray tracer failed to move its points (Embree error {})",
                              static_cast<int>(error));
  return Status();
}

void RayScene::ClosestHits(std::span<const Ray> rays, std::span<RayHit> hits) const {
  KPSA_CHECK_EQ(rays.size(), hits.size());
  if (impl_->scene == nullptr) {
    std::fill(hits.begin(), hits.end(), RayHit());
    return;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    RTCRayHit query = {};
    query.ray = ToEmbree(rays[i]);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(impl_->scene.get(), &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
      hits[i] = {};
    } else {
      hits[i] = {query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
    }
  }
}

void RayScene::Occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
  KPSA_CHECK_EQ(rays.size(), occluded.size());
  if (impl_->scene == nullptr) {
    std::fill(occluded.begin(), occluded.end(), std::uint8_t{0});
    return;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    RTCRay ray = ToEmbree(rays[i]);
    rtcOccluded1(impl_->scene.get(), &context, &ray);
    occluded[i] = ray.tfar < 0 ? 1 : 0;  // Embree reports a hit as minus infinity
  }
}

}  // namespace kpsa::engine
