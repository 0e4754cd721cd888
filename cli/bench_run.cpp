#include "cli/bench_run.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <numeric>
#include <set>

#include "base/parallel.h"
#include "cli/bench_side.h"
#include "cli/bench_tolerances.h"
#include "cli/frames_range.h"
#include "cli/progress.h"
#include "cli/rig_frames.h"
#include "host/bench/point_errors.h"
#include "host/rig_training.h"
#include "kpsa/accelerate.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

// Sums over clips; divided by frames at the end.
struct Sums {
  double full_ns = 0, accelerated_ns = 0, full_hit_ns = 0, accelerated_hit_ns = 0;
  double graph = 0, cues = 0, projection = 0, reconstruction = 0, downstream = 0, misses = 0, bound_graph = 0,
         bound_points = 0;
  double points_full = 0, points_accelerated = 0;
  double parts = 0;                                     // as recorded
  std::vector<double> full_run_ns, accelerated_run_ns;  // by run
  double full_wall = 0, full_cpu = 0, wall = 0, cpu = 0;
  std::map<std::string, BenchNode> nodes;
  std::set<std::string> computed;
};

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
  FullWeights weights;
  BenchTolerances tolerances;

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
    weights.clear();
    return tolerances.Load(clip_flags, {&flags, &applied, &request, compared}, options.threads > 1, frames,
                           still);
  }
  void Describe();
  void Compare(std::int64_t frame, const Evaluator& full, const std::string& clip);
  void NoteClip(const std::string& clip, bool still);
  void AddTimes(const FrameTimes& full);
  void AddFullProfile(const Plan& plan, const RecordedSteps& recorded, double full_ns);
  void AddProfile(const RecordedSteps& recorded, double fast_ns);
  void Finish(const BenchOptions& options);
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
  result.light = applied.front().subspace->of_light();
  result.promise.Make(applied);
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
      const bool scalar = cue.kind != CueDescription::Kind::kPoint;
      ++stages[cue.kind == CueDescription::Kind::kProduct ? "products of scalars"
               : scalar                                   ? "scalars"
                                                          : "points of " + CueName(*one.subspace, cue)];
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
  result.hits += decision.hit();
  result.blends += decision.verdict() == FrameVerdict::kBlend;
  if (!decision.hit()) {
    reasons.Add((applied.size() > 1 ? decision.entry + ": " : "") + decision.reason,
                fmt::format("frame {} of {}", frame, clip));
  }
  weights.emplace_back();
  for (const FrameDecision& one : verdicts->last()) weights.back().push_back(one.full_weight);
  const double worst = clip_errors.AddFrame(full, *side->evaluator), rms = clip_errors.frame_rms();
  const bool accepted = std::any_of(weights.back().begin(), weights.back().end(),
                                    [](double full_weight) { return full_weight < 1; });
  result.promise.Add(clip, frame, decision.hit(), accepted, result.light ? rms : worst);
  result.per_frame.push_back({clip, frame, decision, rms, worst, 0, 0});
  if (worst > result.error_max)
    result.error_max = worst, result.worst_frame = frame, result.worst_clip = clip;
}

// What makes the frames of a clip say little.
void Contender::NoteClip(const std::string& clip, bool still) {
  constexpr double kMotion = 1e-6;  // of the diagonal: rounding
  if (!still && side->times.ns().size() > 1 && clip_errors.motion_rms() <= kMotion * clip_errors.diagonal())
    result.notes.push_back(fmt::format("nothing moves in {}: its errors are those of one pose", clip));
  // A clip of several rigs is called "a:wave + b:wave"
  for (std::size_t begin = 0; begin < clip.size();) {
    const std::size_t end = std::min(clip.find(" + ", begin), clip.size());
    const std::string part = clip.substr(begin, end - begin);
    begin = end + 3;
    for (const AppliedSubspace& one : applied) {
      const std::vector<std::string> trained = ParseTraining(one.subspace->training).clips;
      if (std::find(trained.begin(), trained.end(), MakeTarget(open->rig, one.entry).within.Inner(part)) ==
          trained.end())
        continue;
      result.notes.push_back(fmt::format("{} was trained on: its errors say nothing about new frames", part));
      break;
    }
  }
}

