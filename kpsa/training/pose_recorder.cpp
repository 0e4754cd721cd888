#include "kpsa/training/pose_recorder.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "base/check.h"
#include "base/matrix.h"
#include "base/parallel.h"
#include "kpsa/space_frame.h"

namespace kpsa::engine {

namespace {

constexpr double kExactStep = 0.05;  // of the tolerance: what a last step may be off by, run by itself

double TimeOf(const SampledPose& pose, const TrainingClip& clip) {
  return clip.times.front() + pose.phase * (clip.times.back() - clip.times.front());
}

}  // namespace

RecordedPose RecordedOf(const SampledPose& pose, const std::vector<TrainingClip>& clips) {
  RecordedPose recorded;
  recorded.values = pose.values;
  if (pose.clip < 0) return recorded;
  const TrainingClip& clip = clips[static_cast<std::size_t>(pose.clip)];
  recorded.clip = clip.name;
  if (!clip.times.empty()) recorded.time = TimeOf(pose, clip);
  return recorded;
}

Result<std::shared_ptr<const Plan>> PoseRecorder::CompileFor(const std::vector<PlugRef>& varying) {
  // Outputs: points of the meshes, or what their last steps start from; what comes out of these; candidate points, signals, space
  Request request;
  const AccelerationTarget& target = rig_.target;
  for (std::size_t m = 0; m < target.meshes.size(); ++m) {
    const bool split = rig_.step(m) != nullptr;
    request.outputs.push_back({split ? rig_.split[m].in : target.meshes[m].stages.back().points,
                               only_.empty() ? PointSet() : only_[m]});
  }
  for (std::size_t m = 0; m < target.meshes.size(); ++m) {
    if (rig_.step(m) != nullptr) request.outputs.push_back({target.meshes[m].stages.back().points, {}});
  }
  for (const CandidateStage& candidate : candidates_) {
    const PlugRef& points = target.meshes[candidate.mesh].stages[candidate.stage].points;
    Request whole;
    whole.outputs.push_back({points, {}});
    Result<std::shared_ptr<const Plan>> sizes = compiler_->Compile(*rig_.graph, whole);
    if (!sizes.ok()) return sizes.status();
    request.outputs.push_back(
        {points, PointSet::Of(candidate.points, (*sizes)->outputs()[0].points.total())});
  }
  for (const Signal& signal : signals_) request.outputs.push_back({signal.plug, {}});
  for (const PlugRef& plug : target.space) request.outputs.push_back({plug, {}});
  request.varying = varying;
  return compiler_->Compile(*rig_.graph, request);
}

std::vector<Index> FirstScalars(std::span<const Signal> signals, const PoseLayout& layout) {
  std::vector<Index> first;
  Index next = 0;
  for (const Signal& signal : signals) {
    if (signal.relative && next < layout.relative_begin) next = layout.relative_begin;
    first.push_back(next);
    next += static_cast<Index>(signal.entries());
  }
  return first;
}

PoseRecorder::PlanResult PoseRecorder::PlanOf(const std::string* clip, bool sampled) {
  const std::pair key(clip == nullptr ? std::optional<std::string>() : *clip, sampled);
  if (const auto known = plans_.find(key); known != plans_.end()) return known->second;
  KPSA_RETURN_IF_ERROR(
      rig_.set_clip(clip == nullptr ? std::nullopt : std::optional<std::string_view>(*clip)));
  PlanResult plan = CompileFor(sampled ? rig_.Varying(clip != nullptr) : std::vector<PlugRef>{rig_.time});
  if (plan.ok()) plans_.emplace(key, *plan);
  return plan;
}

Result<PoseLayout> PoseRecorder::Layout(std::size_t products) {
  Result<std::shared_ptr<const Plan>> plan = CompileFor({rig_.time});
  if (!plan.ok()) return plan.status();
  layout_ = PoseLayout();
  std::size_t o = 0;
  for (; o < rig_.target.meshes.size(); ++o) {
    const LastStep* step = rig_.step(o);
    layout_.points += step == nullptr ? (*plan)->outputs()[o].points.size() : step->inner_points();
  }
  for (const CandidateStage& candidate : candidates_) layout_.stage_points += candidate.points.size();
  for (const Signal& signal : signals_) {
    layout_.scalars += signal.entries();
    if (!signal.relative) layout_.relative_begin = static_cast<Index>(layout_.scalars);  // these come last
  }
  layout_.products = products;
  layout_.relative_begin += static_cast<Index>(products);
  layout_.scalars += products;
  return layout_;
}

Matrix4 PoseRecorder::SpaceFromWorld(const Evaluator& evaluator) const {
  if (rig_.target.space.empty()) return {};
  const auto last = static_cast<Index>(evaluator.plan().outputs().size() - 1);
  return InverseOrIdentity(
      SpaceFrameOf(evaluator.Get<Matrix4>(last), inverse_rest_stretch_).world_from_space);
}

namespace {

PointBuffer InSpace(ConstPointsView points, bool world, const Matrix4& space_from_world) {
  PointBuffer moved(points.count);
  const PointsView to = moved.view();
  for (std::size_t i = 0; i < points.count; ++i) {
    Double3 p{points.x[i], points.y[i], points.z[i]};
    if (world) p = TransformPoint(space_from_world, p);
    to.x[i] = static_cast<float>(p.x), to.y[i] = static_cast<float>(p.y), to.z[i] = static_cast<float>(p.z);
  }
  return moved;
}

// Infinite where a point is no number, which is told elsewhere.
double LargestOff(ConstPointsView a, ConstPointsView b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.count; ++i)
    largest = std::max(largest, Length(Double3{a.x[i], a.y[i], a.z[i]} - Double3{b.x[i], b.y[i], b.z[i]}));
  return largest;
}

}  // namespace

