#include "view/handles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/matrix.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "host/rig_frames.h"
#include "host/rig_training.h"
#include "host/settable_plug.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostWork = 400'000;                      // points evaluated to place handles
constexpr std::size_t kFewestPoints = 64, kMostPoints = 800;  // that are looked at

// What is there to drag, without anchors.
std::vector<Handle> HandlesWithoutPlaces(const Rig& rest) {
  std::vector<Handle> handles;
  for (std::size_t c = 0; c < rest.controls.size(); ++c) {
    const PlugRef& plug = rest.controls[c].plug;
    const NodeDef& def = rest.graph->def(plug.node);
    const std::string& attribute = def.attributes[static_cast<std::size_t>(plug.attribute)].name;
    const int matrix = def.FindAttribute("worldMatrix");
    if (matrix < 0 || plug.component < 0 || (attribute != "translate" && attribute != "rotate")) continue;
    if (DriverOf(*rest.graph, plug) != nullptr) continue;
    const bool turns = attribute == "rotate";
    auto handle = std::ranges::find_if(
        handles, [&](const Handle& one) { return one.matrix.node == plug.node && one.turns == turns; });
    if (handle == handles.end()) {
      if (handles.size() == kMostHandles) continue;
      handle =
          handles.insert(handle, {rest.graph->name(plug.node), turns, {plug.node, matrix, -1, -1}, {}, {}});
    }
    handle->controls.push_back(c);
  }
  return handles;
}

// Some points of what is shown, spread over every mesh, at any value of any control.
class SomePoints {
 public:
  Status Start(const Rig& rest, const std::vector<Handle>& handles, std::size_t wanted) {
    Request request = ShownPoints(rest);
    std::size_t all = 0;
    for (const std::size_t m : ShownMeshes(rest.scene)) all += rest.scene.meshes[m].mesh().point_count();
    std::size_t output = 0;
    for (const std::size_t m : ShownMeshes(rest.scene)) {
      const Index count = rest.scene.meshes[m].mesh().point_count();
      const std::size_t share = std::max(kFewestPoints, wanted * count / std::max<std::size_t>(1, all));
      const auto step = static_cast<Index>(std::max<std::size_t>(1, count / share));
      std::vector<Index> some;
      for (Index i = 0; i < count; i += step) some.push_back(i);
      request.outputs[output++].points = PointSet::Of(std::move(some), count);
    }
    meshes_ = request.outputs.size();
    for (const Handle& handle : handles) request.outputs.push_back({handle.matrix, {}});
    request.varying = VaryingPlugs(rest);
    const auto plan = CompileFor(rest, &compiler_, request);
    if (!plan.ok()) return plan.status();
    evaluator_.emplace(*plan);
    return evaluator_->Evaluate();
  }
  std::vector<Double3> Read() const {
    std::vector<Double3> points;
    for (std::size_t output = 0; output < meshes_; ++output) {
      const ConstPointsView view = evaluator_->Points(static_cast<Index>(output));
      for (Index i = 0; i < view.count; ++i) points.push_back({view.x[i], view.y[i], view.z[i]});
    }
    return points;
  }
  const Matrix4& MatrixOf(std::size_t handle) const {
    return evaluator_->Get<Matrix4>(static_cast<Index>(meshes_ + handle));
  }
  // How far each point goes from `still` when the control alone goes to the farther end of its range; zeros where it
  // moves nothing or cannot be evaluated.
  Result<std::vector<double>> Moved(const Control& control, const std::vector<Double3>& still) {
    std::vector<double> moved(still.size(), 0);
    const PlugHandle handle = evaluator_->plan().Handle(control.plug);
    if (!handle) return moved;
    const bool to_max = control.max - control.value >= control.value - control.min;
    KPSA_RETURN_IF_ERROR(evaluator_->Set(handle, to_max ? control.max : control.min));
    if (evaluator_->Evaluate().ok()) {
      const std::vector<Double3> there = Read();
      for (std::size_t i = 0; i < still.size(); ++i) {
        const double distance = Length(there[i] - still[i]);
        if (std::isfinite(distance)) moved[i] = distance;
      }
    }
    KPSA_RETURN_IF_ERROR(evaluator_->Set(handle, control.value));
    return moved;
  }

 private:
  Compiler compiler_;
  std::optional<Evaluator> evaluator_;
  std::size_t meshes_ = 0;
};

// What the controls of a handle that turns do to the points.
struct Reach {
  std::vector<double> together;  // how far all of them move each point, metres
  std::vector<double> least;  // of what each of them moves at most, the share of the one that moves it least
  double sum = 0;             // of `together`
  Double3 middle;             // of what they move
};