void Contender::AddTimes(const FrameTimes& full) {
  const auto add_runs = [](const std::vector<std::vector<double>>& frames, std::vector<double>* runs) {
    for (const std::vector<double>& frame : frames) {
      runs->resize(std::max(runs->size(), frame.size()));
      for (std::size_t run = 0; run < frame.size(); ++run) (*runs)[run] += frame[run];
    }
  };
  add_runs(full.ns(), &sums.full_run_ns);
  add_runs(side->times.ns(), &sums.accelerated_run_ns);
  sums.full_wall += full.wall_ns(), sums.full_cpu += full.cpu_ns();
  sums.wall += side->times.wall_ns(), sums.cpu += side->times.cpu_ns();
  const std::size_t frames = full.ns().size();
  for (std::size_t f = 0; f < frames; ++f) {
    const double a = Median(full.ns()[f]), b = Median(side->times.ns()[f]);
    sums.full_ns += a, sums.accelerated_ns += b;
    BenchResult::Frame& frame = result.per_frame[result.per_frame.size() - frames + f];
    frame.full_ms = a / 1e6, frame.accelerated_ms = b / 1e6;
    if (frame.decision.hit()) sums.full_hit_ns += a, sums.accelerated_hit_ns += b;
  }
}

// A profiled evaluation is slower: its parts are scaled to the timed one. Rigs of one file have the same
// nodes, so this side's name steps of the full plan, too.
void Contender::AddFullProfile(const Plan& plan, const RecordedSteps& recorded, double full_ns) {
  const double scale =
      full_ns / std::max({1.0, recorded.wall_ns,
                          std::accumulate(recorded.self_ns.begin(), recorded.self_ns.end(), 0.0)});
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
    const double ns = recorded.self_ns[s] * scale;
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
  sums.points_full += PointsComputed(plan, recorded);
}

void Contender::AddProfile(const RecordedSteps& recorded, double fast_ns) {
  const Plan& plan = *side->plan;
  std::vector<NodeId> kpsa_nodes;
  for (const AppliedSubspace& one : applied) kpsa_nodes.push_back(one.node);
  const std::vector<char> cue_steps = PointStepsAbove(plan, kpsa_nodes);
  double cues = static_cast<double>(recorded.kpsa.cues), downstream = 0, misses = 0;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    if (recorded.counts[s] > 0) sums.computed.insert(plan.step_name(s));
    if (std::find(kpsa_nodes.begin(), kpsa_nodes.end(), info.node) != kpsa_nodes.end()) continue;
    if (info.segment != 0) {
      misses += recorded.self_ns[s];
    } else if (info.points_total > 0) {
      (cue_steps[s] ? cues : downstream) += recorded.self_ns[s];
    }
  }
  const auto projection = static_cast<double>(recorded.kpsa.projection),
             reconstruction = static_cast<double>(recorded.kpsa.reconstruction);
  // The graph is what the other parts leave; where these are more than all of it, as recording them costs
  // time, they share it as they are
  const double parts = cues + projection + reconstruction + downstream + misses,
               all = std::max({1.0, recorded.wall_ns, parts}), scale = fast_ns / all;
  sums.parts += fast_ns * all / std::max(1.0, recorded.wall_ns);
  sums.cues += cues * scale, sums.downstream += downstream * scale, sums.misses += misses * scale;
  sums.projection += projection * scale, sums.reconstruction += reconstruction * scale;
  sums.graph += (all - parts) * scale;
  sums.points_accelerated += PointsComputed(plan, recorded);
}

// The least and the most of the runs, and of what is told of all of them.
BenchResult::Range RangeOf(const std::vector<double>& runs, double factor, double told) {
  BenchResult::Range range{told, told};
  for (double run : runs)
    range.least = std::min(range.least, run * factor), range.most = std::max(range.most, run * factor);
  return range;
}

// What is odd about the times.
void NoteTimes(BenchResult* result) {
  constexpr double kOdd = 1.1, kExceeds = 1.02;
  if (result->wall_over_cpu > kOdd) {
    result->notes.push_back(
        fmt::format("the clock ran {:.3g} times as long as the program worked (something else runs, too): "
                    "times are those of its work",
                    result->wall_over_cpu));
  }
  if (result->parts_ms > kExceeds * result->accelerated_ms) {
    result->notes.push_back(fmt::format(
        "parts sum to {:.3f} ms of {:.3f} ms: recording costs {:.0f} %; they are shown as shares of the "
        "total",
        result->parts_ms, result->accelerated_ms, 100 * (result->parts_ms / result->accelerated_ms - 1)));
  }
}

void Contender::Finish(const BenchOptions& options) {
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
  result.parts_ms = ms(sums.parts);
  std::vector<double> ratios;
  for (std::size_t run = 0; run < sums.full_run_ns.size(); ++run)
    ratios.push_back(Ratio(sums.full_run_ns[run], sums.accelerated_run_ns[run]));
  result.full_range = RangeOf(sums.full_run_ns, 1 / frames / 1e6, result.full_ms);
  result.accelerated_range = RangeOf(sums.accelerated_run_ns, 1 / frames / 1e6, result.accelerated_ms);
  result.speedup_range = RangeOf(ratios, 1, result.speedup());
  if (sums.full_cpu > 0 && sums.cpu > 0) {
    result.cpu_times = true;
    result.wall_over_cpu = std::max(sums.full_wall / sums.full_cpu, sums.wall / sums.cpu);
  }
  NoteTimes(&result);
  result.most_frequent_reason = reasons.MostFrequent();
  result.error_rms = errors.rms();
  result.error_p99 = errors.Percentile(0.99);
  result.motion_rms = errors.motion_rms();
  result.diagonal = errors.diagonal();
  result.tolerances =
      tolerances.Table(result.full_ms, result.accelerated_ms_on_hits, result.accelerated_ms, options.speedup);
}

