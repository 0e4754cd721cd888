// What each part of the method is worth, at equal numbers of points: which cues are chosen (the paper's rule,
// A-optimal, random), where they lie (output points, an earlier stage, scalars besides), and how they are
// turned into points (least squares, maximum a posteriori). Errors on the rig's test clip in its space, in %
// of the diagonal; beside them the time of measuring the cues alone.
//   bench_ablation [rig.yaml] [sampled poses]        the rig's first accelerate entry; scenes/face/face.yaml,
//   1200
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <random>

#include "cli/rig_training.h"
#include "graph/evaluator.h"
#include "kpsa/estimator.h"
#include "kpsa/mode_choice.h"
#include "kpsa/pose_recorder.h"
#include "kpsa/varimax.h"
#include "nodes/standard_nodes.h"

namespace kpsa {
namespace {

constexpr std::size_t kPointCounts[] = {10, 20, 40, 80};
constexpr int kModes = 200;
constexpr std::size_t kCandidates = 2000, kScalars = 80, kFrameStep = 3;
constexpr unsigned kRandomSeeds = 10;

using Cues = std::vector<CueRef>;

struct Score {
  double rms = 0, max = 0, cue_us = 0;
  std::string note;
};

class Ablation {
 public:
  Status Run(const std::string& path, std::size_t samples) {
    AddStandardNodes(registry_);
    AddKpsaNode(registry_);
    RigOptions rest;
    rest.rest = true;
    Result<kpsa::Rig> loaded = LoadRig(registry_, path, rest);
    if (!loaded.ok()) return loaded.status();
    rig_ = std::move(*loaded);
    if (rig_.accelerate.empty() || rig_.accelerate[0].test_clips.empty())
      return Status::Invalid("expected an accelerate entry with a test clip").At({path});
    KPSA_RETURN_IF_ERROR(Record(samples));
    fmt::print(
        "{}: {} points, {} training poses, {} test frames of {}; motion RMS {:.3f} % of the diagonal of "
        "{:.3f} m; {} modes\n",
        path, pca_.layout.points, training_->poses(), test_->poses(), rig_.accelerate[0].test_clips[0],
        Percent(motion_), diagonal_, pca_.mode_count());
    fmt::print("stage before the last: {}; a point there computes {:.0f} points, an output point {:.0f}\n\n",
               stage_name_, stage_cost_, output_cost_);
    fmt::print("{:<44}{:<6}", "cues", "by");
    for (std::size_t k : kPointCounts) fmt::print("{:>30}", fmt::format("{} points", k));
    fmt::print("\n{:<50}", "");
    for ([[maybe_unused]] std::size_t k : kPointCounts) fmt::print("{:>30}", "RMS %   max %   cues us");
    fmt::print("\n");
    for (const int per_mode : {1, 2}) {
      Row(fmt::format("paper: {} a mode, output points", per_mode), "LS", [&](std::size_t k) {
        return LeastSquares(KeyPoints(k, per_mode), k / static_cast<std::size_t>(per_mode));
      });
    }
    Row("paper: 2 a mode, output points", "MAP", [&](std::size_t k) { return Map(KeyPoints(k, 2)); });
    Row("A-optimal, output points", "LS",
        [&](std::size_t k) { return LeastSquares(Optimal(k, true, false), k / 2); });
    Row("A-optimal, output points", "MAP", [&](std::size_t k) { return Map(Optimal(k, true, false)); });
    Row("A-optimal, points before the last stage", "MAP",
        [&](std::size_t k) { return Map(Optimal(k, false, true)); });
    Row("A-optimal by cost, both sorts of points", "MAP",
        [&](std::size_t k) { return Map(Optimal(k, true, true)); });
    Row(fmt::format("the same and {} scalars", kScalars), "MAP",
        [&](std::size_t k) { return Map(Optimal(k, true, true, Scalars())); });
    Row(fmt::format("points before the last stage, {} scalars", kScalars), "MAP",
        [&](std::size_t k) { return Map(Optimal(k, false, true, Scalars())); });
    Row(fmt::format("{} scalars alone", kScalars), "MAP", [&](std::size_t) { return Map(Scalars()); });
    for (const bool map : {false, true}) {
      Row(fmt::format("random output points, median of {}", kRandomSeeds), map ? "MAP" : "LS",
          [&](std::size_t k) { return RandomPoints(k, map); });
    }
    return Status();
  }

