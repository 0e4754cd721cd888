// Where a rig is looked at from, as people say it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "picture/rig_picture.h"

namespace kpsa::engine {

struct Framing {
  double azimuth = 0.45, elevation = 0.12;  // radians
  std::optional<Double3> look_at;  // the middle of the picture, world space; unset: of what is framed
  double zoom = 1;                 // above 0; 2: twice as large
  std::optional<std::string> fit;  // "face", or a joint, material or mesh that fills the picture; unset: all
};

// A camera that sees all of the poses, or of them what is to fill the picture; with `around`, so many from all around
// that show it equally large, starting from the front. Errors: nothing of the name is there, or it is not shown.
Result<std::vector<Camera>> FrameRig(const Rig& rig, const std::vector<Pose>& poses,
                                     const RenderOptions& options, const Framing& framing, int around = 0);

// The meshes of those names, or, without any, the ones that are shown. Errors: no such mesh.
Result<std::vector<std::size_t>> ChooseMeshes(const Rig& rig, std::span<const std::string> names);

}  // namespace kpsa::engine