class Bench {
 public:
  Bench(const std::vector<AccelerationFlags>& sides, const BenchOptions& options)
      : options_(options), reference_(options.reference, options.rival) {
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
    const Result<std::vector<double>> sampled = SampleTimes(with_clip, **open);
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
    KPSA_RETURN_IF_ERROR(reference_.Load(with_clip, **full_plan, options_.threads > 1, times.size(), still));
    if (still) {
      contenders_.front().result.notes.push_back(
          "nothing moves: timed is the evaluation of this pose from its controls, all of it every time");
    }
    // Points
    for (std::size_t f = 0; f < times.size(); ++f) {
      if (Interrupted()) return InterruptedStatus();
      progress->Set(done_++);
      for (Side* side : sides) {
        if (Status status = side->Evaluate(times[f]); !status.ok()) return std::move(status).At({rig.path});
      }
      const std::int64_t number = FrameNumber(times[f], rig.fps);
      for (Contender& contender : contenders_) {
        contender.Compare(number, *full.evaluator, rig.scene.clip.value_or("(rest)"));
        KPSA_RETURN_IF_ERROR(contender.tolerances.AddFrame(times[f], number, *full.evaluator).At({rig.path}));
      }
      KPSA_RETURN_IF_ERROR(reference_.AddFrame(times[f], sides).At({rig.path}));
    }
    for (Contender& contender : contenders_) {
      contender.NoteClip(rig.scene.clip.value_or("(rest)"), still);
      contender.errors.Merge(contender.clip_errors);
      contender.result.frames += times.size();
    }

    // Times. The sides take turns by blocks of frames: each keeps its caches as in playback, and all see the
    // same machine
    std::vector<Side*> timed = sides;
    if (reference_.rival() != nullptr) timed.push_back(reference_.rival());
    for (int run = 0; run < options_.runs; ++run) {
      for (Side* side : timed) side->StartAgain();
      for (std::size_t first = 0, block = 0; first < times.size(); first += kTurnFrames, ++block) {
        const std::size_t end = std::min(first + kTurnFrames, times.size());
        for (std::size_t turn = 0; turn < timed.size(); ++turn) {
          Side* const side = timed[(static_cast<std::size_t>(run) + block + turn) % timed.size()];
          if (Status status = side->Turn(times, first, end); !status.ok())
            return std::move(status).At({rig.path});
        }
        for (std::size_t f = first; f < end; ++f) progress->Set(done_++);
      }
    }
    for (Side* side : timed) side->times.Finish();
    reference_.AddTimes();
    for (Contender& contender : contenders_) {
      contender.AddTimes(full.times);
      if (contender.verdicts->hits() == 0)
        KPSA_RETURN_IF_ERROR(contender.tolerances.TimeHits(times).At({rig.path}));
    }
    KPSA_RETURN_IF_ERROR(ProfileClip(sides, times));
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
      contender.Finish(options_);
      contender.result.reference =
          reference_.Table(results.size(), contender.result.full_ms, contender.result.accelerated_ms);
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

  // What the time consists of. The full side comes first.
  Status ProfileClip(const std::vector<Side*>& sides, const std::vector<double>& times) {
    std::vector<RecordedSteps> recorded(sides.size());
    for (Side* side : sides) side->StartAgain();
    Status status;
    for (std::size_t first = 0; first < times.size() && status.ok(); first += kTurnFrames) {
      const std::size_t end = std::min(first + kTurnFrames, times.size());
      for (std::size_t i = 0; i < sides.size() && status.ok(); ++i)
        status = sides[i]->RecordTurn(times, first, end, &recorded[i]);
    }
    KPSA_RETURN_IF_ERROR(std::move(status));
    const auto sum = [](const FrameTimes& frames) {
      double ns = 0;
      for (const std::vector<double>& runs : frames.ns()) ns += Median(runs);
      return ns;
    };
    for (std::size_t i = 0; i < contenders_.size(); ++i) {
      contenders_[i].AddFullProfile(*sides[0]->plan, recorded[0], sum(sides[0]->times));
      contenders_[i].AddProfile(recorded[i + 1], sum(sides[i + 1]->times));
    }
    return Status();
  }

  const BenchOptions& options_;
  BenchReference reference_;
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

}  // namespace kpsa::engine
