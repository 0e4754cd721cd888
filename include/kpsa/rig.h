// A loaded rig: what it has, and rigs like it whose points come from trained subspaces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kpsa/bench.h"
#include "kpsa/edit.h"
#include "kpsa/graph_info.h"
#include "kpsa/library.h"
#include "kpsa/result.h"

namespace kpsa {

// A plug that animators move. Values are in the units of the rig's file (degrees, say).
struct ControlInfo {
  enum class Unit { kNone, kLength, kAngle, kTime };
  std::string name;                    // "jaw.rotateX"
  double min = 0, max = 0, value = 0;  // its range, and where it rests
  Unit unit = Unit::kNone;
  double si = 1;  // metres, radians or seconds for one of the file's units
};
struct ClipInfo {
  std::string name;
  double begin = 0, end = 0;  // seconds
};
struct MeshInfo {
  std::string name;                      // "head_mesh"
  std::size_t vertices = 0;              // of all primitives of the glTF mesh, one after the other
  std::vector<std::uint32_t> triangles;  // three vertices each
  std::vector<std::string> stages;       // of its deformer stack: "morph", "skin", "mush"
  std::vector<std::string> stage_nodes;  // by stage: the node that computes it
};

// How a rig is accelerated (docs/accelerate.md).
struct AccelerationOptions {
  std::string subspace = {};             // a .kpsa file; "": those that the rig names
  std::optional<double> tolerance = {};  // the largest error of a point, metres; infinity: every frame is
                                         // reconstructed; unset: the subspace's own
  std::optional<double> violation_rate = {};  // share of frames that may exceed it; unset: the subspace's own
  bool stale_is_miss = false;  // a subspace of another version of the rig evaluates everything fully, instead
                               // of being refused
};

// What to train; unset numbers are the rig's, or chosen by the trainer.
struct TrainingOptions {
  std::string entry = {};                   // of the rig's accelerate section; "" where it has one
  std::optional<std::size_t> samples = {};  // poses drawn from the controls, besides the clips
  std::optional<std::size_t> calibration =
      {};  // held-out poses of each kind that the tolerance is calibrated with
  std::optional<std::size_t> key_points = {};                 // that are measured, at least
  std::optional<double> tolerance = {}, violation_rate = {};  // metres; share of frames
  std::vector<std::string> clips = {};                        // to train on, instead of the rig's
  std::uint64_t seed = 1;
  double seconds = std::numeric_limits<double>::infinity();  // about how long it may take
  int threads = 0;                                           // 0: all
  bool paper = false;  // the method of the paper as it stands (Meyer and Anderson 2007)
  // What is being done, and the share of it, 0 to 1; false cancels. On the thread that trains; some
  // times a second, with the same words, while a part takes long.
  std::function<bool(std::string_view what, double share)> progress = {};
};
struct TrainingReport {
  std::string subspace;                         // the file that was written
  std::size_t points = 0, cues = 0, modes = 0;  // reconstructed points; measured places; modes
  double held_out_rms = 0, held_out_max = 0;    // metres, over poses that were not trained on
  double tolerance = 0;                         // metres
  double hit_rate = 0;                          // expected of frames like those of the clips
  std::string warning;                          // what could not be met, or ""
};

// Immutable; copies share it, and so may threads.
class Rig {
 public:
  const std::string& path() const;
  double fps() const;
  std::span<const ControlInfo> controls() const;
  std::span<const ClipInfo> clips() const;
  std::span<const MeshInfo> meshes() const;               // that are shown
  std::span<const std::string> notes() const;             // what may surprise, a sentence each
  const MeshInfo* FindMesh(std::string_view name) const;  // null if there is none

  // The graph, to be walked: nodes in the order of their creation, and connections by destination. Without clips, whose
  // nodes come in when a scene plays them, and of an accelerated rig without its subspaces' nodes. Made at each call.
  std::vector<NodeInfo> Nodes() const;
  std::vector<ConnectionInfo> Connections() const;
  // What a plug ("mush.iterations", "upper.rotateX", "squeeze.value[2]") holds where nothing drives it. Errors: no
  // such plug, an output.
  Result<PlugValue> Value(std::string_view plug) const;

  // The rig whose accelerated points come from subspaces; this one, and its scenes, stay as they are. Errors:
  // no such file, one that is damaged, stale, or of other points.
  Result<Rig> Accelerated(const AccelerationOptions& options = {}) const;
  bool is_accelerated() const;
  // A rig like this one with a graph that `edit` has changed; its controls rest where the edit has set them.
  // Errors: those that `edit` returns, and what does not compile.
  Result<Rig> Edited(const std::function<Result<Done>(GraphEdit&)>& edit) const;
  // Trains a subspace and writes it to a .kpsa file ("": the one that the rig names; an existing one is
  // replaced). Of a rig that is not accelerated, without nodes that functions of the program compute. Takes seconds to minutes; nothing is written unless it
  // succeeds.
  Result<TrainingReport> Train(const TrainingOptions& options, const std::string& subspace = {}) const;
  // Full against accelerated evaluation of the same frames. Of an accelerated rig; it, and its scenes, stay as they
  // are. Errors: no such clip, a frame that fails, whatever Accelerated may find by now.
  Result<BenchReport> Bench(const BenchOptions& options = {}) const;

 private:
  struct Impl;
  friend class Library;
  friend class Scene;
  explicit Rig(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

}  // namespace kpsa
