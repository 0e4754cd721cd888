#include "rig/build/point_motion.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostPoints = 1000;  // whose poses are kept
constexpr std::size_t kMovingShare = 10;   // one of so many points moves
constexpr std::size_t kMixtures = 100;
constexpr std::size_t kAnchors = 4;  // not in a plane: they fix a body
constexpr double kRigid = 1e-4;      // of the rest diagonal: distances that change less are the same

double DistanceSquared(const float* a, const double* b) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

// Of the poses [begin, end): x y z of every point.
std::vector<double> Mean(const PointPoses& poses, std::size_t begin, std::size_t end) {
  const std::size_t width = 3 * poses.points;
  std::vector<double> mean(width, 0.0);
  for (std::size_t p = begin; p < end; ++p) {
    for (std::size_t i = 0; i < width; ++i)
      mean[i] += poses.rows[p * width + i] / static_cast<double>(end - begin);
  }
  return mean;
}

}  // namespace

double PointPoses::Motion(std::size_t begin, std::size_t end) const {
  if (end <= begin || points == 0) return 0;
  const std::vector<double> mean = Mean(*this, begin, end);
  std::vector<double> squares(points, 0.0);  // of each point, over the poses
  for (std::size_t i = 3 * points * begin; i < 3 * points * end; i += 3)
    squares[i / 3 % points] += DistanceSquared(&rows[i], &mean[i % (3 * points)]);
  const std::size_t count = std::max<std::size_t>(1, points / kMovingShare);
  std::nth_element(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(count - 1), squares.end(),
                   std::greater<>());
  const double sum =
      std::accumulate(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
  return std::sqrt(sum / static_cast<double>(count * (end - begin)));
}

double PointPoses::Largest() const {
  const std::vector<double> mean = Mean(*this, 0, poses());
  double largest = 0;
  for (std::size_t i = 0; i < rows.size(); i += 3)
    largest = std::max(largest, DistanceSquared(&rows[i], &mean[i % (3 * points)]));
  return std::sqrt(largest);
}

std::vector<double> PointPoses::DistancesFromMean() const {
  const std::vector<double> mean = Mean(*this, 0, poses());
  std::vector<double> distances;
  for (std::size_t p = 0; p < poses(); ++p) {
    double sum = 0;
    for (std::size_t i = 0; i < 3 * points; i += 3)
      sum += DistanceSquared(&rows[3 * points * p + i], &mean[i]);
    distances.push_back(std::sqrt(sum / static_cast<double>(points)));
  }
  return distances;
}

Result<std::shared_ptr<const Plan>> MotionMeter::Compile(std::vector<PlugRef> varying) {
  Request request;
  for (const std::size_t m : ShownMeshes(rig_->scene))
    request.outputs.push_back({rig_->scene.meshes[m].points, {}});
  if (space_.has_value())
    request.outputs.push_back(
        {{*space_, rig_->graph->def(*space_).FindAttribute("worldMatrix"), -1, -1}, {}});
  request.varying = std::move(varying);
  return compiler_.Compile(*rig_->graph, request);
}

std::vector<Double3> MotionMeter::Read(const Evaluator& evaluator) const {
  std::vector<Double3> points;
  const std::size_t meshes = evaluator.plan().outputs().size() - (space_.has_value() ? 1 : 0);
  for (std::size_t m = 0; m < meshes; ++m) {
    const ConstPointsView view = evaluator.Points(static_cast<Index>(m));
    for (std::size_t i = 0; i < view.count; ++i) points.push_back({view.x[i], view.y[i], view.z[i]});
  }
  return points;
}

Status MotionMeter::Prepare() {
  if (prepared_) return Status();
  const auto plan = Compile({});
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
  rest_ = Read(evaluator);
  if (space_.has_value())
    space_at_rest_ = evaluator.Get<Matrix4>(static_cast<Index>((*plan)->outputs().size() - 1));
  std::vector<double> distance(rest_.size(), 1e300);
  while (anchors_.size() < std::min(kAnchors, rest_.size())) {
    const auto farthest = std::max_element(distance.begin(), distance.end()) - distance.begin();
    anchors_.push_back(static_cast<Index>(farthest));
    for (std::size_t i = 0; i < rest_.size(); ++i)
      distance[i] = std::min(distance[i], Length(rest_[i] - rest_[anchors_.back()]));
  }
  prepared_ = true;
  return Status();
}

Status MotionMeter::Add(const Evaluator& evaluator, bool keep, PointPoses* poses) {
  const std::vector<Double3> points = Read(evaluator);
  for (const Double3& p : points) {
    if (!std::isfinite(p.x + p.y + p.z)) return Status::Evaluation("a point is not a number");
  }
  if (first_.empty()) first_ = points;
  for (std::size_t i = 0; i < points.size(); ++i)
    poses->travel = std::max(poses->travel, Length(points[i] - first_[i]));
  for (std::size_t i = 0; i < points.size() && !poses->deforms; ++i) {
    for (const Index a : anchors_) {
      const double now = Length(points[i] - points[a]), rest = Length(rest_[i] - rest_[a]);
      poses->deforms = poses->deforms || std::fabs(now - rest) > kRigid * rig_->rest_diagonal;
    }
  }
  if (!keep) return Status();
  Matrix4 rest_from_world;
  if (space_.has_value()) {
    const auto last = static_cast<Index>(evaluator.plan().outputs().size() - 1);
    rest_from_world = space_at_rest_ * InverseOrIdentity(evaluator.Get<Matrix4>(last));
  }
  poses->points = std::min(kMostPoints, points.size());
  for (std::size_t k = 0; k < poses->points; ++k) {
    const std::size_t i = k * points.size() / poses->points;
    const Double3 p = TransformPoint(rest_from_world, points[i]);
    for (int axis = 0; axis < 3; ++axis) poses->rows.push_back(static_cast<float>(p[axis]));
  }
  return Status();
}

Result<PointPoses> MotionMeter::OfClip(const std::string& clip, double fps, std::size_t most) {
  KPSA_RETURN_IF_ERROR(Prepare());
  const Index index = rig_->character->FindClip(clip);
  const double duration = rig_->character->clips[index].duration;
  const double frames = std::min(std::floor(duration * fps + 1e-6) + 1, 1e6);
  const auto count = std::min(static_cast<std::size_t>(frames), most);
  PointPoses poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = count == 1 ? 0 : static_cast<double>(i) / static_cast<double>(count - 1);
    poses.times.push_back(std::round(share * (frames - 1)) / fps);
  }
  first_.clear();
  KPSA_RETURN_IF_ERROR(SetClip(rig_, clip));
  Status status;
  if (const auto plan = Compile({rig_->scene.time}); plan.ok()) {
    Evaluator evaluator(*plan);
    const Index time = (*plan)->FindVarying(rig_->scene.time);
    for (std::size_t i = 0; i < count && status.ok(); ++i) {
      if (time != kNoIndex) evaluator.Set(time, poses.times[i]);
      status = evaluator.Evaluate();
      if (status.ok()) status = Add(evaluator, true, &poses);
    }
  } else {
    status = plan.status();
  }
  KPSA_RETURN_IF_ERROR(SetClip(rig_, std::nullopt));
  if (!status.ok()) return status;
  return poses;
}

