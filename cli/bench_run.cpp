#include "cli/bench_run.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <numeric>
#include <set>

#include "base/parallel.h"
#include "cli/frames_range.h"
#include "cli/point_errors.h"
#include "cli/progress.h"
#include "cli/rig_frames.h"
#include "cli/rig_training.h"
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

// One of the evaluations.
struct Side {
  std::shared_ptr<const Plan> plan;
  std::unique_ptr<Evaluator> evaluator;
  Index time = kNoIndex;
  std::vector<std::vector<double>> frame_ns;  // by frame and run
  bool anew = false;                          // every evaluation: nothing changes from frame to frame

  Side(const Rig& rig, std::shared_ptr<const Plan> made, bool parallel, std::size_t frames, bool still)
      : plan(std::move(made)),
        evaluator(std::make_unique<Evaluator>(plan, EvaluatorOptions{parallel, nullptr})),
        time(plan->FindVarying(rig.scene.time)),
        frame_ns(frames),
        anew(still || frames == 1) {}
  Status Evaluate(double t) {
    if (time != kNoIndex) evaluator->Set(time, t);
    return evaluator->Evaluate();
  }
  // Before another pass over the frames: nodes that remember the previous one do not go back.
  void StartAgain() {
    if (!plan->stateful_node().empty()) evaluator->Restart();
  }
  void Forget() {
    if (anew) evaluator->Invalidate();
  }
  Status Timed(std::size_t frame, double t) {
    Forget();
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

constexpr std::size_t kTurnFrames = 128;  // of one side, before the other runs them: some seconds of playback

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

// One accelerated side: what is summed over the clips, and what belongs to the present one.
struct Contender {
  AccelerationFlags flags;
  BenchResult result;
  PointErrors errors;
  Sums sums;
  Reasons reasons;

  std::unique_ptr<OpenRig> open;
  std::vector<AppliedSubspace> applied;
  Request request;
  std::size_t compared = 0;  // outputs
  std::unique_ptr<Verdicts> verdicts;
  std::unique_ptr<Side> side;
  PointErrors clip_errors;
  std::vector<char> hit;
  FullWeights weights;

  // The rig of the flags with the subspaces in place. `outputs` becomes what the full side has to compute.
  // Where nothing moves, the controls vary.
  Status Load(const Flags& clip_flags, const BenchOptions& options, std::size_t frames, bool still,
              Request* outputs) {
    Result<std::unique_ptr<OpenRig>> loaded = LoadRigOf(clip_flags);
    if (!loaded.ok()) return loaded.status();
    side.reset(), verdicts.reset(), applied.clear();  // of the clip before, which refer to its rig
    open = std::move(*loaded);
    Rig& rig = open->rig;
    Compiler compiler;
    *outputs = ShownPoints(rig);
    Result<std::vector<AppliedSubspace>> made = ApplyAcceleration(&rig, &compiler, flags);
    if (!made.ok()) return made.status();
    applied = std::move(*made);
    request = ShownPoints(rig);
    if (Request colors = ColorOutputs(rig, applied, false); !colors.outputs.empty()) {
      *outputs = std::move(colors);
      request = ColorOutputs(rig, applied, true);
    }
    compared = request.outputs.size();
    if (still) outputs->varying = request.varying = VaryingPlugs(rig);
    verdicts = std::make_unique<Verdicts>(applied);
    verdicts->Ask(rig, &request);
    const auto plan = CompileFor(rig, &compiler, request);
    if (!plan.ok()) return plan.status();
    side = std::make_unique<Side>(rig, *plan, options.threads > 1, frames, still);
    clip_errors = PointErrors(compared);
    hit.clear();
    weights.clear();
    return Status();
  }
  void Describe();
  void Compare(std::int64_t frame, const Evaluator& full, const std::string& clip);
  void AddTimes(const std::vector<double>& full_ns);
  void AddFullProfile(const Plan& plan, const Profile& profile, double wall, double full_ns);
  void AddProfile(const Profile& profile, const KpsaTimes& kpsa, double wall, double fast_ns);
  void Finish();
};

void Contender::Describe() {
  const Rig& rig = open->rig;
  result.clips.push_back(rig.scene.clip.value_or("(rest)"));
  if (result.clips.size() > 1) return;
  std::map<std::string, std::size_t> stages;
  if (ColorOutputs(rig, applied, false).outputs.empty()) {
    for (const std::size_t m : ShownMeshes(rig.scene))
      result.output_points += rig.scene.meshes[m].mesh().point_count();
  } else {
    for (const AppliedSubspace& one : applied) {
      for (const SubspaceOutput& output : one.subspace->outputs) result.output_points += output.points;
    }
  }
  result.subspace = applied.front().path;
  result.mode = applied.front().subspace->mode == EstimatorMode::kMap ? "map" : "paper";
  result.tolerance = applied.front().tolerance;
  result.light = applied.front().subspace->of_light();
  result.violation_limit = applied.front().violation_rate;
  double bytes = 0, tiles = 0;
  for (const AppliedSubspace& one : applied) {
    for (const std::string& note : one.notes) result.notes.push_back(note);
    for (const SubspaceOutput& output : one.subspace->outputs) result.points += output.points;
    for (const TileMap& map : one.subspace->tiles) {
      bytes += static_cast<double>(map.bytes()), tiles += static_cast<double>(map.tiles());
      result.mean_rank += map.mean_rank() * static_cast<double>(map.tiles());
    }
    result.cues += one.subspace->cues.size();
    result.modes += one.subspace->modes;
    for (const CueDescription& cue : one.subspace->cues) {
      const bool scalar = cue.kind == CueDescription::Kind::kScalar;
      ++stages[scalar ? "scalars" : "points of " + CueName(*one.subspace, cue)];
      result.cue_points += !scalar;
    }
    const TrainingRecord record = ParseTraining(one.subspace->training);
    for (const std::string& clip : record.clips) result.trained_on.push_back(clip);
    if (record.sampled_poses > 0)
      result.trained_on.push_back(fmt::format("{} samples of the controls", record.sampled_poses));
  }
  result.bytes_per_point = bytes / static_cast<double>(std::max<std::size_t>(1, result.points));
  result.mean_rank /= std::max(1.0, tiles);
  for (const auto& [stage, count] : stages) result.cue_stages.push_back(fmt::format("{} {}", count, stage));
}

// After both have evaluated a frame.
void Contender::Compare(std::int64_t frame, const Evaluator& full, const std::string& clip) {
  verdicts->Add(frame, *side->evaluator);
  const FrameDecision& decision = verdicts->records().back().decision;
  hit.push_back(decision.hit());
  result.hits += decision.hit();
  result.blends += decision.verdict() == FrameVerdict::kBlend;
  if (!decision.hit()) {
    reasons.Add((applied.size() > 1 ? decision.entry + ": " : "") + decision.reason,
                fmt::format("frame {} of {}", frame, clip));
  }
  weights.emplace_back();
  for (const FrameDecision& one : verdicts->last()) weights.back().push_back(one.full_weight);
  const double worst = clip_errors.AddFrame(full, *side->evaluator), rms = clip_errors.frame_rms();
  // A blended or full miss keeps the tolerance, too, or it counts
  if ((result.light ? rms : worst) > result.tolerance) ++result.violations;
  result.per_frame.push_back({clip, frame, decision, rms, worst, 0, 0});
  if (worst > result.error_max)
    result.error_max = worst, result.worst_frame = frame, result.worst_clip = clip;
}

void Contender::AddTimes(const std::vector<double>& full_ns) {
  for (std::size_t f = 0; f < full_ns.size(); ++f) {
    const double a = full_ns[f], b = Median(side->frame_ns[f]);
    sums.full_ns += a, sums.accelerated_ns += b;
    BenchResult::Frame& frame = result.per_frame[result.per_frame.size() - full_ns.size() + f];
    frame.full_ms = a / 1e6, frame.accelerated_ms = b / 1e6;
    if (hit[f]) sums.full_hit_ns += a, sums.accelerated_hit_ns += b;
  }
}

// A profiled evaluation is slower: its parts are scaled to the timed one. Rigs of one file have the same
// nodes, so this side's name steps of the full plan, too.
void Contender::AddFullProfile(const Plan& plan, const Profile& profile, double wall, double full_ns) {
  const double scale = full_ns / std::max(1.0, wall);
  std::vector<NodeId> stage_nodes;
  for (const AppliedSubspace& one : applied) {
    for (const AcceleratedPoints& points : one.entry.points) {
      stage_nodes.push_back(points.points.node);
      if (points.colors) continue;
      // Stages that are left out of the plan leave it to those before them
      const std::vector<Stage>& stages = open->rig.scene.meshes[points.mesh].stages;
      for (std::size_t s = 0; s < points.stage; ++s) stage_nodes.push_back(stages[s].node);
    }
  }
  const std::vector<char> skippable = PointStepsAbove(plan, stage_nodes);
  std::set<std::string_view> kept;  // steps of this side that run in every frame
  for (Index s = 0; s < side->plan->steps().size(); ++s) {
    if (side->plan->infos()[s].segment == 0) kept.insert(side->plan->step_name(s));
  }
  double graph = 0, points = 0, steps_ns = 0, kept_steps = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const double ns = static_cast<double>(profile.self_ns()[s]) * scale;
    BenchNode& node = sums.nodes[plan.step_name(s)];
    node.name = plan.step_name(s), node.type = plan.step_type(s);
    node.ms_per_frame += ns;
    node.points = std::max(node.points, plan.infos()[s].points);
    steps_ns += ns;
    if (skippable[s] || !kept.contains(plan.step_name(s))) continue;
    (plan.infos()[s].points_total > 0 ? points : graph) += ns;
    ++kept_steps;
  }
  // What passes between steps is theirs in equal parts
  const double between = std::max(0.0, full_ns - steps_ns);
  sums.bound_points += points;
  sums.bound_graph +=
      graph + between * kept_steps / static_cast<double>(std::max<std::size_t>(1, plan.steps().size()));
  sums.points_full += PointsComputed(plan, profile);
}

void Contender::AddProfile(const Profile& profile, const KpsaTimes& kpsa, double wall, double fast_ns) {
  const Plan& plan = *side->plan;
  const double scale = fast_ns / std::max(1.0, wall);
  std::vector<NodeId> kpsa_nodes;
  for (const AppliedSubspace& one : applied) kpsa_nodes.push_back(one.node);
  const std::vector<char> cue_steps = PointStepsAbove(plan, kpsa_nodes);
  double cues = static_cast<double>(kpsa.cues) * scale, downstream = 0, misses = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    const double ns = static_cast<double>(profile.self_ns()[s]) * scale;
    if (profile.counts()[s] > 0) sums.computed.insert(plan.step_name(s));
    if (std::find(kpsa_nodes.begin(), kpsa_nodes.end(), info.node) != kpsa_nodes.end()) continue;
    if (info.segment != 0) {
      misses += ns;
    } else if (info.points_total > 0) {
      (cue_steps[s] ? cues : downstream) += ns;
    }
  }
  sums.cues += cues, sums.downstream += downstream, sums.misses += misses;
  sums.projection += static_cast<double>(kpsa.projection) * scale;
  sums.reconstruction += static_cast<double>(kpsa.reconstruction) * scale;
  sums.graph += std::max(0.0, fast_ns - cues - downstream - misses -
                                  static_cast<double>(kpsa.projection + kpsa.reconstruction) * scale);
  sums.points_accelerated += PointsComputed(plan, profile);
}