 private:
  double Percent(double length) const { return 100 * length / diagonal_; }

  Status Record(std::size_t samples) {
    const Acceleration entry = rig_.accelerate[0];
    training_rig_ = MakeTrainingRig(&rig_, entry);
    Result<std::vector<TrainingClip>> clips = ClipFrames(rig_, entry.train_clips),
                                      test = ClipFrames(rig_, {entry.test_clips[0]});
    if (!clips.ok()) return clips.status();
    if (!test.ok()) return test.status();
    for (TrainingClip& clip : *clips) {
      for (std::size_t i = 0; kFrameStep * i < clip.times.size(); ++i)
        clip.times[i] = clip.times[kFrameStep * i];
      clip.times.resize((clip.times.size() + kFrameStep - 1) / kFrameStep);
    }
    // Candidates before the last stage of the first mesh, evenly spread; signals under the controls and every
    // clip
    std::vector<CandidateStage> candidates;
    for (const auto& mesh : training_rig_.target.meshes) {
      Request request;
      request.outputs.push_back({mesh.stages.back().points, {}});
      Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(*rig_.graph, request);
      if (!plan.ok()) return plan.status();
      totals_.push_back((*plan)->outputs()[0].points.total());
      if (mesh.stages.size() < 2) continue;
      candidates.push_back(
          {totals_.size() - 1, mesh.stages.size() - 2, EvenSpread(totals_.back(), kCandidates)});
      stage_name_ = mesh.stages[candidates.back().stage].name;
    }
    std::vector<Signal> signals;
    for (int clip = -1; clip < static_cast<int>(clips->size()); ++clip) {
      if (clip >= 0) KPSA_RETURN_IF_ERROR(SetClip(&rig_, (*clips)[static_cast<std::size_t>(clip)].name));
      Result<std::vector<Signal>> found = FindSignals(*rig_.graph, &compiler_, training_rig_.target.outputs(),
                                                      VaryingPlugs(rig_), {}, nullptr);
      if (!found.ok()) return found.status();
      for (Signal& signal : *found) {
        if (std::none_of(signals.begin(), signals.end(),
                         [&](const Signal& s) { return s.name == signal.name; }))
          signals.push_back(std::move(signal));
      }
    }
    KPSA_RETURN_IF_ERROR(SetClip(&rig_, std::nullopt));
    recorder_ =
        std::make_unique<PoseRecorder>(training_rig_, &compiler_, std::move(candidates), std::move(signals));
    Result<PoseLayout> layout = recorder_->Layout();
    if (!layout.ok()) return layout.status();
    training_ = std::make_unique<PoseMatrix>(*layout);
    test_ = std::make_unique<PoseMatrix>(*layout);
    for (const TrainingClip& clip : *clips) KPSA_RETURN_IF_ERROR(recorder_->AddClip(clip, training_.get()));
    Result<ClipPoses> clip_poses = recorder_->ControlsOfClips(*clips);
    if (!clip_poses.ok()) return clip_poses.status();
    KPSA_RETURN_IF_ERROR(recorder_->AddSamples(Sweeps(training_rig_.controls), *clips, training_.get()));
    KPSA_RETURN_IF_ERROR(
        recorder_->AddSamples(SamplePoses(training_rig_.controls, *clip_poses, {}, clips->size(), samples, 1),
                              *clips, training_.get()));
    KPSA_RETURN_IF_ERROR(recorder_->AddClip((*test)[0], test_.get()));
    test_times_ = (*test)[0].times;
    KPSA_RETURN_IF_ERROR(SetClip(&rig_, entry.test_clips[0]));  // the cues are timed on it

    const Eigen::VectorXd mean = training_->Mean();
    training_->Subtract(mean);
    test_->Subtract(mean);
    PcaOptions options;
    options.max_modes = kModes;
    Result<Pca> pca = ComputePca(*training_, mean, options);
    if (!pca.ok()) return pca.status();
    pca_ = std::move(*pca);
    Double3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
    for (std::size_t i = 0; i < layout->points + layout->stage_points; ++i) {
      const auto at = static_cast<Eigen::Index>(3 * i);
      positions_.push_back({mean[at], mean[at + 1], mean[at + 2]});
      for (int a = 0; a < 3 && i < layout->points; ++a)
        lo[a] = std::min(lo[a], positions_[i][a]), hi[a] = std::max(hi[a], positions_[i][a]);
    }
    diagonal_ = Length(hi - lo);
    double energy = 0;
    for (std::size_t t = 0; t < test_->poses(); ++t) {
      for (std::size_t c = 0; c < layout->outputs(); ++c)
        energy += double{test_->row(t)[c]} * test_->row(t)[c];
    }
    motion_ = std::sqrt(energy / static_cast<double>(test_->poses() * layout->points));
    stage_cost_ = PointsComputed({{CueKind::kStage, static_cast<Index>(layout->stage_points / 2)}});
    output_cost_ = PointsComputed({{CueKind::kOutput, static_cast<Index>(layout->points / 2)}});
    return Status();
  }