Result<PointPoses> MotionMeter::OfControls(const std::vector<ControlPlug>& controls) {
  KPSA_RETURN_IF_ERROR(Prepare());
  std::vector<PlugRef> varying;
  for (const ControlPlug& control : controls) varying.push_back(control.plug);
  const auto plan = Compile(varying);
  if (!plan.ok()) return plan.status();
  Evaluator evaluator(*plan);
  const auto set = [&](std::size_t c, double value) {
    const PlugRef& plug = controls[c].plug;
    if (const Index number = (*plan)->FindVarying(plug); number != kNoIndex)
      evaluator.Set(number, value, plug.component);
  };
  std::vector<double> rest;
  for (const ControlPlug& control : controls) {
    const Value* value = rig_->graph->FindValue(control.plug);  // a default weight; transforms rest at 0
    const double* weight = value == nullptr ? nullptr : value->get_if<double>();
    rest.push_back(weight == nullptr ? 0 : *weight);
  }
  first_ = rest_;
  PointPoses poses;
  std::mt19937 random(1);
  for (std::size_t p = 0; p < kMixtures && !controls.empty(); ++p) {
    std::vector<std::size_t> moved;
    for (std::size_t k = 3 + random() % 4; k > 0; --k) {
      moved.push_back(random() % controls.size());
      const MotionRange& range = controls[moved.back()].range;
      set(moved.back(), range.min + (range.max - range.min) * static_cast<double>(random()) * 0x1p-32);
    }
    KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
    KPSA_RETURN_IF_ERROR(Add(evaluator, true, &poses));
    for (const std::size_t c : moved) set(c, rest[c]);
  }
  for (std::size_t c = 0; c < controls.size() && !poses.deforms; ++c) {
    for (const double end : {controls[c].range.min, controls[c].range.max}) {
      set(c, end);
      KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
      KPSA_RETURN_IF_ERROR(Add(evaluator, false, &poses));
    }
    set(c, rest[c]);
  }
  return poses;
}

}  // namespace kpsa::engine
