// Rows of pictures that a camera of the rig takes (picture/camera_picture.h).
#pragma once

#include <optional>
#include <vector>

#include "picture/camera_picture.h"

namespace kpsa::engine {

struct CameraTake {
  CameraView view;
  double exposure = 1;
  CameraLayer layer = CameraLayer::kAll;
  int shrink = 1;  // each pixel is the mean of so many each way
};

// Every frame with its caption, six in a row. With an acceleration a row a frame: full, accelerated, and how far the
// light after bounces is apart, with its legend; subspaces are put into the rig.
Result<std::vector<Image>> DrawCameraStrip(Rig* rig, Compiler* compiler, const CameraTake& take,
                                           const std::optional<AccelerationChoice>& acceleration,
                                           const std::vector<double>& times, const RigFrameOptions& options);

}  // namespace kpsa::engine
