#include "tests/cli/rig_run.h"

#include <cmath>
#include <limits>

#include "kpsa/training/space_points.h"
#include "nodes/standard_nodes.h"

namespace kpsa::engine {

const NodeRegistry& AcceleratedRegistry() {
  static const NodeRegistry* registry = [] {
    auto* r = new NodeRegistry;
    AddStandardNodes(*r);
    AddKpsaNode(*r);
    return r;
  }();
  return *registry;
}

Result<Rig> LoadRigOf(const TemporaryFolder& folder, const std::string& gltf, const std::string& yaml) {
  folder.Write("m.gltf", gltf);
  return LoadRig(AcceleratedRegistry(), folder.Write("m.yaml", "kpsa: 1\ncharacter: m.gltf\n" + yaml), {});
}

std::shared_ptr<const Subspace> TrainRig(const std::string& path, const TrainOptions& options,
                                         const std::vector<std::string>& clips) {
  RigOptions rest;
  rest.rest = true;
  Result<Rig> rig = LoadRig(AcceleratedRegistry(), path, rest);
  EXPECT_TRUE(rig.ok()) << rig.status().ToString();
  if (!rig.ok() || rig->accelerate.empty()) return nullptr;
  Result<std::vector<TrainingClip>> frames = ClipFrames(*rig, clips);
  EXPECT_TRUE(frames.ok()) << frames.status().ToString();
  if (!frames.ok()) return nullptr;
  Result<Subspace> subspace = Train(MakeTrainingRig(&*rig, rig->accelerate[0]), *frames, options);
  EXPECT_TRUE(subspace.ok()) << subspace.status().ToString();
  return subspace.ok() ? std::make_shared<const Subspace>(std::move(*subspace)) : nullptr;
}

std::shared_ptr<const Subspace> WithThreshold(const Subspace& subspace, double tau_lo, double tau) {
  auto copy = std::make_shared<Subspace>(subspace);
  copy->blend_start = tau_lo / tau;
  copy->violation_rate = 0.05;
  copy->patches = {};
  copy->calibration.assign(100, CalibrationPair{tau_lo, 0});  // harmless, and the last score that was seen
  return copy;
}

std::shared_ptr<const Subspace> WithGuardsOnly(const Subspace& subspace) {
  constexpr double kBlendStart = 0.85, kAnyScore = 1e30;
  return WithThreshold(subspace, kBlendStart * kAnyScore, kAnyScore);
}

double LargestDistance(const std::vector<float>& a, const std::vector<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  const std::size_t n = a.size() / 3;
  double worst = 0;
  for (std::size_t i = 0; i < n && a.size() == b.size(); ++i) {
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double d = static_cast<double>(a[k * n + i]) - b[k * n + i];
      squared += d * d;
    }
    if (!std::isfinite(squared)) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, squared);
  }
  return std::sqrt(worst);
}

RigRun::RigRun(const std::string& path, const RigRunOptions& options) {
  if (const Status status = Start(path, options); !status.ok()) error = status.ToString();
}

Status RigRun::Start(const std::string& path, const RigRunOptions& options) {
  RigOptions rig_options;
  rig_options.clip = options.clip;
  rig_options.rest = !options.clip.has_value();
  Result<Rig> loaded = LoadRig(AcceleratedRegistry(), path, rig_options);
  if (!loaded.ok()) return loaded.status();
  rig = std::move(*loaded);
  Request request;
  request.varying = VaryingPlugs(rig);
  if (!rig.accelerate.empty()) target = MakeTarget(rig, rig.accelerate[0]);
  for (const auto* names : {&options.varying, &options.secret}) {
    for (const std::string& name : *names) {
      const Result<PlugRef> plug = rig.graph->FindPlug(name);
      if (!plug.ok()) return plug.status();
      request.varying.push_back(*plug);
      if (names == &options.varying) target.varying.push_back(*plug);
    }
  }
  std::vector<PlugRef> finals;
  for (const CharacterMesh& mesh : rig.scene.meshes) finals.push_back(mesh.points);
  if (options.subspace != nullptr) {
    Result<Accelerated> result =
        Accelerate(rig.graph.get(), &compiler, target, options.subspace, "kpsa", options.accelerate);
    if (!result.ok()) return result.status();
    accelerated = std::move(*result);
    has_subspace_ = true;
    const NodeDef& def = rig.graph->def(accelerated.node);
    const std::vector<PlugRef> outputs = target.outputs();
    for (PlugRef& plug : finals) {
      for (std::size_t m = 0; m < outputs.size(); ++m) {
        if (plug == outputs[m]) {
          plug = {accelerated.node, def.FindAttribute("outPoints"), static_cast<int>(m), -1};
          break;
        }
      }
    }
  }
  for (const PlugRef& plug : finals) request.outputs.push_back({plug, {}});
  if (has_subspace_) {
    const NodeDef& def = rig.graph->def(accelerated.node);
    for (const char* name : {"hit", "score", "missReason", "offender", "fullWeight"}) {
      request.outputs.push_back({{accelerated.node, def.FindAttribute(name), -1, -1}, {}});
    }
  }
  Result<std::shared_ptr<const Plan>> compiled = compiler.Compile(*rig.graph, request);
  if (!compiled.ok()) return compiled.status();
  plan = *compiled;
  evaluator = std::make_unique<Evaluator>(plan, options.evaluator);
  profile = std::make_unique<Profile>(*plan);
  evaluator->Record(profile.get());
  return Status();
}