double PoseRecorder::Store(const Evaluator& evaluator, std::span<float> row) const {
  const AccelerationTarget& target = rig_.target;
  const Matrix4 space_from_world = SpaceFromWorld(evaluator);
  Index o = 0;
  std::size_t column = 0;
  const auto store_points = [&](ConstPointsView points, bool in_space) {
    for (std::size_t i = 0; i < points.count; ++i) {
      Double3 p{points.x[i], points.y[i], points.z[i]};
      if (in_space) p = TransformPoint(space_from_world, p);
      row[column++] = static_cast<float>(p.x);
      row[column++] = static_cast<float>(p.y);
      row[column++] = static_cast<float>(p.z);
    }
  };
  const std::size_t meshes = target.meshes.size();
  Index of_step = static_cast<Index>(meshes);
  double off = 0;
  for (std::size_t m = 0; m < meshes; ++m) {
    const LastStep* step = rig_.step(m);
    const ConstPointsView points = evaluator.Points(o++);
    const bool in_space = target.meshes[m].stages.back().world;
    if (step == nullptr) {
      store_points(points, in_space);
      continue;
    }
    const PointBuffer in = InSpace(points, in_space, space_from_world),
                      out = InSpace(evaluator.Points(of_step++), in_space, space_from_world);
    PointBuffer inner(step->inner_points()), made(step->points());
    step->Inner(in.view(), inner.view());
    store_points(std::as_const(inner).view(), false);
    AlignedFloats scratch(steps_[m]->scratch_floats());
    steps_[m]->Run(std::as_const(inner).view(), made.view(), scratch.span());
    off = std::max(off, LargestOff(std::as_const(made).view(), out.view()));
  }
  o = of_step;
  for (const CandidateStage& candidate : candidates_)
    store_points(evaluator.Points(o++), target.meshes[candidate.mesh].stages[candidate.stage].world);
  StoreSignals(evaluator, space_from_world, o, row.subspan(column));
  StoreProducts(products_, layout_, row);
  KPSA_CHECK_EQ(column + layout_.scalars, row.size());
  return off;
}

void PoseRecorder::StoreSignals(const Evaluator& evaluator, const Matrix4& space_from_world, Index o,
                                std::span<float> entries) const {
  std::size_t column = 0;
  for (const Signal& signal : signals_) {
    if (signal.relative) column = std::max<std::size_t>(column, layout_.relative_begin);
    if (signal.matrix) {
      double values[12];
      const Matrix4& matrix = evaluator.Get<Matrix4>(o++);
      MatrixEntries(signal.relative ? space_from_world * matrix : matrix, values);
      for (double value : values) entries[column++] = static_cast<float>(value);
      continue;
    }
    const Type type = evaluator.plan().outputs()[o].type;
    const double value = type == Type::kDouble ? evaluator.Get<double>(o)
                                               : static_cast<double>(evaluator.Get<std::int64_t>(o));
    ++o;
    entries[column++] = static_cast<float>(value);
  }
}