  // --- Cues

  Cues KeyPoints(std::size_t count, int per_mode) const {
    Eigen::MatrixXd rotated = TruncatedPca(pca_, static_cast<Eigen::Index>(count) / per_mode).output_modes();
    Varimax({}, 3, &rotated);
    return SelectKeyPoints(rotated, 3, positions_, per_mode, 0.05 * diagonal_);
  }
  // A-optimal points besides what is fixed. Of two sorts they are weighed by the points that each has to
  // compute.
  Cues Optimal(std::size_t count, bool outputs, bool stages, const Cues& fixed = {}) const {
    CueSelectionOptions options;
    options.fixed = fixed;
    options.count = fixed.size() + count;
    options.swap_passes = 0;
    if (outputs && stages) {
      options.marginal_cost = [this](CueRef cue, std::span<const CueRef>) {
        return cue.kind == CueKind::kOutput ? output_cost_ : stage_cost_;
      };
    }
    return SelectCues(pca_, AllCandidates(pca_, 1e-3, outputs, stages, false), positions_, diagonal_, options)
        .cues;
  }
  const Cues& Scalars() {
    if (scalars_.empty()) {
      CueSelectionOptions options;
      options.count = kScalars;
      options.swap_passes = 0;
      scalars_ =
          SelectCues(pca_, AllCandidates(pca_, 1e-3, false, false, true), positions_, diagonal_, options)
              .cues;
    }
    return scalars_;
  }

  // --- Scores

  Score Map(const Cues& cues) {
    const CueSet set = MakeCueSet(pca_, cues, diagonal_);
    return Judge(pca_, set, MapEstimator(pca_, set), cues);
  }
  Score LeastSquares(const Cues& cues, std::size_t modes) {
    const Pca pca = TruncatedPca(pca_, static_cast<Eigen::Index>(modes));
    const CueSet set = MakeCueSet(pca, cues, diagonal_);
    return Judge(pca, set, LeastSquaresEstimator(pca, set), cues);
  }
  Score Judge(const Pca& pca, const CueSet& set, const Estimator& estimator, const Cues& cues) {
    const std::vector<PoseErrors> errors = EstimateErrors(pca, set, estimator, *test_);
    Score score;
    score.rms = RmsError(errors, pca.layout.points);
    for (const PoseErrors& error : errors) score.max = std::max(score.max, error.largest);
    score.cue_us = Microseconds(cues);
    if (!estimator.warning.empty()) score.note = "*";  // fell back to MAP
    return score;
  }
  Score RandomPoints(std::size_t count, bool map) {
    std::vector<Score> scores;
    for (unsigned seed = 1; seed <= kRandomSeeds; ++seed) {
      std::mt19937 random(seed);
      Cues cues;
      while (cues.size() < count) {
        const CueRef cue{CueKind::kOutput, static_cast<Index>(random() % pca_.layout.points)};
        if (std::find(cues.begin(), cues.end(), cue) == cues.end()) cues.push_back(cue);
      }
      scores.push_back(map ? Map(cues) : LeastSquares(cues, count / 2));
    }
    std::sort(scores.begin(), scores.end(), [](const Score& a, const Score& b) { return a.rms < b.rms; });
    return scores[kRandomSeeds / 2];
  }

