// What `kpsa init` decides by itself of an accelerate entry: which clips train and which one tests, how large
// the tolerance is, how many poses are drawn.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "rig/build/point_motion.h"

namespace kpsa::engine {

inline constexpr double kUnsaidFps = 24;  // of a rig that says nothing else
// Frames a second that the keys of most clips fall onto: kUnsaidFps before others that are usual; it, too, where none fits.
double FramesOfKeys(const std::vector<gltf::Clip>& clips);

// Frames [first, last] of a clip.
struct ClipPart {
  std::int64_t first = 0, last = 0;
  bool test = false;
};
// A clip in parts that alternate, a quarter of it to test on, with gaps in between: neighbouring frames are
// nearly the same, and would flatter. Of the places where tests may lie, one in which the points move half as
// much as in the whole clip, and where they go least beyond the rest of it. None of a clip of less than
// kLeastFrames. `poses` is of the whole clip, evenly spread; `fps` frames a second.
std::vector<ClipPart> CutClip(const PointPoses& poses, std::int64_t frames, double fps = kUnsaidFps);
inline constexpr std::int64_t kLeastFrames = 24;

struct StarterTraining {
  std::vector<std::string> train, test;  // clips
  std::vector<std::string> still;        // clips that move no point while they play, or cannot be evaluated
  // Where one clip alone moves the points: its parts; it is then neither in `train` nor in `test`.
  std::string cut;
  std::vector<ClipPart> parts;
  std::int64_t frames = 0;  // that are trained on, about
  double motion = 0;        // PointPoses::Motion in the space, of what is trained on (RMS of clips); metres
  bool by_clips = true;     // motion is that of clips; of mixtures of controls if not
  bool deforms = false;     // whether clips or controls do more than move everything as a whole
};
// `motions` is by clip. Errors: those of evaluating the controls.
Result<StarterTraining> ChooseTraining(Rig* rig, std::optional<NodeId> space,
                                       const std::vector<ClipMotion>& motions,
                                       const std::vector<ControlPlug>& controls);

// What is hardly seen: kToleranceOfSize of the diagonal, but no more than kToleranceOfMotion of the motion (0:
// there is none to go by); as 1, 2 or 5 times a power of ten. Metres.
double StarterTolerance(double diagonal, double motion);
inline constexpr double kToleranceOfSize = 0.003, kToleranceOfMotion = 0.3;

// Poses to draw from so many controls: enough that each is seen with others, and not so many that training
// takes minutes.
int StarterSamples(std::size_t controls, std::int64_t clip_frames);

}  // namespace kpsa::engine