void RigRun::Set(const std::string& name, double value, Evaluator* to) const {
  const Result<PlugRef> plug = rig.graph->FindPlug(name);
  ASSERT_TRUE(plug.ok()) << plug.status().ToString();
  ASSERT_TRUE(plan->Handle(*plug)) << name << " does not vary";
  SetPlug(to, *plug, value);
}

void RigRun::Pose(std::span<const double> values, Evaluator* to) const {
  for (std::size_t c = 0; c < rig.controls.size() && c < values.size(); ++c)
    SetPlug(to, rig.controls[c].plug, values[c]);  // nothing where a clip plays it
}

RunFrame RigRun::Evaluate() {
  const Status status = evaluator->Evaluate();
  EXPECT_TRUE(status.ok()) << status.ToString();
  return Frame(*evaluator);
}

RunFrame RigRun::Frame(const Evaluator& from) const {
  RunFrame frame;
  const auto meshes = static_cast<Index>(rig.scene.meshes.size());
  for (Index m = 0; m < meshes; ++m) {
    const ConstPointsView p = from.Points(m);
    for (const float* values : {p.x, p.y, p.z})
      frame.points.insert(frame.points.end(), values, values + p.count);
  }
  if (!has_subspace_) return frame;
  frame.hit = from.Get<std::int64_t>(meshes) != 0;
  frame.score = from.Get<double>(meshes + 1);
  frame.reason = static_cast<MissReason>(from.Get<std::int64_t>(meshes + 2));
  const std::int64_t offender = from.Get<std::int64_t>(meshes + 3);
  frame.full_weight = from.Get<double>(meshes + 4);
  frame.text =
      MissText(*accelerated.config, frame.reason, offender < 0 ? kNoIndex : static_cast<Index>(offender));
  return frame;
}

std::uint64_t RigRun::Computes(const std::string& node) const {
  std::uint64_t count = 0;
  for (Index s = 0; s < plan->steps().size(); ++s) {
    if (node == plan->step_name(s)) count += profile->counts()[s];
  }
  return count;
}

std::size_t HitsOf(const std::string& path, std::shared_ptr<const Subspace> subspace, const std::string& clip,
                   int frames) {
  RigRunOptions options;
  options.subspace = std::move(subspace);
  options.clip = clip;
  RigRun run(path, options);
  EXPECT_TRUE(run.ok()) << run.error;
  std::size_t hits = 0;
  for (int f = 0; f < frames && run.ok(); ++f) {
    run.SetTime(f / 24.0);
    hits += run.Evaluate().hit;
  }
  return hits;
}

std::vector<std::vector<double>> SmoothPoses(const Rig& rig, std::size_t count, double reach, double speed) {
  std::vector<std::vector<double>> poses;
  for (std::size_t f = 0; f < count; ++f) {
    std::vector<double>& pose = poses.emplace_back();
    for (std::size_t c = 0; c < rig.controls.size(); ++c) {
      const Control& control = rig.controls[c];
      const double wave = std::sin(speed * static_cast<double>(f) + static_cast<double>(c));
      pose.push_back(0.5 * (control.min + control.max) + 0.5 * reach * wave * (control.max - control.min));
    }
  }
  return poses;
}

void ExpectBitsOfAll(RigRun* run, const std::vector<std::vector<Index>>& sets) {
  const NodeDef& def = run->rig.graph->def(run->accelerated.node);
  const PlugRef points{run->accelerated.node, def.FindAttribute("outPoints"), 0, -1};
  for (const std::vector<Index>& some : sets) {
    const std::size_t total = run->Evaluate().points.size() / 3;
    Request request;
    request.varying = VaryingPlugs(run->rig);
    request.outputs.push_back({points, PointSet::Of(some, static_cast<Index>(total))});
    const Result<std::shared_ptr<const Plan>> plan = run->compiler.Compile(*run->rig.graph, request);
    ASSERT_TRUE(plan.ok()) << plan.status().ToString();
    Evaluator evaluator(*plan);
    for (const auto& pose : SmoothPoses(run->rig, 5, 0.8)) {
      run->Pose(pose);
      const std::vector<float> all = run->Evaluate().points;
      for (std::size_t c = 0; c < run->rig.controls.size(); ++c) {
        const PlugRef& plug = run->rig.controls[c].plug;
        const Index varying = (*plan)->FindVarying(plug);
        if (varying != kNoIndex)
          evaluator.Set(varying, pose[c],
                        (*plan)->varying()[varying].type == Type::kDouble3 ? plug.component : -1);
      }
      ASSERT_TRUE(evaluator.Evaluate().ok());
      const ConstPointsView part = evaluator.Points(0);
      ASSERT_EQ(part.count, some.size());
      for (std::size_t i = 0; i < some.size(); ++i) {
        EXPECT_EQ(part.x[i], all[some[i]]);
        EXPECT_EQ(part.y[i], all[total + some[i]]);
        EXPECT_EQ(part.z[i], all[2 * total + some[i]]);
      }
    }
  }
}

}  // namespace kpsa::engine