Status PoseRecorder::CheckFinite(std::span<const float> row) const {
  const auto bad = std::find_if(row.begin(), row.end(), [](float v) { return !std::isfinite(v); });
  if (bad == row.end()) return Status();
  auto column = static_cast<std::size_t>(bad - row.begin());
  if (column < layout_.outputs()) {
    std::size_t point = column / 3;
    for (std::size_t m = 0; m < rig_.target.meshes.size(); ++m) {
      const AccelerationTarget::MeshPoints& mesh = rig_.target.meshes[m];
      if (const LastStep* step = rig_.step(m); step != nullptr) {
        if (point < step->inner_points())
          return Status::Evaluation("point {} of {} is not a number before its last step",
                                    step->PointOf(static_cast<Index>(point)), mesh.name);
        point -= step->inner_points();
        continue;
      }
      Request request;
      request.outputs.push_back({mesh.stages.back().points, {}});
      if (!only_.empty()) request.outputs[0].points = only_[m];
      const Result<std::shared_ptr<const Plan>> plan = compiler_->Compile(*rig_.graph, request);
      const std::size_t count = plan.ok() ? (*plan)->outputs()[0].points.size() : 0;
      if (point < count) {
        const PointSet& points = (*plan)->outputs()[0].points;
        return Status::Evaluation("point {} of {} is not a number", points[static_cast<Index>(point)],
                                  mesh.name);
      }
      point -= count;
    }
  }
  if (column >= layout_.scalar_begin()) {
    column -= layout_.scalar_begin();
    const std::vector<Index> first = FirstScalars(signals_, layout_);
    for (std::size_t s = 0; s < signals_.size(); ++s) {
      if (column >= first[s] && column < first[s] + signals_[s].entries())
        return Status::Evaluation("{} is not a number", signals_[s].name);
    }
  }
  return Status::Evaluation("a point of an earlier stage is not a number");
}

namespace {

void SetControl(const PlugRef& plug, Index varying, double value, Evaluator* evaluator) {
  const Type type = evaluator->plan().varying()[varying].type;
  if (type == Type::kInt || type == Type::kBool || type == Type::kEnum) {
    evaluator->SetInt(varying, static_cast<std::int64_t>(value));
  } else {
    evaluator->Set(varying, value, plug.component);
  }
}

}  // namespace

Status PoseRecorder::Record(std::span<const RecordedPose* const> poses,
                            const std::function<std::span<float>(std::size_t)>& row,
                            const std::function<std::string(std::size_t)>& name) {
  const std::size_t count = poses.size();
  if (count == 0) return Status();
  const std::string* const clip = poses[0]->clip ? &*poses[0]->clip : nullptr;
  const bool sampled = !poses[0]->values.empty();
  const PlanResult found = PlanOf(clip, sampled);
  if (!found.ok()) return found.status();
  const std::shared_ptr<const Plan>& plan = *found;
  const Index time = plan->FindVarying(rig_.time);
  const std::vector<std::size_t> used =
      sampled ? rig_.FreeControls(clip != nullptr) : std::vector<std::size_t>();
  std::vector<Index> numbers;
  for (const std::size_t c : used) numbers.push_back(plan->FindVarying(rig_.controls[c].plug));
  const auto set = [&](const RecordedPose& pose, Evaluator& e) {
    if (clip != nullptr) e.Set(time, pose.time);
    for (std::size_t k = 0; k < used.size(); ++k) {
      SetControl(rig_.controls[used[k]].plug, numbers[k], pose.values[used[k]], &e);
    }
  };
  std::vector<std::span<float>> rows;
  for (std::size_t i = 0; i < count; ++i) rows.push_back(row(i));
  std::mutex mutex;
  std::size_t failed = count;
  Status failure;
  const std::size_t grain =
      std::max<std::size_t>(16, count / static_cast<std::size_t>(4 * HardwareThreads()) + 1);
  ParallelFor(count, grain, [&](std::size_t begin, std::size_t end) {
    Evaluator evaluator(plan);
    for (std::size_t i = begin; i < end; ++i) {
      set(*poses[i], evaluator);
      Status status = evaluator.Evaluate();
      if (status.ok()) {
        const double off = Store(evaluator, rows[i]);
        if (!(off > kExactStep * tolerance_)) continue;
        status = Status::Invalid(
            "what comes out of the last step differs by {:.3g} m from what the step gives", off);
      }
      std::lock_guard<std::mutex> lock(mutex);
      if (i < failed) failed = i, failure = std::move(status);
    }
  });
  if (failed < count) return Status::Evaluation("{}: {}", name(failed), failure.ToString());
  for (std::size_t i = 0; i < count; ++i) {
    if (Status finite = CheckFinite(rows[i]); !finite.ok())
      return Status::Evaluation("{}: {}", name(i), finite.errors().front().message);
  }
  return Status();
}

