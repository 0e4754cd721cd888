// The door to Embree (3.13): no other file includes its header.
//
// Scenes hold one geometry each, whose search structure is built once; a commit after that fits its boxes to
// where the geometry is now.
#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <type_traits>

namespace kpsa::engine {

// One for the process (devices are costly, and every scene holds a reference). Null where Embree cannot
// start.
RTCDevice EmbreeDevice();

struct EmbreeRelease {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, EmbreeRelease>;

// A committed scene that owns the geometry, one of the device above; null, with the error, where that fails.
EmbreeScene CommitEmbreeScene(RTCGeometry geometry, RTCError* error);
// After the geometry has moved; its buffers must be marked before. The scene is of no use after an error.
RTCError RefitEmbreeScene(const EmbreeScene& scene, RTCGeometry geometry);

}  // namespace kpsa::engine
