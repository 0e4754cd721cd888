// From a rig's evaluated points to pictures.
#pragma once

#include <vector>

#include "host/rig_frames.h"
#include "host/verdicts.h"
#include "picture/picture.h"

namespace kpsa::engine {

// The points of all meshes at one time, x y z interleaved; none of those that are hidden.
using Pose = std::vector<std::vector<float>>;

// The final points of the meshes that are shown, at the times; and what the rig's KPSA nodes decided, where
// somebody asks.
Result<std::vector<Pose>> EvaluatePoses(const Rig& rig, Compiler* compiler, const std::vector<double>& times,
                                        const RigFrameOptions& options, Verdicts* verdicts = nullptr);
// One part a mesh, with the file's vertex colours if it has them; or one a primitive where materials have
// colours. Refers to both arguments.
RenderInput MakeInput(const Rig& rig, const Pose& pose);
// A camera that sees all of the poses.
Camera FramePoses(const Rig& rig, const std::vector<Pose>& poses, const RenderOptions& options,
                  double azimuth, double elevation);
// The points that the subspaces measure, on the pose.
RenderDots KeyPoints(const std::vector<AppliedSubspace>& applied, const Pose& pose);
double WorstDistance(const Pose& a, const Pose& b);  // metres
// Pictures below each other.
Image StackRows(const std::vector<Image>& rows);

// "accelerated", "blend: 12 % full", "miss: fully evaluated": what a picture of such a frame shows.
std::string PictureTitle(const FrameDecision& decision);

}  // namespace kpsa::engine
