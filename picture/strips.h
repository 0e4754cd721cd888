// Rows of pictures of a rig: frames side by side, from all around, or full against accelerated.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "picture/framing.h"

namespace kpsa::engine {

struct StripView {
  RenderOptions options;
  Framing framing;
  std::vector<std::string> meshes;    // that are drawn; none: those that are shown
  int turntable = 0;                  // pictures from all around; 0: from the camera's place alone
  std::optional<double> error_scale;  // metres at the top of the heat map; unset: the tolerance
  bool textures = true;               // of base colours
};

// Every frame with its caption, six in a row; with a turntable the first time from all around. Notes say which
// textures are left out.
Result<std::vector<Image>> DrawStrip(const Rig& rig, Compiler* compiler, const std::vector<double>& times,
                                     const StripView& view, const RigFrameOptions& options,
                                     std::vector<std::string>* notes);

// A row a frame: full, what is measured, accelerated, the error and its legend. Puts subspaces into the rig.
struct ComparedFrames {
  std::vector<Image> rows;
  std::size_t worst = 0;  // of the times: the one with the largest error
  double error = 0;       // metres, that
};
// `all`: of every time, else of the one with the largest error.
Result<ComparedFrames> CompareFrames(Rig* rig, Compiler* compiler, const AccelerationChoice& choice,
                                     const std::vector<double>& times, bool all, const StripView& view,
                                     const RigFrameOptions& options, std::vector<std::string>* notes);

// Lets the first of the clips play that the rig's subspaces are tested with, if it names any.
Status PlayTestClip(Rig* rig);

// What the scale of an error goes by: the tolerance in force, or the trained one where any error may pass;
// above 0, as errors are divided by it.
double ShownTolerance(const AppliedSubspace& applied);

}  // namespace kpsa::engine