Status PoseRecorder::Add(std::span<const RecordedPose* const> poses, PoseMatrix* to,
                         const std::function<std::string(std::size_t)>& name) {
  const std::size_t first = to->poses();
  for (const RecordedPose* pose : poses) {
    to->AddPose();
    if (!keeps_origins_) continue;
    to->set_origin(to->poses() - 1, static_cast<std::uint32_t>(recorded_.size()));
    recorded_.push_back(*pose);
  }
  return Record(
      poses, [&](std::size_t i) { return to->row(first + i); }, name);
}

Status PoseRecorder::Replay(std::span<const RecordedPose* const> poses,
                            const std::function<std::span<float>(std::size_t)>& row) {
  std::map<std::pair<std::optional<std::string>, bool>, std::vector<std::size_t>> alike;
  for (std::size_t i = 0; i < poses.size(); ++i)
    alike[{poses[i]->clip, !poses[i]->values.empty()}].push_back(i);
  for (const auto& of : alike) {
    const std::vector<std::size_t>& numbers = of.second;
    std::vector<const RecordedPose*> some;
    for (const std::size_t i : numbers) some.push_back(poses[i]);
    KPSA_RETURN_IF_ERROR(Record(
        some, [&](std::size_t i) { return row(numbers[i]); },
        [&](std::size_t i) {
          return some[i]->values.empty() && some[i]->clip
                     ? fmt::format("clip \"{}\" at {} s", *some[i]->clip, some[i]->time)
                     : std::string("a sampled pose");
        }));
  }
  return Status();
}

Status PoseRecorder::AddClip(const TrainingClip& clip, PoseMatrix* poses) {
  std::vector<RecordedPose> frames;
  for (const double t : clip.times) frames.push_back({clip.name, t, {}});
  std::vector<const RecordedPose*> pointers;
  for (const RecordedPose& frame : frames) pointers.push_back(&frame);
  return Add(pointers, poses,
             [&](std::size_t i) { return fmt::format("clip \"{}\" at {} s", clip.name, clip.times[i]); });
}

Result<std::shared_ptr<const Plan>> PoseRecorder::PlanOfSignals(std::vector<PlugRef> varying) {
  Request request;
  for (const Signal& signal : signals_) request.outputs.push_back({signal.plug, {}});
  for (const PlugRef& plug : rig_.target.space) request.outputs.push_back({plug, {}});
  request.varying = std::move(varying);
  return compiler_->Compile(*rig_.graph, request);
}

Status PoseRecorder::VisitSignals(const std::vector<SampledPose>& poses,
                                  const std::function<void(std::span<const float>)>& visit) {
  KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
  const auto plan = PlanOfSignals(rig_.Varying(false));
  if (!plan.ok()) return plan.status();
  const std::vector<std::size_t> used = rig_.FreeControls(false);
  std::vector<Index> numbers;
  for (const std::size_t c : used) numbers.push_back((*plan)->FindVarying(rig_.controls[c].plug));
  Evaluator evaluator(*plan);
  std::vector<float> entries(layout_.scalars);
  for (const SampledPose& pose : poses) {
    for (std::size_t k = 0; k < used.size(); ++k)
      SetControl(rig_.controls[used[k]].plug, numbers[k], pose.values[used[k]], &evaluator);
    KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
    StoreSignals(evaluator, SpaceFromWorld(evaluator), 0, entries);
    visit(entries);
  }
  return Status();
}

Status PoseRecorder::VisitSignals(const TrainingClip& clip,
                                  const std::function<void(std::span<const float>)>& visit) {
  KPSA_RETURN_IF_ERROR(rig_.set_clip(clip.name));
  const auto plan = PlanOfSignals({rig_.time});
  if (!plan.ok()) return plan.status();
  const Index time = (*plan)->FindVarying(rig_.time);
  Evaluator evaluator(*plan);
  std::vector<float> entries(layout_.scalars);
  for (const double t : clip.times) {
    evaluator.Set(time, t);
    KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
    StoreSignals(evaluator, SpaceFromWorld(evaluator), 0, entries);
    visit(entries);
  }
  return rig_.set_clip(std::nullopt);
}