void Contender::Finish() {
  const auto frames = static_cast<double>(std::max<std::size_t>(1, result.frames));
  const auto hits = static_cast<double>(std::max<std::size_t>(1, result.hits));
  const auto ms = [&](double ns) { return ns / frames / 1e6; };
  result.full_ms = ms(sums.full_ns);
  result.accelerated_ms = ms(sums.accelerated_ns);
  result.full_ms_on_hits = sums.full_hit_ns / hits / 1e6;
  result.accelerated_ms_on_hits = sums.accelerated_hit_ns / hits / 1e6;
  result.graph_ms = ms(sums.graph), result.cues_ms = ms(sums.cues),
  result.projection_ms = ms(sums.projection);
  result.reconstruction_ms = ms(sums.reconstruction), result.downstream_ms = ms(sums.downstream),
  result.misses_ms = ms(sums.misses);
  // What is left without cues and reconstruction: as measured, where no miss is among it; else as in the full
  // evaluation, whose points leave colder caches behind
  const bool all_hit = result.hits == result.frames;
  result.bound_graph_ms = all_hit ? result.graph_ms : ms(sums.bound_graph);
  result.bound_points_ms = all_hit ? result.downstream_ms : ms(sums.bound_points);
  result.bound_ms = result.bound_graph_ms + result.bound_points_ms;
  result.points_full = sums.points_full / frames;
  result.points_accelerated = sums.points_accelerated / frames;
  for (auto& [name, node] : sums.nodes) {
    node.ms_per_frame = ms(node.ms_per_frame);
    result.full_nodes.push_back(node);
    if (!sums.computed.contains(name)) result.never_evaluated.push_back(name);
  }
  result.nodes_total = sums.nodes.size();
  std::stable_sort(result.full_nodes.begin(), result.full_nodes.end(),
                   [](const BenchNode& a, const BenchNode& b) { return a.ms_per_frame > b.ms_per_frame; });
  result.most_frequent_reason = reasons.MostFrequent();
  result.error_rms = errors.rms();
  result.error_p99 = errors.Percentile(0.99);
  result.motion_rms = errors.motion_rms();
  result.diagonal = errors.diagonal();
}

