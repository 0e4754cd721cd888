// Pictures as a camera of the rig takes them: direct light is computed here, exactly and anew for every
// frame; light after bounces comes from the graph, from the indirectIllumination that looks through the same
// camera.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/rig_frames.h"
#include "host/verdicts.h"
#include "nodes/kernels/path_tracer.h"
#include "picture/image.h"
#include "picture/look.h"

namespace kpsa::engine {

struct CameraView {
  PlugRef world_from_screen;
  std::optional<PlugRef> irradiance;  // of the illumination that looks through the camera
  struct Carried {
    PlugRef irradiance;    // at the points of a mesh
    std::size_t mesh = 0;  // in `meshes`
  };
  std::vector<Carried> carried;  // by the illumination
  struct Light {
    DiffuseLight::Kind kind;
    PlugRef matrix, color;
  };
  std::vector<Light> lights;        // of the illumination; all of the rig where there is none
  std::vector<std::size_t> meshes;  // that are lit, in rig.scene.meshes
  Index width = 400, height = 400;  // of the illumination
  // Whose textures are multiplied with base colours, and whose edges are hard; null: no textures, edges of more than 50
  // degrees.
  std::shared_ptr<const RigLook> look;
};

// The view of a camera node. Errors: no such camera (the nearest one is named), several illuminations that
// use it.
Result<CameraView> FindCamera(const Rig& rig, const std::string& name);
// The same view with what subspaces say of its light after bounces.
CameraView AcceleratedView(const CameraView& view, const Rig& rig,
                           const std::vector<AppliedSubspace>& applied);

// One picture, by a light at the camera where there is none: linear light, 3 numbers a pixel, row by row from the top left.
struct CameraImage {
  Index width = 0, height = 0;
  std::vector<float> albedo, direct, indirect;  // reflectance; irradiances
  std::vector<char> hit;                        // whether the pixel shows a surface
};
// Also what the rig's KPSA nodes decided, where somebody asks.
Result<std::vector<CameraImage>> EvaluateCamera(const Rig& rig, Compiler* compiler, const CameraView& view,
                                                const std::vector<double>& times,
                                                const RigFrameOptions& options, Verdicts* verdicts = nullptr);

enum class CameraLayer { kAll, kDirect, kIndirect };
// Radiance albedo / pi times irradiance, times `exposure`, as sRGB; light beyond 1 is compressed smoothly.
Image Develop(const CameraImage& picture, double exposure, CameraLayer layer = CameraLayer::kAll);

// How far two pictures' light after bounces is apart at each pixel, as a heat map from 0 to `error_max`
// (irradiance).
Image LightError(const CameraImage& a, const CameraImage& b, double error_max);

}  // namespace kpsa::engine