// "sampled pose (jaw.rotateX -0.38, smile 0.9 of clip talk at 1.2 s)": the controls farthest from rest.
std::string PoseRecorder::NameOf(const SampledPose& pose, const std::vector<TrainingClip>& clips) const {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t c = 0; c < pose.values.size(); ++c) {
    const ControlRange& control = rig_.controls[c];
    const double extent = std::max(control.max - control.min, 1e-300);
    if (pose.values[c] != control.rest)
      order.emplace_back(-std::fabs(pose.values[c] - control.rest) / extent, c);
  }
  std::sort(order.begin(), order.end());
  std::string text = "sampled pose";
  for (std::size_t i = 0; i < std::min<std::size_t>(3, order.size()); ++i) {
    text +=
        fmt::format("{}{} {:.4g}", i == 0 ? " (" : ", ",
                    rig_.graph->PlugName(rig_.controls[order[i].second].plug), pose.values[order[i].second]);
  }
  if (!order.empty()) text += order.size() > 3 ? ", ...)" : ")";
  if (pose.clip >= 0) {
    const TrainingClip& clip = clips[static_cast<std::size_t>(pose.clip)];
    text += fmt::format(" over clip \"{}\" at {:.4g} s", clip.name, TimeOf(pose, clip));
  }
  return text;
}

namespace {

// The middle of what the controls of a node turn, that of c among them.
Double3 MiddleAngles(const std::vector<ControlRange>& controls, std::size_t c) {
  Double3 middle;
  for (const ControlRange& control : controls) {
    if (control.plug.node == controls[c].plug.node && control.turns)
      middle[std::max(0, control.plug.component)] = (control.min + control.max) / 2;
  }
  return middle;
}

}  // namespace

Result<ClipPoses> PoseRecorder::ControlsOfClips(const std::vector<TrainingClip>& clips) {
  ClipPoses poses;
  for (const TrainingClip& clip : clips) {
    KPSA_RETURN_IF_ERROR(rig_.set_clip(clip.name));
    Request request;
    request.varying = {rig_.time};
    std::vector<std::size_t> shown;
    for (std::size_t c = 0; c < rig_.controls.size(); ++c) {
      if (!rig_.controls[c].shown) continue;
      PlugRef plug = *rig_.controls[c].shown;
      if (!rig_.graph->def(plug.node).attributes[static_cast<std::size_t>(plug.attribute)].output) {
        const Connection* connection = rig_.graph->FindConnection(plug);
        if (connection == nullptr) continue;
        plug = connection->source;
      }
      plug.component = -1;
      request.outputs.push_back({plug, {}});
      shown.push_back(c);
    }
    Result<std::shared_ptr<const Plan>> plan = compiler_->Compile(*rig_.graph, request);
    if (!plan.ok()) return plan.status();
    const Index time = (*plan)->FindVarying(rig_.time);
    Evaluator evaluator(*plan);
    for (const double t : clip.times) {
      if (time != kNoIndex) evaluator.Set(time, t);
      KPSA_RETURN_IF_ERROR(evaluator.Evaluate());
      std::vector<double>& pose = poses.emplace_back();
      for (const ControlRange& control : rig_.controls) pose.push_back(control.rest);
      for (std::size_t i = 0; i < shown.size(); ++i) {
        const auto output = static_cast<Index>(i);
        const int component = rig_.controls[shown[i]].shown->component;
        if ((*plan)->outputs()[i].type == Type::kDouble3) {
          const Double3 all = evaluator.Get<Double3>(output);
          const std::optional<RotateOrder>& turns = rig_.controls[shown[i]].turns;
          const Double3 near = turns ? EulerNear(all, *turns, MiddleAngles(rig_.controls, shown[i])) : all;
          pose[shown[i]] = near[std::max(0, component)];
        } else if ((*plan)->outputs()[i].type == Type::kDouble) {
          pose[shown[i]] = evaluator.Get<double>(output);
        }
      }
    }
  }
  KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
  return poses;
}

Status PoseRecorder::AddSamples(const std::vector<SampledPose>& samples,
                                const std::vector<TrainingClip>& clips, PoseMatrix* poses) {
  for (int clip = -1; clip < static_cast<int>(clips.size()); ++clip) {
    std::vector<const SampledPose*> mine;
    for (const SampledPose& sample : samples) {
      if (sample.clip == clip) mine.push_back(&sample);
    }
    if (mine.empty()) continue;
    std::vector<RecordedPose> sampled;
    for (const SampledPose* pose : mine) sampled.push_back(RecordedOf(*pose, clips));
    std::vector<const RecordedPose*> pointers;
    for (const RecordedPose& pose : sampled) pointers.push_back(&pose);
    KPSA_RETURN_IF_ERROR(Add(pointers, poses, [&](std::size_t i) { return NameOf(*mine[i], clips); }));
  }
  return Status();
}

}  // namespace kpsa::engine