class Bench {
 public:
  Bench(const std::vector<AccelerationFlags>& sides, const BenchOptions& options) : options_(options) {
    contenders_.resize(sides.size());
    for (std::size_t i = 0; i < sides.size(); ++i) {
      contenders_[i].flags = sides[i];
      contenders_[i].flags.with_modes = true;  // for SplitFrames
    }
  }

  Status RunClip(const Flags& flags, const std::string& clip, Progress* progress) {
    Flags with_clip = flags;
    if (!clip.empty()) with_clip.clip = clip;
    const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(with_clip);
    if (!open.ok()) return open.status();
    const Rig& rig = (*open)->rig;
    const Result<std::vector<double>> sampled = SampleTimes(with_clip, rig);
    if (!sampled.ok()) return sampled.status();
    const std::vector<double>& times = *sampled;
    Result<std::shared_ptr<const Plan>> full_plan = LoadSides(with_clip, rig, times.size(), false);
    if (!full_plan.ok()) return full_plan.status();
    const bool still = (*full_plan)->steps().empty();
    if (still) full_plan = LoadSides(with_clip, rig, times.size(), true);
    if (!full_plan.ok()) return full_plan.status();
    if ((*full_plan)->steps().empty())
      return Status::Invalid("nothing moves and there are no controls, so there is nothing to time")
          .At({rig.path});
    Side full(rig, *full_plan, options_.threads > 1, times.size(), still);
    std::vector<Side*> sides{&full};
    for (Contender& contender : contenders_) {
      contender.Describe();
      sides.push_back(contender.side.get());
    }
    if (still) {
      contenders_.front().result.notes.push_back(
          "nothing moves: timed is the evaluation of this pose from its controls, all of it every time");
    }
    const auto located = [&](const Status& status, double t) {
      return Status::Evaluation("at {} s: {}", t, status.errors().front().message).At({rig.path});
    };

    // Points
    for (std::size_t f = 0; f < times.size(); ++f) {
      if (Interrupted()) return InterruptedStatus();
      progress->Set(done_++);
      for (Side* side : sides) {
        if (const Status status = side->Evaluate(times[f]); !status.ok()) return located(status, times[f]);
      }
      for (Contender& contender : contenders_)
        contender.Compare(FrameNumber(times[f], rig.fps), *full.evaluator, rig.scene.clip.value_or("(rest)"));
    }
    for (Contender& contender : contenders_) {
      contender.errors.Merge(contender.clip_errors);
      contender.result.frames += times.size();
    }

    // Times. The sides take turns by blocks of frames: each keeps its caches as in playback, and all see the
    // same machine
    for (int run = 0; run < options_.runs; ++run) {
      for (Side* side : sides) side->StartAgain();
      for (std::size_t first = 0, block = 0; first < times.size(); first += kTurnFrames, ++block) {
        const std::size_t end = std::min(first + kTurnFrames, times.size());
        for (std::size_t turn = 0; turn < sides.size(); ++turn) {
          Side* const side = sides[(static_cast<std::size_t>(run) + block + turn) % sides.size()];
          for (std::size_t f = first; f < end; ++f) {
            if (Interrupted()) return InterruptedStatus();
            if (const Status status = side->Timed(f, times[f]); !status.ok())
              return located(status, times[f]);
          }
        }
        for (std::size_t f = first; f < end; ++f) progress->Set(done_++);
      }
    }
    std::vector<double> full_ns;
    for (const auto& runs : full.frame_ns) full_ns.push_back(Median(runs));
    for (Contender& contender : contenders_) contender.AddTimes(full_ns);
    KPSA_RETURN_IF_ERROR(ProfileClip(&full, times, full_ns));
    for (Contender& contender : contenders_) {
      if (!HaveKeptModes(contender.applied)) continue;
      Result<FrameErrors> errors = SplitFrames(with_clip, contender.flags, times, contender.weights);
      if (!errors.ok()) return errors.status();
      contender.result.frame_errors.Append(*errors);
    }
    return Status();
  }

