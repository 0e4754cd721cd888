// One state of a rig (a clip, a time, controls), which evaluates what it is asked for and nothing else.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kpsa/result.h"
#include "kpsa/rig.h"

namespace kpsa {

// What SoftCache said of the latest frame of an accelerated rig; of several subspaces, of the one with most
// of the full evaluation.
struct Verdict {
  bool hit = false;       // no deformer of the accelerated stacks ran for all points
  double full_share = 1;  // of the full evaluation in the points: 0 a hit, 1 a miss, a blend in between
  double score = 0;       // the smaller, the more like the training; infinite where nothing was measured
  std::string reason;     // "hit", or why not, in words
};

// A frame as Scene::Frames hands it over; valid until the call ends.
struct Frame {
  std::size_t index = 0;  // in the list of times
  double seconds = 0;
  std::span<const std::span<const float>>
      points;                        // of each mesh of Rig::meshes(), as Scene::Points gives them
  const Verdict* verdict = nullptr;  // null where nothing is accelerated
};

// What one step of the plan cost over the frames of a Scene::Profile, dearest first.
struct StepTime {
  std::string node, type;  // of the node that it evaluates
  std::string label;       // "" for the node itself; "gather", "assemble": what brings its inputs together
  std::size_t evaluations = 0;  // how often it ran
  std::size_t points = 0;       // that it computes each time
  double milliseconds = 0;      // all of them together
};

struct FrameOptions {
  int threads = 0;  // 0: all
  const std::atomic<bool>* cancel =
      nullptr;  // set it from any thread to end early: a problem of kind kInterrupted
};

// Used by one thread at a time; any number of scenes may share a rig. What it compiles is shared with other
// scenes of the rig that ask for the same. A warm Points() allocates nothing and takes no lock.
//
// Nodes that remember (jiggle) come to a time through all frames of the rig before it, with the controls as they are set:
// from frame 0 on, or from the latest pull where that was at such a frame and lies before. So times may go back and
// forth, and without a change of controls on the way a time has the same points whatever was asked for before. Times
// between frames cost the way from frame 0 each. WatchRunUp() ends a way that is too long.
//
// Errors have the node that they are about and its place in the rig's file, or else the file.
class Scene {
 public:
  explicit Scene(const Rig& rig);  // at rest
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  const Rig& rig() const;

  // Lets a clip drive the character, or none: the rest pose. Controls stay where they are set, but for those
  // that the clip drives.
  Result<Done> Play(const std::optional<std::string>& clip);
  void SetTime(double seconds);  // clamped to the keys of clips, as glTF says
  // A control, or any other plug that is a number and may vary, in the units of the rig's file. Errors, which
  // change nothing: no such plug (the nearest is named), a value outside of what the attribute admits, a plug that the
  // clip or the rig drives. What does not compile or evaluate with it is told by whatever is pulled next, until it is
  // set right.
  Result<Done> Set(std::string_view plug, double value);
  void Reset();  // all controls at rest; clip and time stay
  // Asked before every frame on the way to a time (see above), by whatever is pulled, profiled or played, on the
  // thread that evaluates: false ends it, a problem of kind kInterrupted. Empty: nobody asks.
  void WatchRunUp(std::function<bool()> go_on);

  // Positions of a mesh's vertices, x y z each, metres: "head_mesh" in world space, or up to a stage of its
  // stack
  // ("head_mesh@skin": in the mesh's space before its skin). Valid until the next call on this scene.
  Result<std::span<const float>> Points(std::string_view mesh);
  // Any other plug, in the file's units: one number, three, four, or the sixteen of a matrix column by column, whose
  // places are metres.
  Result<std::vector<double>> Values(std::string_view plug);
  // Of the latest Points() or Values(), whatever was set since; it evaluates nothing. Where nothing had changed since a
  // pull that asked the subspaces, their answer stands. hit is false and the reason empty where it failed, or where
  // they have not been asked since something changed.
  const Verdict& verdict();

  // What evaluating the points of Rig::meshes() at these times costs, on this thread: the meshes alone, whatever
  // else the scene was asked for. The scene's own time stays.
  Result<std::vector<StepTime>> Profile(std::span<const double> seconds);

  // Frames of the clip that plays, with the controls as they are when it is called, on many threads; handed over in
  // order, one call at a time, on any of the threads. `take` returns false to end it; it may use the scene, which
  // changes nothing of these frames. The points of Rig::meshes() are evaluated, whatever else the scene was asked for.
  // The scene's own time stays. Bytes do not depend on the threads. Where nodes remember, or functions of the program
  // compute (kpsa/node_type.h), it runs on one thread; several are refused with the latter.
  Result<Done> Frames(std::span<const double> seconds, const std::function<bool(const Frame&)>& take,
                      const FrameOptions& options = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kpsa
