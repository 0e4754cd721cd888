// Rig -> subspace: evaluates training poses on the unaccelerated graph, finds modes and cues, and calibrates
// SoftCache on held-out poses.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kpsa/accelerate.h"
#include "kpsa/miss.h"
#include "kpsa/training/poses.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {

struct TrainingClip {
  std::string name;
  std::vector<double> times;  // seconds
  bool learnt = false;  // frames about misses (kpsa/training/learner.h), not a clip that the rig trains on
};

struct TrainOptions {
  EstimatorMode mode = EstimatorMode::kMap;
  int max_modes = 250;     // map; paper mode takes key_points / 2
  std::size_t rows = 300;  // of measurements: a point takes 3, an entry of a signal 1
  // Cues of each tile (kpsa/training/tile_cues.h) instead of these where that is expected to cost less.
  bool may_have_cues_by_tile = true;
  std::size_t min_points = 16;        // that are measured
  std::size_t key_points = 80;        // paper mode
  std::size_t samples = 0;            // of the controls, besides the clips
  std::size_t calibration_poses = 0;  // of each kind (PoseKind); 0: CalibrationWithin
  std::uint64_t seed = 1;
  double tolerance = 1e-4, violation_rate = 0.01;  // metres, or light; share of frames
  bool keep_modes = false;                         // in the subspace, for reports (Subspace::kept_modes)
  double range_ramp = 0.05;                        // of a trained extent: how fast guards come in
  std::size_t max_light_candidates = 4000;         // shading points that may become cues
  std::vector<Miss> learnt_poses;                  // posed misses; their clips are trained on
  // Where tiles have cues of their own: what was learnt teaches only those that miss it, and all others are
  // those of the training without it, byte for byte (kpsa/training/tile_learning.h).
  bool by_tile_as_before = false;
  // Inner points of last steps (graph/last_step.h) instead of what comes out of these: where that is expected to cost
  // less, or as a subspace has it that learns.
  enum class Inner : std::uint8_t { kIfCheaper, kNever, kAlways } inner = Inner::kIfCheaper;
  // With kAlways: of these points alone, by mesh; without any, of all.
  std::vector<SteppedPoints> stepped = {};
  // Controls that are left at rest, as people write their plugs, as a subspace has it that learns (TrainingRecord::at_rest).
  std::vector<std::string> at_rest = {};
  // Others may be found that are better left at rest (TrainingRecord::at_rest), in a second training.
  bool may_leave_at_rest = true;
  // About how long training may take: fewer poses, no cues of tiles, and a shorter calibration, where
  // that is too short. Which poses fit depends on the machine; with time enough, the subspace is that without
  // a limit.
  double seconds = std::numeric_limits<double>::infinity();
  // Points of all meshes: where there are more, about so many of them say how, and then all are trained
  // (kpsa/training/whole_subspace.h).
  std::size_t many_points = 24'000, some_points = 16'000;
  // From so many tiles on cues of these are made first, and taken where few judges miss.
  std::size_t many_tiles = 64;
  // Parts that training does without, to tell what each is worth (bench_ablation --parts).
  struct Without {
    bool relative_matrices = false;  // as cues
    bool cue_products = false;       // hinges included
    bool hinges = false;
    bool tile_products = false;  // where all points share cues: SoftCache's own score alone judges them
    bool patches = false;        // every miss is one of all points
    bool mends = false;          // points by last steps
    bool trust = false;          // the doubts of all tiles count alike
    bool miss_costs = false;  // cues by the error they leave, at the first place; no finer tiles for misses
  } without;
  // On the thread that trains, at each stage, and some times a second within those that take long; false cancels. May
  // be null.
  std::function<bool(const char* what, double share)> progress;
};

// What the trainer needs of a rig. set_clip lets a clip of the character play (nullopt: the rest pose).
struct TrainingRig {
  Graph* graph = nullptr;
  PlugRef time;
  AccelerationTarget target;
  std::vector<ControlRange> controls;
  std::function<Status(std::optional<std::string_view>)> set_clip;
  // What clips move and no control does, in the ranges that they have there: it is posed like the controls
  // where the points depend on it (kpsa/training/clip_controls.h).
  std::vector<ControlRange> by_clips = {};
  // By mesh, with steps where inner points are trained on (graph/last_step.h); empty: nowhere. Train's own.
  std::vector<Compiler::SplitPoints> split = {};
  // By mesh, the points of which alone that is (kpsa/partial_step.h); empty: all. Train's own.
  std::vector<SteppedPoints> stepped = {};
  // By mesh, the points that training chooses by, ascending; empty: all (kpsa/training/some_points.h). Of so many, one is
  // among them. Train's own.
  std::vector<std::vector<Index>> some = {};
  Index every = 1;
  const LastStep* step(std::size_t mesh) const { return split.empty() ? nullptr : split[mesh].step.get(); }
  // What is reconstructed of a mesh that has so many points; where these are not inner ones: which point it is.
  Index rows(std::size_t mesh, Index points) const {
    return step(mesh) == nullptr ? (points + every - 1) / every
                                 : static_cast<Index>(step(mesh)->inner_points());
  }
  Index PointOf(std::size_t mesh, Index row) const { return some.empty() ? row : some[mesh][row]; }
  // Lets a clip of these play; -1: none.
  Status Play(const std::vector<TrainingClip>& clips, int clip) const;
  // The controls that vary while a clip plays, which drives the others, or while none does; and with time, their plugs.
  std::vector<std::size_t> FreeControls(bool playing) const;
  std::vector<PlugRef> Varying(bool playing) const;
};

// The rig with some of its controls at rest: as people write their plugs (Graph::AuthoredName).
TrainingRig AtRest(TrainingRig rig, const std::vector<std::string>& controls);

// Errors: no poses, nothing moves, a pose that fails to evaluate (its clip and time or its controls),
// cancelled (kInterrupted). The graph comes back without a clip.
// Clips are trained on at the given times and between them. Besides the sampled poses of PoseKind::kSampled,
// a fifth of the samples is of the other kinds; each kind has calibration poses of its own.
// Light (AccelerationTarget::colors) has noise: a fifth of the training poses chooses the number of modes
// (kpsa/training/mode_choice.h), and errors are the RMS over a frame's shading points, since no subspace
// knows the noise of one of them.
Result<Subspace> Train(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                       const TrainOptions& options);

}  // namespace kpsa::engine
