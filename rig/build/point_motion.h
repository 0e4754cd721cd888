// How far clips and controls move the points of a character: what `kpsa init` decides by. Points are those of
// the file's own deformers, all shown meshes together; motion is seen from a space (a transform; none: the
// world), in metres as the space stands at rest.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "rig/build/rig_builder.h"
#include "rig/character/clip_motion.h"

namespace kpsa::engine {

// Poses of some of the points, spread over all of them.
struct PointPoses {
  std::vector<double> times;  // seconds, where they are of a clip
  std::size_t points = 0;     // a pose
  std::vector<float> rows;    // x y z of each point, by pose; in the space
  double travel = 0;          // the farthest that a point gets from the first pose, in the world; metres
  bool deforms = false;       // whether any point (of all) moves against the others, and not all as a whole
  std::size_t poses() const { return points == 0 ? 0 : rows.size() / (3 * points); }
  // RMS distance of points from their mean over the poses [begin, end), of the tenth of them that moves most:
  // most of a face is still while its mouth moves. Metres.
  double Motion(std::size_t begin, std::size_t end) const;
  double Motion() const { return Motion(0, poses()); }
  // The farthest that a point gets from its mean.
  double Largest() const;
  // By pose: RMS distance of the points from their mean.
  std::vector<double> DistancesFromMean() const;
};

struct ControlPlug {
  PlugRef plug;
  MotionRange range;  // runtime units
};

// Refers to the rig, which has no clip before and after each call. Errors: those of evaluation, and points
// that are not finite.
class MotionMeter {
 public:
  MotionMeter(Rig* rig, std::optional<NodeId> space) : rig_(rig), space_(space) {}
  // At most so many frames of the clip, evenly spread; all of them where there are no more.
  Result<PointPoses> OfClip(const std::string& clip, double fps, std::size_t most);
  // Mixtures of 3 to 6 controls, always the same ones, then (for `deforms` only) each control at both ends.
  Result<PointPoses> OfControls(const std::vector<ControlPlug>& controls);

 private:
  Result<std::shared_ptr<const Plan>> Compile(std::vector<PlugRef> varying);
  Status Prepare();
  std::vector<Double3> Read(const Evaluator& evaluator) const;
  Status Add(const Evaluator& evaluator, bool keep, PointPoses* poses);

  Rig* rig_;
  std::optional<NodeId> space_;
  Compiler compiler_;
  bool prepared_ = false;
  std::vector<Double3> rest_;  // of all points, in the world
  Matrix4 space_at_rest_;
  std::vector<Index> anchors_;  // points far from each other: who keeps its distances to them is still
  std::vector<Double3> first_;  // pose of the present poses, in the world
};

}  // namespace kpsa::engine
