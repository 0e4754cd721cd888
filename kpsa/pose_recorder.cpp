#include "kpsa/pose_recorder.h"

#include <mutex>

#include "base/check.h"
#include "base/matrix.h"
#include "base/parallel.h"

namespace kpsa {

Result<std::shared_ptr<const Plan>> PoseRecorder::CompileFor(const std::vector<PlugRef>& varying) {
  // Outputs: points of the meshes, candidate points, signals, space
  Request request;
  const AccelerationTarget& target = rig_.target;
  for (const auto& mesh : target.meshes) request.outputs.push_back({mesh.stages.back().points, {}});
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

Result<PoseLayout> PoseRecorder::Layout() {
  Result<std::shared_ptr<const Plan>> plan = CompileFor({rig_.time});
  if (!plan.ok()) return plan.status();
  layout_ = PoseLayout();
  std::size_t o = 0;
  for (; o < rig_.target.meshes.size(); ++o) layout_.points += (*plan)->outputs()[o].points.size();
  for (const CandidateStage& candidate : candidates_) layout_.stage_points += candidate.points.size();
  for (const Signal& signal : signals_) layout_.scalars += signal.entries();
  return layout_;
}

void PoseRecorder::Store(const Evaluator& evaluator, std::span<float> row) const {
  const AccelerationTarget& target = rig_.target;
  Matrix4 space_from_world;
  Index o = 0;
  if (!target.space.empty()) {
    const auto last = static_cast<Index>(evaluator.plan().outputs().size() - 1);
    space_from_world = InverseOrIdentity(evaluator.Get<Matrix4>(last));
  }
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
  for (const auto& mesh : target.meshes) store_points(evaluator.Points(o++), mesh.stages.back().world);
  for (const CandidateStage& candidate : candidates_)
    store_points(evaluator.Points(o++), target.meshes[candidate.mesh].stages[candidate.stage].world);
  for (const Signal& signal : signals_) {
    if (signal.matrix) {
      double entries[12];
      MatrixEntries(evaluator.Get<Matrix4>(o++), entries);
      for (double entry : entries) row[column++] = static_cast<float>(entry);
    } else {
      const Type type = evaluator.plan().outputs()[o].type;
      const double value = type == Type::kDouble ? evaluator.Get<double>(o)
                                                 : static_cast<double>(evaluator.Get<std::int64_t>(o));
      ++o;
      row[column++] = static_cast<float>(value);
    }
  }
  KPSA_CHECK_EQ(column, row.size());
}

Status PoseRecorder::Record(const std::shared_ptr<const Plan>& plan, std::size_t count, PoseMatrix* poses,
                            const std::function<void(std::size_t, Evaluator&)>& set,
                            const std::function<std::string(std::size_t)>& name) {
  std::vector<std::span<float>> rows;
  for (std::size_t i = 0; i < count; ++i) rows.push_back(poses->AddPose());
  std::mutex mutex;
  std::size_t failed = count;
  Status failure;
  const std::size_t grain =
      std::max<std::size_t>(16, count / static_cast<std::size_t>(4 * HardwareThreads()) + 1);
  ParallelFor(count, grain, [&](std::size_t begin, std::size_t end) {
    Evaluator evaluator(plan);
    for (std::size_t i = begin; i < end; ++i) {
      set(i, evaluator);
      Status status = evaluator.Evaluate();
      if (status.ok()) {
        Store(evaluator, rows[i]);
        continue;
      }
      std::lock_guard<std::mutex> lock(mutex);
      if (i < failed) failed = i, failure = std::move(status);
    }
  });
  if (failed < count) return Status::Evaluation("{}: {}", name(failed), failure.ToString());
  return Status();
}

Status PoseRecorder::AddClip(const TrainingClip& clip, PoseMatrix* poses) {
  KPSA_RETURN_IF_ERROR(rig_.set_clip(clip.name));
  Result<std::shared_ptr<const Plan>> plan = CompileFor({rig_.time});
  if (!plan.ok()) return plan.status();
  const Index time = (*plan)->FindVarying(rig_.time);
  return Record(
      *plan, clip.times.size(), poses, [&](std::size_t i, Evaluator& e) { e.Set(time, clip.times[i]); },
      [&](std::size_t i) { return fmt::format("clip \"{}\" at {} s", clip.name, clip.times[i]); });
}

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
          pose[shown[i]] = evaluator.Get<Double3>(output)[std::max(0, component)];
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
    const TrainingClip* playing = clip < 0 ? nullptr : &clips[static_cast<std::size_t>(clip)];
    KPSA_RETURN_IF_ERROR(
        rig_.set_clip(playing == nullptr ? std::nullopt : std::optional<std::string_view>(playing->name)));
    std::vector<PlugRef> varying{rig_.time};
    std::vector<std::size_t> used;
    for (std::size_t c = 0; c < rig_.controls.size(); ++c) {
      if (playing != nullptr && rig_.controls[c].by_clip) continue;
      used.push_back(c);
      varying.push_back(rig_.controls[c].plug);
    }
    Result<std::shared_ptr<const Plan>> plan = CompileFor(varying);
    if (!plan.ok()) return plan.status();
    std::vector<Index> numbers;
    for (std::size_t c : used) numbers.push_back((*plan)->FindVarying(rig_.controls[c].plug));
    const Index time = (*plan)->FindVarying(rig_.time);
    KPSA_RETURN_IF_ERROR(Record(
        *plan, mine.size(), poses,
        [&](std::size_t i, Evaluator& e) {
          if (playing != nullptr && !playing->times.empty()) {
            e.Set(time,
                  playing->times.front() + mine[i]->phase * (playing->times.back() - playing->times.front()));
          }
          for (std::size_t k = 0; k < used.size(); ++k) {
            const double value = mine[i]->values[used[k]];
            const Type type = (*plan)->varying()[numbers[k]].type;
            if (type == Type::kInt || type == Type::kBool || type == Type::kEnum) {
              e.SetInt(numbers[k], static_cast<std::int64_t>(value));
            } else {
              e.Set(numbers[k], value, rig_.controls[used[k]].plug.component);
            }
          }
        },
        [&](std::size_t i) { return fmt::format("sampled pose {}", i); }));
  }
  return Status();
}

}  // namespace kpsa