  std::vector<BenchResult> Finish() {
    std::vector<BenchResult> results;
    for (Contender& contender : contenders_) {
      contender.Finish();
      results.push_back(std::move(contender.result));
    }
    return results;
  }

 private:
  // All contenders' rigs and the plan of the full side.
  Result<std::shared_ptr<const Plan>> LoadSides(const Flags& flags, const Rig& rig, std::size_t frames,
                                                bool still) {
    Request outputs;
    for (std::size_t i = 0; i < contenders_.size(); ++i) {
      Request wanted;
      KPSA_RETURN_IF_ERROR(contenders_[i].Load(flags, options_, frames, still, &wanted));
      if (i == 0) outputs = wanted;
      if (outputs.outputs.size() != wanted.outputs.size() ||
          outputs.outputs.front().plug != wanted.outputs.front().plug)
        return Status::Usage("{} and {} accelerate different things, which no common run compares",
                             contenders_[0].applied.front().path, contenders_[i].applied.front().path);
    }
    Compiler compiler;
    return CompileFor(rig, &compiler, outputs);
  }

  // What the time consists of.
  Status ProfileClip(Side* full, const std::vector<double>& times, const std::vector<double>& full_ns) {
    std::vector<Side*> sides{full};
    for (Contender& contender : contenders_) sides.push_back(contender.side.get());
    std::vector<Profile> profiles;
    for (Side* side : sides) {
      profiles.emplace_back(*side->plan);
      side->StartAgain();
    }
    std::vector<double> wall(sides.size(), 0.0);
    std::vector<KpsaTimes> kpsa(sides.size());
    MeasureKpsaTimes(true);
    TakeKpsaTimes();
    Status status;
    for (std::size_t f = 0; f < times.size() && status.ok(); ++f) {
      for (std::size_t i = 0; i < sides.size() && status.ok(); ++i) {
        sides[i]->Forget();
        sides[i]->evaluator->Record(&profiles[i], static_cast<int>(f));
        const std::uint64_t begin = ProfileClock();
        status = sides[i]->Evaluate(times[f]);
        wall[i] += static_cast<double>(ProfileClock() - begin);
        sides[i]->evaluator->Record(nullptr);
        const KpsaTimes taken = TakeKpsaTimes();
        kpsa[i].cues += taken.cues, kpsa[i].projection += taken.projection;
        kpsa[i].reconstruction += taken.reconstruction;
      }
    }
    MeasureKpsaTimes(false);
    KPSA_RETURN_IF_ERROR(std::move(status));
    for (std::size_t i = 0; i < sides.size(); ++i) wall[i] -= RecordingNs(*sides[i]->plan, profiles[i]);
    const double clip_full = std::accumulate(full_ns.begin(), full_ns.end(), 0.0);
    for (std::size_t i = 0; i < contenders_.size(); ++i) {
      double clip_fast = 0;
      for (const auto& runs : contenders_[i].side->frame_ns) clip_fast += Median(runs);
      contenders_[i].AddFullProfile(*full->plan, profiles[0], wall[0], clip_full);
      contenders_[i].AddProfile(profiles[i + 1], kpsa[i + 1], wall[i + 1], clip_fast);
    }
    return Status();
  }

  const BenchOptions& options_;
  std::deque<Contender> contenders_;  // stay where they are: their verdicts refer to them
  std::size_t done_ = 0;
};

}  // namespace

Result<std::vector<BenchResult>> RunBench(const Flags& flags, const std::vector<AccelerationFlags>& sides,
                                          const std::vector<std::string>& clips,
                                          const BenchOptions& options) {
  const ThreadLimit limit(options.threads);
  Bench bench(sides, options);
  Progress progress("bench, frames", 0, options.quiet);
  for (const std::string& clip : clips) KPSA_RETURN_IF_ERROR(bench.RunClip(flags, clip, &progress));
  return bench.Finish();
}

}  // namespace kpsa
