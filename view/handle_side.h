// Handles (view/handles.h) in any pose, and what a drag makes of their controls.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "view/drag_solver.h"
#include "view/handles.h"
#include "view/live_pose.h"
#include "view/live_side.h"

namespace kpsa::engine {

struct Drag {
  std::size_t handle = 0;
  Line line;  // on which the pointer holds it: from the eye, through the pointer; world space
};

// Used by one thread at a time.
class HandleSide {
 public:
  // `rest` outlives it. Errors: those of FindHandles.
  static Result<std::unique_ptr<HandleSide>> Make(const Rig& rest);
  const std::vector<Handle>& handles() const { return handles_; }

  // Where the handles are: metres, world space, in their order.
  Result<std::vector<Double3>> Places(const LivePose& pose);
  // The controls of one handle such that its point comes as near to the line as their ranges let it, beginning with the
  // pose, in which they are put; where several do, those that are turned or moved least. Names, and numbers in the file's
  // units. Errors: no such handle, a line of no direction, one whose place depends on the frames before, a pose that cannot be evaluated.
  Result<std::vector<std::pair<std::string, double>>> DragTo(const Drag& drag, LivePose* pose);

 private:
  explicit HandleSide(const Rig& rest) : rest_(rest) {}
  Result<std::vector<double>> NumbersOf(const Handle& handle, const LivePose& pose);
  LiveSide& SideOf(std::size_t handle);

  const Rig& rest_;
  std::vector<Handle> handles_;
  std::unique_ptr<LiveSide> side_;     // of all of them; none without handles
  std::unique_ptr<LiveSide> dragged_;  // of the one that was dragged last, alone
  std::size_t dragged_handle_ = 0;
};

}  // namespace kpsa::engine
