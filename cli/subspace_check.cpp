#include "cli/subspace_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/rig_frames.h"
#include "cli/rig_training.h"
#include "kpsa/accelerate.h"
#include "kpsa/poses.h"
#include "kpsa/training_record.h"

namespace kpsa {
namespace {

constexpr std::size_t kWorst = 5;

// For each point of a mesh, the number of its region; names are added as they come.
std::vector<Index> RegionsOf(const Rig& rig, const CharacterMesh& mesh,
                             std::vector<SubspaceCheck::Region>* regions) {
  const auto number = [&](const std::string& name) {
    for (Index r = 0; r < regions->size(); ++r) {
      if ((*regions)[r].name == name) return r;
    }
    regions->push_back({name, 0, 0});
    return static_cast<Index>(regions->size() - 1);
  };
  std::vector<Index> of_point(mesh.mesh().point_count(), kNoIndex),
      of_joint(mesh.influence_nodes.size(), kNoIndex);
  for (Index p = 0; p < of_point.size(); ++p) {
    Index joint = kNoIndex;
    float most = 0;
    if (mesh.influences != nullptr) {
      for (Index i = mesh.influences->offsets()[p]; i < mesh.influences->offsets()[p + 1]; ++i) {
        if (mesh.influences->weights()[i] > most)
          most = mesh.influences->weights()[i], joint = mesh.influences->joints()[i];
      }
    }
    if (joint >= of_joint.size()) {
      of_point[p] = number(mesh.name);
      continue;
    }
    if (of_joint[joint] == kNoIndex) of_joint[joint] = number(rig.graph->name(mesh.influence_nodes[joint]));
    of_point[p] = of_joint[joint];
  }
  return of_point;
}

// The controls that are farthest from rest, as shares of their range.
std::string ControlsText(const Rig& rig, const std::vector<double>& values) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t c = 0; c < values.size(); ++c) {
    const Control& control = rig.controls[c];
    const double extent = control.max - control.min;
    if (extent > 0) order.emplace_back(-std::abs(values[c] - control.value) / extent, c);
  }
  std::sort(order.begin(), order.end());
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, order.size()); ++i) {
    const Control& control = rig.controls[order[i].second];
    text += fmt::format("{}{} {:.3g}", i == 0 ? "" : ", ", control.name,
                        values[order[i].second] / rig.units.FactorOf(control.unit));
  }
  return text;
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void SetControls(const Rig& rig, const std::vector<double>& values, Evaluator* evaluator) {
  for (std::size_t c = 0; c < values.size(); ++c) {
    PlugRef whole = rig.controls[c].plug;
    const int component = std::exchange(whole.component, -1);
    Index varying = evaluator->plan().FindVarying(rig.controls[c].plug);
    if (varying == kNoIndex) varying = evaluator->plan().FindVarying(whole);
    if (varying == kNoIndex) continue;
    const Type type = evaluator->plan().varying()[varying].type;
    if (type == Type::kDouble || type == Type::kDouble3) {
      evaluator->Set(varying, values[c], type == Type::kDouble3 ? component : -1);
    } else {
      evaluator->SetInt(varying, std::llround(values[c]));
    }
  }
}

}  // namespace

double SubspaceCheck::PredictedSpeedup(double hit_rate) const {
  const double cost = accelerated_ms + (1 - hit_rate) * full_ms;
  return cost > 0 ? full_ms / cost : 0;
}

