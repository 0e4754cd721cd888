// From a rig's evaluated points to pictures.
#pragma once

#include <string>
#include <vector>

#include "host/rig_frames.h"
#include "host/verdicts.h"
#include "picture/look.h"
#include "picture/picture.h"

namespace kpsa::engine {

// The points of all meshes at one time, x y z interleaved; none of those that are hidden.
using Pose = std::vector<std::vector<float>>;

// The final points of some meshes, ascending, at the times; and what the rig's KPSA nodes decided, where somebody asks.
Result<std::vector<Pose>> EvaluatePoses(const Rig& rig, Compiler* compiler, const std::vector<double>& times,
                                        const RigFrameOptions& options, const std::vector<std::size_t>& shown,
                                        Verdicts* verdicts = nullptr);
// One part a mesh that has points in the pose. Refers to the look.
RenderInput MakeInput(const RigLook& look, const Pose& pose);
// The points that the subspaces measure, on the pose.
RenderDots KeyPoints(const std::vector<AppliedSubspace>& applied, const Pose& pose);
double WorstDistance(const Pose& a, const Pose& b);  // metres

// "accelerated", "blend: 12 % full", "miss: fully evaluated": what a picture of such a frame shows.
std::string PictureTitle(const FrameDecision& decision);
std::string VerdictWord(const FrameDecision& decision);  // "hit", "blend" or "miss"
// What is shown, for DrawCaption: "head, talk, frame 12", and the same in shorter ways. `more` comes after it.
std::vector<std::string> Captions(const Rig& rig, double time, const std::string& more = "");

}  // namespace kpsa::engine
