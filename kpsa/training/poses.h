// Training poses: which control values to evaluate. Seeded and independent of the machine.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "graph/graph.h"
#include "kpsa/pose_kind.h"

namespace kpsa::engine {

struct Branch;  // kpsa/training/branches.h

struct ControlRange {
  PlugRef plug;
  double min = 0, max = 0, rest = 0;
  bool by_clip = false;  // a clip drives it while it plays
  bool often = false;    // it carries the space of the points: half of the mixtures move it
  std::optional<PlugRef> shown =
      {};  // where the value can be read that gives what a clip does (poseRotate.x for rotateX)
  std::optional<RotateOrder> turns = {};  // that is an angle of a turn: each pose has others, too
  // What the attribute itself admits, where that is more than [min, max]; whole numbers admit nothing more.
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  double margin = 0;  // of its range: how far beyond its ends guards let it (kpsa/training/range_margins.h)
  double tilt = 0;    // training turns it so far from rest, though its range is less (kpsa/training/tilts.h)
};

// Whether b belongs to the node of a, the control before it: controls of a node are neighbours; a mesh's many weights are
// each on their own.
inline bool OfOneNode(const ControlRange& a, const ControlRange& b) {
  return a.plug.node == b.plug.node && b.plug.element < 0;
}

// Control values of one pose (by control), and where in the training clips it plays: clip < 0 is the rest
// pose.
struct SampledPose {
  std::vector<double> values;
  int clip = -1;
  double phase = 0;  // 0..1 of the clip
  PoseKind kind = PoseKind::kSampled;
  bool near_clips = false;  // made of frames of the clips: what playback resembles
};

// What the controls have to be at the frames of the training clips to give the same pose without a clip: one
// row a frame, by control. Real poses move many controls at once, in ways that no independent sampling finds.
using ClipPoses = std::vector<std::vector<double>>;

// Controls that move the same points, and therefore act together: groups of indices of controls, one for each
// of some points. A deformer stack is nearly linear in controls that are far from each other.
using ControlGroups = std::vector<std::vector<std::size_t>>;

// Every control at its ends alone, the others at rest: 2 poses a control, first min, then max.
std::vector<SampledPose> Sweeps(const std::vector<ControlRange>& controls);

// `count` poses, in shares (the first two where there are such):
//   0.45 a frame of the clips, exaggerated or weakened, each node's controls from one or the other of two
//        frames, and a few controls on top;
//   0.2  a group of controls that act together, and a few controls on top;
//   0.35 mixtures of several controls at random values, every second one laid over a random frame of a random
//        clip.
// Without controls: random times of the clips.
std::vector<SampledPose> SamplePoses(const std::vector<ControlRange>& controls, const ClipPoses& clip_poses,
                                     const ControlGroups& groups, std::size_t clips, std::size_t count,
                                     std::uint64_t seed);

// `count` poses in which most controls move at once, each node's together. What has no other inputs than the
// joints near it learns them all from each of these.
std::vector<SampledPose> PosesTogether(const std::vector<ControlRange>& controls, std::size_t count,
                                       std::uint64_t seed);

// `count` poses in which most of what bends one way is bent that way, as far as it goes or less far, each node's together:
// fists, folded wings, a crouch. Of what turns both ways, one axis of a node turns anywhere or to an end, and the others a
// little; in every second pose it is the same axis and end of all nodes, as a tail curls.
// Of many branches that hang from one node, a few (StillBranches); branches: BranchesOf the controls.
std::vector<SampledPose> PosesFolded(const std::vector<ControlRange>& controls,
                                     std::span<const Branch> branches, std::size_t count, std::uint64_t seed);

// `count` poses with many controls away from rest, from eight up to all of them: anywhere in their ranges, and in every
// second pose at their ends.
std::vector<SampledPose> PosesWithMany(const std::vector<ControlRange>& controls, std::size_t count,
                                       std::uint64_t seed);

// The controls that no frame of the clips moves and no clip drives: those of deformers, above all. Without clips, none.
std::vector<std::size_t> HeldControls(const std::vector<ControlRange>& controls, const ClipPoses& clip_poses);

// `each` poses of each of these controls, control after control, over a clip: at its ends in turn, or 70 % of the way there and more.
std::vector<SampledPose> PosesAlone(const std::vector<ControlRange>& controls,
                                    std::span<const std::size_t> held, std::size_t each, std::size_t clips,
                                    std::uint64_t seed);

// `count` poses of a kind; none where there are no controls for it (or groups, of kNeighbours; or clips, of kHeld).
std::vector<SampledPose> PosesOfKind(PoseKind kind, const std::vector<ControlRange>& controls,
                                     const ClipPoses& clip_poses, const ControlGroups& groups,
                                     std::size_t clips, std::size_t count, std::uint64_t seed);

}  // namespace kpsa::engine
