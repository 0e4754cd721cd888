#include "view/handle_side.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

void Put(const PlugRef& plug, double number, LivePose* pose) {
  const auto at = std::ranges::find(pose->moved, plug, &MovedPlug::plug);
  if (at != pose->moved.end())
    at->number = number;
  else
    pose->moved.push_back({plug, number, true});
}

}  // namespace

Result<std::unique_ptr<HandleSide>> HandleSide::Make(const Rig& rest) {
  std::unique_ptr<HandleSide> made(new HandleSide(rest));
  Result<std::vector<Handle>> handles = FindHandles(rest);
  if (!handles.ok()) return handles.status();
  made->handles_ = std::move(*handles);
  std::vector<PlugRef> matrices;
  for (const Handle& handle : made->handles_) matrices.push_back(handle.matrix);
  if (!matrices.empty()) made->side_ = std::make_unique<LiveSide>(rest, std::move(matrices));
  return made;
}

Result<std::vector<Double3>> HandleSide::Places(const LivePose& pose) {
  std::vector<Double3> places;
  if (handles_.empty()) return places;
  KPSA_RETURN_IF_ERROR(side_->Evaluate(pose));
  for (std::size_t h = 0; h < handles_.size(); ++h)
    places.push_back(TransformPoint(side_->MatrixOf(h), handles_[h].anchor));
  return places;
}

LiveSide& HandleSide::SideOf(std::size_t handle) {
  if (dragged_ == nullptr || dragged_handle_ != handle)
    dragged_ = std::make_unique<LiveSide>(rest_, std::vector<PlugRef>{handles_[handle].matrix});
  dragged_handle_ = handle;
  return *dragged_;
}

// Where the handle's controls are, in runtime units and within their ranges.
Result<std::vector<double>> HandleSide::NumbersOf(const Handle& handle, const LivePose& pose) {
  KPSA_RETURN_IF_ERROR(dragged_->Evaluate(pose));
  const auto values = dragged_->Values();  // of the clip
  if (!values.ok()) return values.status();
  std::vector<double> numbers;
  for (const std::size_t c : handle.controls) {
    const Control& control = rest_.controls[c];
    double number = control.value;
    for (const auto& [name, value] : *values) {
      if (name == control.name) number = value * rest_.units.FactorOf(control.unit);
    }
    const auto moved = std::ranges::find(pose.moved, control.plug, &MovedPlug::plug);
    if (moved != pose.moved.end()) number = moved->number;
    numbers.push_back(std::clamp(number, control.min, control.max));
  }
  return numbers;
}

Result<std::vector<std::pair<std::string, double>>> HandleSide::DragTo(const Drag& drag, LivePose* pose) {
  if (drag.handle >= handles_.size())
    return Status::Usage("drag: handle {}: expected a number below {}", drag.handle, handles_.size());
  const double length = Length(drag.line.along);
  if (!std::isfinite(Length(drag.line.from)) || !std::isfinite(length) || !(length > 0))
    return Status::Usage("drag: expected a place and a direction that is not 0");
  const Handle& handle = handles_[drag.handle];
  LiveSide& side = SideOf(drag.handle);
  const Result<std::vector<double>> start = NumbersOf(handle, *pose);
  if (!start.ok()) return start.status();
  // It would be run up to anew for every number that is tried
  if (const std::string& node = side.plan().stateful_node(); !node.empty())
    return Status::Usage("drag: where {} is depends on {}, which remembers the frames before", handle.name,
                         node);
  std::vector<Range> ranges;
  for (const std::size_t c : handle.controls)
    ranges.push_back({rest_.controls[c].min, rest_.controls[c].max});
  const auto put = [&](const std::vector<double>& numbers) {
    for (std::size_t k = 0; k < numbers.size(); ++k)
      Put(rest_.controls[handle.controls[k]].plug, numbers[k], pose);
  };
  const std::vector<double> numbers = BringToLine(
      [&](const std::vector<double>& tried) -> std::optional<Double3> {
        put(tried);
        if (!side.Evaluate(*pose).ok()) return std::nullopt;
        const Double3 place = TransformPoint(side.MatrixOf(0), handle.anchor);
        return std::isfinite(Length(place)) ? std::optional(place) : std::nullopt;
      },
      ranges, *start, drag.line);
  put(numbers);
  std::vector<std::pair<std::string, double>> set;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const Control& control = rest_.controls[handle.controls[k]];
    set.emplace_back(control.name, numbers[k] / rest_.units.FactorOf(control.unit));
  }
  return set;
}

}  // namespace kpsa::engine