Result<SubspaceCheck> CheckSubspace(Rig* rig, const Acceleration& entry,
                                    std::shared_ptr<const Subspace> subspace, std::size_t poses,
                                    std::uint64_t seed) {
  SubspaceCheck check;
  if (rig->controls.empty()) return check;
  KPSA_RETURN_IF_ERROR(SetClip(rig, std::nullopt));
  Request request;
  request.varying = VaryingPlugs(*rig);
  for (const AcceleratedPoints& points : entry.points) request.outputs.push_back({points.points, {}});
  Compiler compiler;
  const auto full_plan = CompileFor(*rig, &compiler, request);
  if (!full_plan.ok()) return full_plan.status();
  AccelerateOptions options;
  options.tolerance = std::numeric_limits<double>::max();  // reconstruct whatever comes
  const Result<Accelerated> accelerated =
      Accelerate(rig->graph.get(), &compiler, MakeTarget(*rig, entry), subspace,
                 rig->graph->FreeNodeName("check_kpsa"), options);
  if (!accelerated.ok()) return accelerated.status();
  const int out_points = rig->graph->def(accelerated->node).FindAttribute("outPoints");
  for (std::size_t p = 0; p < request.outputs.size(); ++p)
    request.outputs[p].plug = {accelerated->node, out_points, static_cast<int>(p), -1};
  const auto fast_plan = CompileFor(*rig, &compiler, request);
  if (!fast_plan.ok()) return fast_plan.status();

  std::vector<ControlRange> ranges;
  for (const Control& control : rig->controls)
    ranges.push_back({control.plug, control.min, control.max, control.value, control.by_clip});
  std::vector<std::vector<Index>> regions;
  for (std::size_t p = 0; p < entry.points.size(); ++p) {
    const AcceleratedPoints& points = entry.points[p];
    if (points.colors) {
      const Index total = (*full_plan)->outputs()[p].points.total();
      regions.emplace_back(total, static_cast<Index>(check.worst_regions.size()));
      check.worst_regions.push_back({rig->graph->PlugName(points.points), 0, 0});
    } else {
      regions.push_back(RegionsOf(*rig, rig->scene.meshes[points.mesh], &check.worst_regions));
    }
  }
  std::vector<std::size_t> region_counts(check.worst_regions.size(), 0);
  Evaluator full(*full_plan), fast(*fast_plan);
  std::vector<double> full_ns, fast_ns;
  double squares = 0;
  std::size_t count = 0;
  for (const SampledPose& pose : SamplePoses(ranges, {}, {}, 0, poses, seed)) {
    if (Interrupted()) return InterruptedStatus();
    for (Evaluator* evaluator : {&full, &fast}) {
      SetControls(*rig, pose.values, evaluator);
      const std::uint64_t begin = ProfileClock();
      KPSA_RETURN_IF_ERROR(evaluator->Evaluate());
      (evaluator == &full ? full_ns : fast_ns).push_back(static_cast<double>(ProfileClock() - begin));
    }
    SubspaceCheck::Pose result;
    double pose_squares = 0;
    std::size_t pose_count = 0;
    for (Index p = 0; p < entry.points.size(); ++p) {
      const ConstPointsView a = full.Points(p), b = fast.Points(p);
      for (std::size_t i = 0; i < a.count; ++i) {
        const Double3 d{double{a.x[i]} - b.x[i], double{a.y[i]} - b.y[i], double{a.z[i]} - b.z[i]};
        const double square = Dot(d, d);
        SubspaceCheck::Region& region = check.worst_regions[regions[p][i]];
        region.rms += square;
        region.max = std::max(region.max, std::sqrt(square));
        ++region_counts[regions[p][i]];
        pose_squares += square;
        if (std::sqrt(square) > result.max) result.max = std::sqrt(square), result.region = region.name;
      }
      pose_count += a.count;
    }
    result.rms = std::sqrt(pose_squares / static_cast<double>(std::max<std::size_t>(1, pose_count)));
    result.controls = ControlsText(*rig, pose.values);
    squares += pose_squares, count += pose_count;
    check.max = std::max(check.max, result.max);
    check.worst_poses.push_back(std::move(result));
  }
  check.poses = check.worst_poses.size();
  check.rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, count)));
  check.full_ms = Median(full_ns) / 1e6;
  check.accelerated_ms = Median(fast_ns) / 1e6;
  for (std::size_t r = 0; r < region_counts.size(); ++r) {
    check.worst_regions[r].rms = std::sqrt(check.worst_regions[r].rms /
                                           static_cast<double>(std::max<std::size_t>(1, region_counts[r])));
  }
  std::stable_sort(check.worst_poses.begin(), check.worst_poses.end(),
                   [](const auto& a, const auto& b) { return a.max > b.max; });
  std::stable_sort(check.worst_regions.begin(), check.worst_regions.end(),
                   [](const auto& a, const auto& b) { return a.rms > b.rms; });
  check.worst_poses.resize(std::min(kWorst, check.worst_poses.size()));
  check.worst_regions.resize(std::min(kWorst, check.worst_regions.size()));
  return check;
}

}  // namespace kpsa
