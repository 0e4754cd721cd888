#include "cli/bench_run.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/parallel.h"
#include "cli/frames_range.h"
#include "cli/point_errors.h"
#include "cli/progress.h"
#include "cli/rig_frames.h"
#include "kpsa/accelerate.h"
#include "kpsa/training_record.h"

namespace kpsa {
namespace {

double Median(std::vector<double> values) {
  const std::size_t middle = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle), values.end());
  const double high = values[middle];
  if (values.size() % 2 == 1) return high;
  return (high + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle))) / 2;
}

// Steps with points that the outputs of these nodes need, themselves included.
std::vector<char> PointStepsAbove(const Plan& plan, const std::vector<NodeId>& nodes) {
  const auto count = static_cast<Index>(plan.steps().size());
  std::vector<char> seen(count, 0);
  std::vector<Index> stack;
  for (Index s = 0; s < count; ++s) {
    if (std::find(nodes.begin(), nodes.end(), plan.infos()[s].node) != nodes.end())
      stack.push_back(s), seen[s] = 1;
  }
  while (!stack.empty()) {
    const Index s = stack.back();
    stack.pop_back();
    for (Index p : Producers(plan, s)) {
      if (!seen[p]) stack.push_back(p), seen[p] = 1;
    }
  }
  for (Index s = 0; s < count; ++s) seen[s] = seen[s] && plan.infos()[s].points_total > 0;
  return seen;
}

// One of the two evaluations.
struct Side {
  std::shared_ptr<const Plan> plan;
  std::unique_ptr<Evaluator> evaluator;
  Index time = kNoIndex;
  std::vector<std::vector<double>> frame_ns;  // by frame and run

  Side(const Rig& rig, std::shared_ptr<const Plan> made, bool parallel, std::size_t frames)
      : plan(std::move(made)),
        evaluator(std::make_unique<Evaluator>(plan, EvaluatorOptions{parallel, nullptr})),
        time(plan->FindVarying(rig.scene.time)),
        frame_ns(frames) {}
  Status Evaluate(double t) {
    if (time != kNoIndex) evaluator->Set(time, t);
    return evaluator->Evaluate();
  }
  // Before another pass over the frames: nodes that remember the previous one do not go back.
  void StartAgain() {
    if (!plan->stateful_node().empty()) evaluator->Restart();
  }
  Status Timed(std::size_t frame, double t) {
    const std::uint64_t begin = ProfileClock();
    Status status = Evaluate(t);
    frame_ns[frame].push_back(static_cast<double>(ProfileClock() - begin));
    return status;
  }
};

// Sums over clips; divided by frames at the end.
struct Sums {
  double full_ns = 0, accelerated_ns = 0, full_hit_ns = 0, accelerated_hit_ns = 0;
  double graph = 0, cues = 0, projection = 0, reconstruction = 0, downstream = 0, misses = 0, bound_graph = 0,
         bound_points = 0;
  double points_full = 0, points_accelerated = 0;
  std::map<std::string, BenchNode> nodes;
  std::set<std::string> computed;
};

// Points that a profiled evaluation computed, copies by helper steps and the KPSA nodes left out.
double PointsComputed(const Plan& plan, const Profile& profile) {
  double points = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    if (*plan.step_label(s) != 0 || std::string_view(plan.step_type(s)) == "kpsa") continue;
    points += static_cast<double>(plan.infos()[s].points) * static_cast<double>(profile.counts()[s]);
  }
  return points;
}

// Where colours are accelerated, they are what is compared: those of the nodes, or what takes their place.
Request ColorOutputs(const Rig& rig, const std::vector<AppliedSubspace>& applied, bool accelerated) {
  Request request;
  for (const AppliedSubspace& one : applied) {
    for (std::size_t p = 0; p < one.entry.points.size(); ++p) {
      if (one.entry.points[p].colors)
        request.outputs.push_back({accelerated ? one.Output(*rig.graph, p) : one.entry.points[p].points, {}});
    }
  }
  request.varying.push_back(rig.scene.time);
  return request;
}

constexpr std::size_t kTurnFrames = 32;  // of one side, before the other runs them

// What it costs to record the steps of a profile: for small nodes as much as they do.
double RecordingNs(const Plan& plan, const Profile& recorded) {
  constexpr int kEvents = 4000;
  if (plan.steps().empty()) return 0;
  Profile profile(plan);
  const std::uint64_t begin = ProfileClock();
  for (int i = 0; i < kEvents; ++i) profile.Add({0, kNoIndex, ProfileClock(), ProfileClock(), 0, 0});
  const double each = static_cast<double>(ProfileClock() - begin) / kEvents;
  double events = 0;
  for (std::uint64_t count : recorded.counts()) events += static_cast<double>(count);
  return each * events;
}

