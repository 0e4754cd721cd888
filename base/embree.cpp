#include "base/embree.h"

namespace kpsa::engine {

RTCDevice EmbreeDevice() {
  static RTCDevice device = rtcNewDevice(nullptr);
  return device;
}

EmbreeScene CommitEmbreeScene(RTCGeometry geometry, RTCError* error) {
  RTCDevice device = EmbreeDevice();
  rtcGetDeviceError(device);  // what others of this thread left
  EmbreeScene scene(rtcNewScene(device));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC);
  // Low for the scene: its geometry then has a structure of its own, which can be refitted; that one is built
  // by surface area without spatial splits, one layout an input
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_LOW);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_REFIT);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene.get());
  *error = rtcGetDeviceError(device);
  if (*error != RTC_ERROR_NONE) scene = nullptr;
  return scene;
}

RTCError RefitEmbreeScene(const EmbreeScene& scene, RTCGeometry geometry) {
  rtcGetDeviceError(EmbreeDevice());
  rtcCommitGeometry(geometry);
  rtcCommitScene(scene.get());
  return rtcGetDeviceError(EmbreeDevice());
}

}  // namespace kpsa::engine