  // The plan that computes the cues and nothing else.
  std::shared_ptr<const Plan> CuePlan(const Cues& cues) {
    Request request;
    request.varying = {rig_.scene.time};
    const auto& target = training_rig_.target;
    // The cues of a kind with indices from `begin` on, as numbers from 0
    const auto among = [&](CueKind kind, std::size_t begin, std::size_t count) {
      std::vector<Index> found;
      for (const CueRef& cue : cues) {
        if (cue.kind == kind && cue.index >= begin && cue.index < begin + count)
          found.push_back(static_cast<Index>(cue.index - begin));
      }
      std::sort(found.begin(), found.end());
      return found;
    };
    std::size_t begin = 0;
    for (std::size_t m = 0; m < target.meshes.size(); begin += totals_[m++]) {
      const std::vector<Index> outputs = among(CueKind::kOutput, begin, totals_[m]);
      if (!outputs.empty())
        request.outputs.push_back({target.meshes[m].stages.back().points, PointSet::Of(outputs, totals_[m])});
    }
    begin = 0;
    for (const CandidateStage& candidate : recorder_->candidates()) {
      std::vector<Index> stage = among(CueKind::kStage, begin, candidate.points.size());
      begin += candidate.points.size();
      for (Index& point : stage) point = candidate.points[point];
      if (!stage.empty())
        request.outputs.push_back({target.meshes[candidate.mesh].stages[candidate.stage].points,
                                   PointSet::Of(stage, totals_[candidate.mesh])});
    }
    const std::vector<Index> first = FirstScalars(recorder_->signals(), recorder_->layout());
    for (const Signal& signal : recorder_->signals()) {
      const Index column = first[static_cast<std::size_t>(&signal - recorder_->signals().data())];
      const bool wanted = std::any_of(cues.begin(), cues.end(), [&](const CueRef& cue) {
        return cue.kind == CueKind::kScalar && cue.index >= column && cue.index < column + signal.entries();
      });
      if (wanted) request.outputs.push_back({signal.plug, {}});
    }
    Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(*rig_.graph, request);
    return plan.ok() ? *plan : nullptr;
  }
  double PointsComputed(const Cues& cues) {
    double points = 0;
    const std::shared_ptr<const Plan> plan = CuePlan(cues);
    for (const Plan::StepInfo& info : plan->infos()) points += info.points;
    return points;
  }
  // Median over the frames of the test clip.
  double Microseconds(const Cues& cues) {
    using Clock = std::chrono::steady_clock;
    const std::shared_ptr<const Plan> plan = CuePlan(cues);
    if (plan == nullptr) return 0;
    Evaluator evaluator(plan);
    const Index time = plan->FindVarying(rig_.scene.time);
    std::vector<double> us;
    for (int pass = 0; pass < 2; ++pass) {
      for (const double t : test_times_) {
        if (time != kNoIndex) evaluator.Set(time, t);
        const auto begin = Clock::now();
        if (!evaluator.Evaluate().ok()) return 0;
        if (pass > 0) us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
      }
    }
    std::nth_element(us.begin(), us.begin() + static_cast<std::ptrdiff_t>(us.size() / 2), us.end());
    return us[us.size() / 2];
  }

  void Row(const std::string& cues, const char* estimator, const std::function<Score(std::size_t)>& score) {
    fmt::print("{:<44}{:<6}", cues, estimator);
    for (const std::size_t k : kPointCounts) {
      const Score s = score(k);
      fmt::print("{:>30}", fmt::format("{:.4f}  {:>6.3f}  {:>7.1f}{:1}", Percent(s.rms), Percent(s.max),
                                       s.cue_us, s.note));
      std::fflush(stdout);
    }
    fmt::print("\n");
  }

  NodeRegistry registry_;
  kpsa::Rig rig_;
  TrainingRig training_rig_;
  Compiler compiler_;
  std::unique_ptr<PoseRecorder> recorder_;
  std::unique_ptr<PoseMatrix> training_, test_;
  std::vector<double> test_times_;
  std::vector<Index> totals_;
  std::vector<Double3> positions_;
  std::string stage_name_ = "none";
  Pca pca_;
  Cues scalars_;
  double diagonal_ = 0, motion_ = 0, stage_cost_ = 1, output_cost_ = 1;
};

}  // namespace
}  // namespace kpsa

int main(int argc, char** argv) {
  kpsa::Ablation ablation;
  const int samples = argc > 2 ? std::clamp(std::atoi(argv[2]), 0, 100000) : 1200;
  const kpsa::Status status =
      ablation.Run(argc > 1 ? argv[1] : "scenes/face/face.yaml", static_cast<std::size_t>(samples));
  if (!status.ok()) fmt::print(stderr, "{}\n", status.ToString());
  return status.ok() ? 0 : 3;
}