class Bench {
 public:
  Bench(const BenchOptions& options, BenchResult* result) : options_(options), result_(*result) {}

  Status RunClip(const Flags& flags, const AccelerationFlags& acceleration, const std::string& clip,
                 Progress* progress) {
    Flags with_clip = flags;
    if (!clip.empty()) with_clip.clip = clip;
    const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(with_clip);
    if (!open.ok()) return open.status();
    Rig& rig = (*open)->rig;
    const Result<std::vector<double>> times = SampleTimes(with_clip, rig);
    if (!times.ok()) return times.status();
    Compiler compiler;
    auto full_plan = CompileFor(rig, &compiler, AllMeshes(rig));
    if (!full_plan.ok()) return full_plan.status();
    const Result<std::vector<AppliedSubspace>> applied = ApplyAcceleration(&rig, &compiler, acceleration);
    if (!applied.ok()) return applied.status();
    Request request = AllMeshes(rig);
    if (Request colors = ColorOutputs(rig, *applied, false); !colors.outputs.empty()) {
      full_plan = CompileFor(rig, &compiler, colors);
      if (!full_plan.ok()) return full_plan.status();
      request = ColorOutputs(rig, *applied, true);
    }
    const std::size_t compared = request.outputs.size();
    Verdicts verdicts(*applied, rig, &request);
    const auto fast_plan = CompileFor(rig, &compiler, request);
    if (!fast_plan.ok()) return fast_plan.status();
    Describe(rig, *applied);
    Side full(rig, *full_plan, options_.threads > 1, times->size()),
        fast(rig, *fast_plan, options_.threads > 1, times->size());
    const auto located = [&](const Status& status, double t) {
      return Status::Evaluation("at {} s: {}", t, status.errors().front().message).At({rig.path});
    };

    // Points
    std::vector<char> hit;
    PointErrors errors(compared);
    for (std::size_t f = 0; f < times->size(); ++f) {
      if (Interrupted()) return InterruptedStatus();
      progress->Set(done_++);
      for (Side* side : {&full, &fast}) {
        if (const Status status = side->Evaluate((*times)[f]); !status.ok())
          return located(status, (*times)[f]);
      }
      verdicts.Add(f, *fast.evaluator);
      hit.push_back(verdicts.last_hit());
      const double worst = errors.AddFrame(*full.evaluator, *fast.evaluator);
      // A blended or full miss keeps the tolerance, too, or it counts
      if ((result_.light ? errors.frame_rms() : worst) > result_.tolerance) ++result_.violations;
      result_.per_frame.push_back(
          {rig.scene.clip.value_or(""), f, verdicts.last_hit(), errors.frame_rms(), worst, 0, 0});
      if (worst > result_.error_max)
        result_.error_max = worst, result_.worst_frame = f, result_.worst_clip = rig.scene.clip.value_or("");
    }
    errors_.Merge(errors);
    result_.hits += verdicts.hits();
    result_.frames += times->size();
    result_.verdict_text = verdicts.Text();
    if (!verdicts.WorstMiss().empty()) result_.worst_miss = verdicts.WorstMiss();

    // Times. The sides take turns by blocks of frames: each keeps its caches as in playback, and both see the
    // same machine
    for (int run = 0; run < options_.runs; ++run) {
      full.StartAgain();
      fast.StartAgain();
      for (std::size_t first = 0, block = 0; first < times->size(); first += kTurnFrames, ++block) {
        const std::size_t end = std::min(first + kTurnFrames, times->size());
        Side* const side = (static_cast<std::size_t>(run) + block) % 2 == 0 ? &full : &fast;
        for (Side* turn : {side, side == &full ? &fast : &full}) {
          for (std::size_t f = first; f < end; ++f) {
            if (Interrupted()) return InterruptedStatus();
            if (const Status status = turn->Timed(f, (*times)[f]); !status.ok())
              return located(status, (*times)[f]);
          }
        }
        for (std::size_t f = first; f < end; ++f) progress->Set(done_++);
      }
    }
    double clip_full = 0, clip_fast = 0;
    for (std::size_t f = 0; f < times->size(); ++f) {
      const double a = Median(full.frame_ns[f]), b = Median(fast.frame_ns[f]);
      clip_full += a, clip_fast += b;
      BenchResult::Frame& frame = result_.per_frame[result_.per_frame.size() - times->size() + f];
      frame.full_ms = a / 1e6, frame.accelerated_ms = b / 1e6;
      if (hit[f]) sums_.full_hit_ns += a, sums_.accelerated_hit_ns += b;
    }
    sums_.full_ns += clip_full;
    sums_.accelerated_ns += clip_fast;
    return ProfileClip(*applied, &full, &fast, *times, clip_full, clip_fast);
  }