Reach ReachOf(const std::vector<Double3>& points, const std::vector<std::vector<double>>& by_control) {
  Reach reach{std::vector<double>(points.size(), 0), std::vector<double>(points.size(), 1), 0, {}};
  for (const std::vector<double>& moved : by_control) {
    const double most = moved.empty() ? 0 : *std::ranges::max_element(moved);
    if (most <= 0) continue;
    for (std::size_t i = 0; i < points.size(); ++i) {
      reach.together[i] += moved[i];
      reach.least[i] = std::min(reach.least[i], moved[i] / most);
      reach.middle = reach.middle + moved[i] * points[i];
      reach.sum += moved[i];
    }
  }
  if (reach.sum > 0) reach.middle = reach.middle * (1 / reach.sum);
  return reach;
}

// Chooses points to hold, apart from each other.
class Chooser {
 public:
  explicit Chooser(const std::vector<Double3>& points) : points_(points) {
    Double3 low = points.empty() ? Double3() : points.front(), high = low;
    for (const Double3& p : points) {
      middle_ = middle_ + p * (1 / static_cast<double>(points.size()));
      for (int axis = 0; axis < 3; ++axis)
        low[axis] = std::min(low[axis], p[axis]), high[axis] = std::max(high[axis], p[axis]);
    }
    apart_ = Length(high - low) / 30;
  }
  void Take(Double3 place) { taken_.push_back(place); }

  // Each control moves it at least half as far as it moves what all of them move most. Of these the nearest to the middle
  // of what they move, and a little to the outside and to the node itself. None where nothing moves.
  std::optional<Double3> Choose(const Reach& reach, Double3 node) {
    constexpr double kEnough = 0.5, kOutwards = 0.3, kToNode = 0.25, kCrowd = 8;
    if (!(reach.sum > 0)) return std::nullopt;
    const double enough = kEnough * *std::ranges::max_element(reach.least);
    std::optional<Double3> best;
    double best_score = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (reach.least[i] < enough || reach.together[i] <= 0) continue;
      const Double3 p = points_[i];
      double score = Length(p - reach.middle) - kOutwards * Length(p - middle_) + kToNode * Length(p - node);
      for (const Double3& other : taken_) score += kCrowd * std::max(0.0, apart_ - Length(p - other));
      if (score < best_score) best_score = score, best = p;
    }
    if (best.has_value()) Take(*best);
    return best;
  }

 private:
  const std::vector<Double3>& points_;
  Double3 middle_;
  double apart_ = 0;
  std::vector<Double3> taken_;
};

}  // namespace

Result<std::vector<Handle>> FindHandles(const Rig& rest) {
  std::vector<Handle> handles = HandlesWithoutPlaces(rest);
  std::size_t turning = 0;
  for (const Handle& handle : handles) turning += handle.turns ? handle.controls.size() : 0;
  if (turning == 0) return handles;
  SomePoints some;
  KPSA_RETURN_IF_ERROR(
      some.Start(rest, handles, std::clamp(kMostWork / turning, kFewestPoints, kMostPoints)));
  const std::vector<Double3> still = some.Read();
  std::vector<Matrix4> matrices;
  for (std::size_t h = 0; h < handles.size(); ++h) matrices.push_back(some.MatrixOf(h));
  std::vector<Reach> reaches(handles.size());
  std::vector<std::size_t> order;  // of those that turn
  Chooser chooser(still);
  for (std::size_t h = 0; h < handles.size(); ++h) {
    if (!handles[h].turns) {
      chooser.Take(TransformPoint(matrices[h], {}));
      continue;
    }
    std::vector<std::vector<double>> by_control;
    for (const std::size_t c : handles[h].controls) {
      Result<std::vector<double>> moved = some.Moved(rest.controls[c], still);
      if (!moved.ok()) return moved.status();
      by_control.push_back(std::move(*moved));
    }
    reaches[h] = ReachOf(still, by_control);
    order.push_back(h);
  }
  // What moves little has the fewest places
  std::ranges::stable_sort(order, {}, [&](std::size_t h) { return reaches[h].sum; });
  std::vector<char> placed(handles.size(), 0);
  for (const std::size_t h : order) {
    const std::optional<Double3> held = chooser.Choose(reaches[h], TransformPoint(matrices[h], {}));
    Matrix4 inverse;
    if (!held.has_value() || !Invert(matrices[h], &inverse)) continue;
    handles[h].anchor = TransformPoint(inverse, *held);
    placed[h] = 1;
  }
  std::vector<Handle> shown;
  for (std::size_t h = 0; h < handles.size(); ++h) {
    if (!handles[h].turns || placed[h]) shown.push_back(std::move(handles[h]));
  }
  return shown;
}

}  // namespace kpsa::engine