  void Finish() {
    const auto frames = static_cast<double>(std::max<std::size_t>(1, result_.frames));
    const auto hits = static_cast<double>(std::max<std::size_t>(1, result_.hits));
    const auto ms = [&](double ns) { return ns / frames / 1e6; };
    result_.full_ms = ms(sums_.full_ns);
    result_.accelerated_ms = ms(sums_.accelerated_ns);
    result_.full_ms_on_hits = sums_.full_hit_ns / hits / 1e6;
    result_.accelerated_ms_on_hits = sums_.accelerated_hit_ns / hits / 1e6;
    result_.graph_ms = ms(sums_.graph), result_.cues_ms = ms(sums_.cues),
    result_.projection_ms = ms(sums_.projection);
    result_.reconstruction_ms = ms(sums_.reconstruction), result_.downstream_ms = ms(sums_.downstream),
    result_.misses_ms = ms(sums_.misses);
    result_.bound_graph_ms = ms(sums_.bound_graph), result_.bound_points_ms = ms(sums_.bound_points);
    result_.bound_ms = result_.bound_graph_ms + result_.bound_points_ms;
    result_.points_full = sums_.points_full / frames;
    result_.points_accelerated = sums_.points_accelerated / frames;
    for (auto& [name, node] : sums_.nodes) {
      node.ms_per_frame = ms(node.ms_per_frame);
      result_.full_nodes.push_back(node);
      if (!sums_.computed.contains(name)) result_.never_evaluated.push_back(name);
    }
    result_.nodes_total = sums_.nodes.size();
    std::stable_sort(result_.full_nodes.begin(), result_.full_nodes.end(),
                     [](const BenchNode& a, const BenchNode& b) { return a.ms_per_frame > b.ms_per_frame; });
    result_.error_rms = errors_.rms();
    result_.error_p99 = errors_.Percentile(0.99);
    result_.motion_rms = errors_.motion_rms();
    result_.diagonal = errors_.diagonal();
  }

 private:
  void Describe(const Rig& rig, const std::vector<AppliedSubspace>& applied) {
    result_.clips.push_back(rig.scene.clip.value_or("(rest)"));
    if (result_.clips.size() > 1) return;
    std::map<std::string, std::size_t> stages;
    if (ColorOutputs(rig, applied, false).outputs.empty()) {
      for (const CharacterMesh& mesh : rig.scene.meshes) result_.output_points += mesh.mesh().point_count();
    } else {
      for (const AppliedSubspace& one : applied) {
        for (const SubspaceOutput& output : one.subspace->outputs) result_.output_points += output.points;
      }
    }
    result_.tolerance = applied.front().tolerance;
    result_.light = applied.front().subspace->of_light();
    result_.violation_limit = applied.front().violation_rate;
    for (const AppliedSubspace& one : applied) {
      for (const std::string& note : one.notes) result_.notes.push_back(note);
      for (const SubspaceOutput& output : one.subspace->outputs) result_.points += output.points;
      result_.cues += one.subspace->cues.size();
      result_.modes += one.subspace->modes;
      for (const CueDescription& cue : one.subspace->cues) {
        const bool scalar = cue.kind == CueDescription::Kind::kScalar;
        const std::string& name = scalar ? cue.plug : one.subspace->outputs[cue.mesh].name;
        ++stages[scalar ? "scalars" : "points of " + name.substr(0, name.rfind('@')) + "@" + cue.stage];
      }
      const TrainingRecord record = ParseTraining(one.subspace->training);
      for (const std::string& clip : record.clips) result_.trained_on.push_back(clip);
      if (record.sampled_poses > 0)
        result_.trained_on.push_back(fmt::format("{} samples of the controls", record.sampled_poses));
    }
    for (const auto& [stage, count] : stages)
      result_.cue_stages.push_back(fmt::format("{} {}", count, stage));
  }

  // What the time consists of. A profiled evaluation is slower: what recording costs is taken out, and the
  // parts are scaled to the timed one.
  Status ProfileClip(const std::vector<AppliedSubspace>& applied, Side* full, Side* fast,
                     const std::vector<double>& times, double full_ns, double fast_ns) {
    Profile full_profile(*full->plan), fast_profile(*fast->plan);
    double full_wall = 0, fast_wall = 0;
    full->StartAgain();
    fast->StartAgain();
    MeasureKpsaTimes(true);
    TakeKpsaTimes();
    Status status;
    for (std::size_t f = 0; f < times.size() && status.ok(); ++f) {
      for (Side* side : {full, fast}) {
        side->evaluator->Record(side == full ? &full_profile : &fast_profile, static_cast<int>(f));
        const std::uint64_t begin = ProfileClock();
        if (status.ok()) status = side->Evaluate(times[f]);
        (side == full ? full_wall : fast_wall) += static_cast<double>(ProfileClock() - begin);
        side->evaluator->Record(nullptr);
      }
    }
    const KpsaTimes kpsa = TakeKpsaTimes();
    MeasureKpsaTimes(false);
    KPSA_RETURN_IF_ERROR(std::move(status));

    full_wall -= RecordingNs(*full->plan, full_profile);
    fast_wall -= RecordingNs(*fast->plan, fast_profile);
    const double full_scale = full_ns / std::max(1.0, full_wall),
                 fast_scale = fast_ns / std::max(1.0, fast_wall);
    std::vector<NodeId> stage_nodes, kpsa_nodes;
    for (const AppliedSubspace& one : applied) {
      kpsa_nodes.push_back(one.node);
      for (const AcceleratedPoints& points : one.entry.points) stage_nodes.push_back(points.points.node);
    }
    const std::vector<char> skippable = PointStepsAbove(*full->plan, stage_nodes);
    double skipped = 0, kept_points = 0;
    for (Index s = 0; s < full->plan->steps().size(); ++s) {
      const double ns = static_cast<double>(full_profile.self_ns()[s]) * full_scale;
      BenchNode& node = sums_.nodes[full->plan->step_name(s)];
      node.name = full->plan->step_name(s), node.type = full->plan->step_type(s);
      node.ms_per_frame += ns;
      node.points = std::max(node.points, full->plan->infos()[s].points);
      if (skippable[s]) skipped += ns;
      if (!skippable[s] && full->plan->infos()[s].points_total > 0) kept_points += ns;
    }
    sums_.bound_points += kept_points;
    sums_.bound_graph += std::max(0.0, full_ns - skipped - kept_points);
    const std::vector<char> cue_steps = PointStepsAbove(*fast->plan, kpsa_nodes);
    double cues = static_cast<double>(kpsa.cues) * fast_scale, downstream = 0, misses = 0;
    for (Index s = 0; s < fast->plan->steps().size(); ++s) {
      const Plan::StepInfo& info = fast->plan->infos()[s];
      const double ns = static_cast<double>(fast_profile.self_ns()[s]) * fast_scale;
      if (fast_profile.counts()[s] > 0) sums_.computed.insert(fast->plan->step_name(s));
      if (std::find(kpsa_nodes.begin(), kpsa_nodes.end(), info.node) != kpsa_nodes.end()) continue;
      if (info.segment != 0) {
        misses += ns;
      } else if (info.points_total > 0) {
        (cue_steps[s] ? cues : downstream) += ns;
      }
    }
    sums_.cues += cues, sums_.downstream += downstream, sums_.misses += misses;
    sums_.projection += static_cast<double>(kpsa.projection) * fast_scale;
    sums_.reconstruction += static_cast<double>(kpsa.reconstruction) * fast_scale;
    sums_.graph += std::max(0.0, fast_ns - cues - downstream - misses -
                                     static_cast<double>(kpsa.projection + kpsa.reconstruction) * fast_scale);
    sums_.points_full += PointsComputed(*full->plan, full_profile);
    sums_.points_accelerated += PointsComputed(*fast->plan, fast_profile);
    return Status();
  }

  const BenchOptions& options_;
  BenchResult& result_;
  PointErrors errors_;
  Sums sums_;
  std::size_t done_ = 0;
};

}  // namespace

Result<BenchResult> RunBench(const Flags& flags, const AccelerationFlags& acceleration,
                             const std::vector<std::string>& clips, const BenchOptions& options) {
  BenchResult result;
  const ThreadLimit limit(options.threads);
  Bench bench(options, &result);
  Progress progress("bench, frames", 0, options.quiet);
  for (const std::string& clip : clips)
    KPSA_RETURN_IF_ERROR(bench.RunClip(flags, acceleration, clip, &progress));
  bench.Finish();
  return result;
}

}  // namespace kpsa
