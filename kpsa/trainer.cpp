#include "kpsa/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/check.h"
#include "kpsa/control_groups.h"
#include "kpsa/cue_choice.h"
#include "kpsa/cue_places.h"
#include "kpsa/mode_choice.h"
#include "kpsa/pca.h"
#include "kpsa/pose_recorder.h"

namespace kpsa {
namespace {

constexpr double kTileShare = 0.05;    // of the tolerance: RMS error that tiles and bytes may add
constexpr double kTileMaxShare = 0.6;  // of the tolerance: the largest error that they may add
// Of what the modes leave out (RMS): where few of them leave out more than the tolerance asks of tiles, finer
// ones would buy nothing. Of light that is noise, which nobody wants.
constexpr double kTileRest = 0.25;
constexpr double kStillTurn =
    5e-4;  // a turn (radians) and a shift (of the tolerance) of a joint that are none
constexpr double kStillShare = 0.1;
constexpr double kNoiseTurn = 1e-4;   // what a cue is not trusted below: a turn of a joint,
constexpr double kNoiseShare = 5e-3;  // and a shift of a joint or a point, of the tolerance
constexpr double kLightShift = 1e-4;  // metres; where the tolerance is no length: both, of a joint
constexpr int kMaxLightModes = 120;   // that are looked at; noise is beyond
constexpr std::size_t kJudges = 300;  // new poses that compare places for cues

class Trainer {
 public:
  Trainer(const TrainingRig& rig, const std::vector<TrainingClip>& clips, const TrainOptions& options)
      : rig_(rig), clips_(clips), options_(options) {}

  Result<Subspace> Run() {
    const auto begin = std::chrono::steady_clock::now();
    record_.seed = options_.seed;
    record_.mode = options_.mode == EstimatorMode::kMap ? "map" : "paper";
    for (const TrainingClip& clip : clips_) record_.clips.push_back(clip.name);
    KPSA_RETURN_IF_ERROR(Prepare());
    PoseMatrix poses(layout_), held_out(layout_), judges(layout_);
    KPSA_RETURN_IF_ERROR(RecordPoses(&poses, &held_out, &judges));
    KPSA_RETURN_IF_ERROR(Say("modes", 0.45));
    KPSA_RETURN_IF_ERROR(FindRanges(poses));
    if (of_light() && options_.mode == EstimatorMode::kMap) Split(&poses, &judges);
    KPSA_RETURN_IF_ERROR(FindModes(&poses));
    if (judges.poses() > 0) judges.Subtract(pca_.mean);
    if (of_light() && judges.poses() > 0) TruncateModes(judges);
    KPSA_RETURN_IF_ERROR(Say("cues", 0.7));
    KPSA_RETURN_IF_ERROR(ChooseCues(poses, judges));
    KPSA_RETURN_IF_ERROR(Say("subspace", 0.85));
    Result<Subspace> subspace = Assemble(poses);
    if (!subspace.ok()) return subspace;
    KPSA_RETURN_IF_ERROR(Say("calibration", 0.95));
    Judge(held_out, &*subspace);
    KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
    record_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    record_.signature =
        RigSignature(*rig_.graph, rig_.target.outputs(), rig_.target.space, rig_.target.controls);
    subspace->rig_hash = SignatureDigest(record_.signature);
    subspace->training = TrainingJson(record_);
    KPSA_RETURN_IF_ERROR(ValidateSubspace(*subspace));
    return subspace;
  }

 private:
  Status Say(const char* what, double share) {
    if (options_.progress && !options_.progress(what, share))
      return Status::Make(ErrorKind::kInterrupted, "interrupted");
    return Status();
  }

  Status Prepare() {
    KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
    std::vector<Index> totals;
    for (const auto& mesh : rig_.target.meshes) {
      Request request;
      request.outputs.push_back({mesh.stages.back().points, {}});
      Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(*rig_.graph, request);
      if (!plan.ok()) return plan.status();
      totals.push_back((*plan)->outputs()[0].points.total());
    }
    std::vector<CandidateStage> candidates;
    if (options_.mode == EstimatorMode::kMap) {  // the paper's key points are output points
      Result<CuePlaces> places = FindCuePlaces(rig_, &compiler_, totals);
      if (!places.ok()) return places.status();
      candidates = std::move(places->stages);
      places_ = std::move(places->places);
      full_cost_ = places->full_cost;
    }

    // Signals: under the controls, and under each clip
    std::vector<Signal> signals;
    for (int clip = -1; clip < static_cast<int>(clips_.size()); ++clip) {
      if (clip >= 0) KPSA_RETURN_IF_ERROR(rig_.set_clip(clips_[static_cast<std::size_t>(clip)].name));
      std::vector<PlugRef> varying{rig_.time};
      for (const ControlRange& control : rig_.controls) {
        if (clip < 0 || !control.by_clip) varying.push_back(control.plug);
      }
      Result<std::vector<Signal>> found =
          FindSignals(*rig_.graph, &compiler_, rig_.target.outputs(), varying, nullptr, nullptr);
      if (!found.ok()) return found.status();
      for (Signal& signal : *found) {
        const bool known = std::any_of(signals.begin(), signals.end(),
                                       [&](const Signal& s) { return s.name == signal.name; });
        if (!known) signals.push_back(std::move(signal));
      }
    }
    std::sort(signals.begin(), signals.end(),
              [](const Signal& a, const Signal& b) { return a.name < b.name; });
    KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
    recorder_ = std::make_unique<PoseRecorder>(rig_, &compiler_, std::move(candidates), std::move(signals));
    Result<PoseLayout> layout = recorder_->Layout();
    if (!layout.ok()) return layout.status();
    layout_ = *layout;
    totals_ = totals;
    return Status();
  }

  // To train on, to calibrate with, and, where cues have places to choose from, to judge these by.
  Status RecordPoses(PoseMatrix* poses, PoseMatrix* held_out, PoseMatrix* judges) {
    for (std::size_t c = 0; c < clips_.size(); ++c) {
      KPSA_RETURN_IF_ERROR(Say("poses", 0.2 * static_cast<double>(c) / static_cast<double>(clips_.size())));
      KPSA_RETURN_IF_ERROR(recorder_->AddClip(clips_[c], poses));
    }
    record_.clip_poses = poses->poses();
    const Result<ClipPoses> clip_poses = recorder_->ControlsOfClips(clips_);
    if (!clip_poses.ok()) return clip_poses.status();
    KPSA_RETURN_IF_ERROR(Say("poses", 0.2));
    ControlGroups groups;
    if (options_.samples > 0) {
      const std::size_t first = poses->poses();
      KPSA_RETURN_IF_ERROR(recorder_->AddSamples(Sweeps(rig_.controls), clips_, poses));
      groups = FindGroups(*poses, first);
    }
    const auto sample = [&](std::size_t count, std::uint64_t seed, PoseMatrix* to) {
      return recorder_->AddSamples(
          SamplePoses(rig_.controls, *clip_poses, groups, clips_.size(), count, seed), clips_, to);
    };
    KPSA_RETURN_IF_ERROR(sample(options_.samples, options_.seed, poses));
    record_.sampled_poses = poses->poses() - record_.clip_poses;
    if (poses->poses() < 3)
      return Status::Invalid("{} training poses are too few: name clips or samples to train on",
                             poses->poses());
    KPSA_RETURN_IF_ERROR(Say("poses", 0.4));
    std::size_t calibration = options_.calibration_poses;
    if (calibration == 0)
      calibration =
          static_cast<std::size_t>(std::clamp(4.0 / std::max(options_.violation_rate, 1e-4), 400.0, 1000.0));
    KPSA_RETURN_IF_ERROR(sample(calibration, options_.seed ^ 0x5deece66dull, held_out));
    if (places_.size() > 1)
      KPSA_RETURN_IF_ERROR(sample(kJudges, options_.seed ^ 0x2545f4914f6cdd1dull, judges));
    record_.calibration_poses = held_out->poses();
    return Status();
  }

  // Which controls move the same points, from the sweeps: rows [first, first + 2 controls) of the poses. What
  // moves a point by a good part of what it moves any point acts there.
  ControlGroups FindGroups(const PoseMatrix& poses, std::size_t first) const {
    return FindControlGroups(poses, first, rig_.controls.size());
  }

  Status FindRanges(const PoseMatrix& poses) {
    std::size_t column = layout_.scalar_begin();
    for (const Signal& signal : recorder_->signals()) {
      for (std::size_t e = 0; e < signal.entries(); ++e, ++column) {
        double lo = poses.row(0)[column], hi = lo;
        for (std::size_t t = 0; t < poses.poses(); ++t) {
          lo = std::min<double>(lo, poses.row(t)[column]);
          hi = std::max<double>(hi, poses.row(t)[column]);
        }
        // Clips turn joints a little about axes that no control has: what moves no point noticeably is no new
        // pose
        const double still = !signal.matrix ? 0
                             : e < 9        ? kStillTurn
                             : of_light()   ? kLightShift
                                            : kStillShare * options_.tolerance;
        ranges_.push_back(
            MakeTrainedRange(EntryName(signal, e), lo - still, hi + still, options_.range_margin));
      }
    }
    return Status();
  }

  bool of_light() const { return rig_.target.colors; }

  // Takes every fifth pose away.
  void Split(PoseMatrix* poses, PoseMatrix* judges) const {
    PoseMatrix kept(layout_);
    for (std::size_t t = 0; t < poses->poses(); ++t) {
      const std::span<const float> row = std::as_const(*poses).row(t);
      std::copy(row.begin(), row.end(), (t % 5 == 4 ? *judges : kept).AddPose().begin());
    }
    *poses = std::move(kept);
  }

  // As many modes as new poses confirm, and noise as new poses have it.
  void TruncateModes(const PoseMatrix& judges) {
    std::vector<CueRef> cues;
    for (const Index point : GoldenSpread(layout_.points, std::max<std::size_t>(options_.min_points, 100)))
      cues.push_back({CueKind::kOutput, point});
    for (Index s = 0; s < layout_.scalars; ++s) cues.push_back({CueKind::kScalar, s});
    pca_ = TruncatedPca(pca_, ChooseModeCount(pca_, cues, noise_, judges));
    for (double& residual : pca_.row_residual)
      residual = HonestResidual(residual, pca_.poses, pca_.mode_count());
  }

  Status FindModes(PoseMatrix* poses) {
    const Eigen::VectorXd mean = poses->Mean();
    // The model's size, from the mean shape
    Double3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
    for (std::size_t i = 0; i < layout_.points + layout_.stage_points; ++i) {
      const auto at = static_cast<Eigen::Index>(3 * i);
      positions_.push_back({mean[at], mean[at + 1], mean[at + 2]});
      if (i >= layout_.points) continue;
      for (int a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], positions_.back()[a]);
        hi[a] = std::max(hi[a], positions_.back()[a]);
      }
    }
    diagonal_ = Length(hi - lo);
    poses->Subtract(mean);
    PcaOptions pca_options;
    pca_options.max_modes = options_.mode == EstimatorMode::kPaper ? static_cast<int>(options_.key_points / 2)
                                                                   : options_.max_modes;
    pca_options.seed = options_.seed;
    if (of_light()) pca_options.max_modes = std::min(pca_options.max_modes, kMaxLightModes);
    Result<Pca> pca = ComputePca(*poses, mean, pca_options);
    if (!pca.ok()) return pca.status();
    pca_ = std::move(*pca);
    noise_ = MakeNoise();
    record_.diagonal = diagonal_;
    record_.motion_rms = std::sqrt(pca_.total_energy / static_cast<double>(poses->poses() * layout_.points));
    return Status();
  }

  CueNoise MakeNoise() const {
    CueNoise noise(diagonal_);
    const double shift = kNoiseShare * options_.tolerance;
    noise.point = std::max(noise.point, shift * shift);
    for (const Signal& signal : recorder_->signals()) {
      for (std::size_t e = 0; e < signal.entries(); ++e) {
        const double still = !signal.matrix ? 0 : e < 9 ? kNoiseTurn : of_light() ? kLightShift : shift;
        noise.scalars.push_back(still * still);
      }
    }
    return noise;
  }

  Status ChooseCues(const PoseMatrix& poses, const PoseMatrix& judges) {
    CueChoiceOptions choice;
    choice.rows = options_.rows;
    choice.min_points = options_.min_points;
    choice.tolerance = options_.tolerance;
    choice.by_rms = of_light();
    choice.places = places_;
    choice.judges = judges.poses() > 0 ? &judges : nullptr;
    KPSA_RETURN_IF_ERROR(rig_.set_clip(std::nullopt));
    Status priced;
    choice.points_cost = [&](std::span<const CueRef> cues) {
      const Result<double> cost = CostOfPoints(rig_, &compiler_, totals_, recorder_->candidates(), cues);
      if (!cost.ok()) priced = cost.status();
      return cost.ok() ? *cost : 0;
    };
    choice.miss_cost = full_cost_;
    choice.violation_rate = options_.violation_rate;
    if (of_light()) choice.max_outputs = options_.max_light_candidates;
    const std::vector<CueRef> chosen = options_.mode == EstimatorMode::kPaper
                                           ? ChoosePaperCues(pca_, positions_, diagonal_)
                                           : kpsa::ChooseCues(pca_, positions_, noise_, poses, choice);
    KPSA_RETURN_IF_ERROR(std::move(priced));
    if (chosen.empty()) return Status::Invalid("nothing moves in the training poses: no cue can be chosen");
    cues_ = MakeCueSet(pca_, chosen, noise_);
    return Status();
  }

  Result<Subspace> Assemble(const PoseMatrix& poses) {
    const Estimator estimator = options_.mode == EstimatorMode::kPaper
                                    ? LeastSquaresEstimator(pca_, cues_)
                                    : MapEstimator(pca_, cues_, !of_light());
    record_.warning = estimator.warning;
    const Eigen::MatrixXd training = MeasuredPoses(layout_, cues_, poses);
    std::vector<SubspaceOutput> outputs;
    for (std::size_t m = 0; m < rig_.target.meshes.size(); ++m)
      outputs.push_back({rig_.target.meshes[m].name, totals_[m]});
    Subspace subspace =
        MakeSubspace(pca_, cues_, estimator, training, std::move(outputs),
                     TileOptions{kTileShare * options_.tolerance, kTileMaxShare * options_.tolerance,
                                 of_light() ? 0 : kTileRest});
    if (options_.keep_modes) subspace.kept_modes = pca_.output_modes().cast<float>();
    subspace.mode = estimator.mode;
    subspace.ranges = ranges_;
    subspace.space = rig_.target.space_name;
    if (of_light()) subspace.units = kLightUnits;
    subspace.tolerance = options_.tolerance;
    subspace.violation_rate = options_.violation_rate;
    subspace.cues.clear();
    for (const CueRef& cue : cues_.cues) subspace.cues.push_back(Describe(cue));
    return subspace;
  }

  // Where output points are measured: stages that pass points through need not run.
  const AccelerationTarget::Stage& OutputStage(const std::vector<AccelerationTarget::Stage>& stages) const {
    std::size_t last = stages.size() - 1;
    while (last > 0 && rig_.graph->def(stages[last].points.node).passes_points) --last;
    return stages[last];
  }

  CueDescription Describe(CueRef cue) const {
    CueDescription d;
    Index index = cue.index;
    if (cue.kind == CueKind::kScalar) {
      d.kind = CueDescription::Kind::kScalar;
      d.plug = ranges_[index].plug;
      return d;
    }
    const auto put = [&](std::size_t m, const AccelerationTarget::Stage& stage, Index point) {
      d.mesh = static_cast<Index>(m), d.stage = stage.name, d.point = point;
      return d;
    };
    if (cue.kind == CueKind::kOutput) {
      std::size_t m = 0;
      for (; index >= totals_[m]; ++m) index -= totals_[m];
      return put(m, OutputStage(rig_.target.meshes[m].stages), index);
    }
    for (const CandidateStage& candidate : recorder_->candidates()) {
      if (index < candidate.points.size())
        return put(candidate.mesh, rig_.target.meshes[candidate.mesh].stages[candidate.stage],
                   candidate.points[index]);
      index -= static_cast<Index>(candidate.points.size());
    }
    KPSA_CHECK(false);
    return d;
  }

  // Scores and errors of the held-out poses, through the same code that runs in the graph.
  void Judge(const PoseMatrix& held_out, Subspace* subspace) {
    SubspaceScratch scratch(*subspace);
    SoftCacheThreshold always;
    always.tau = std::numeric_limits<double>::infinity();
    std::vector<double> raw(subspace->rows());
    std::vector<PointBuffer> buffers;
    for (const SubspaceOutput& output : subspace->outputs) buffers.emplace_back(output.points);
    double sum = 0;
    for (std::size_t t = 0; t < held_out.poses(); ++t) {
      const std::span<const float> row = held_out.row(t);
      std::size_t r = 0;
      for (const CueRef& cue : cues_.cues) {
        const std::size_t column = CueColumn(layout_, cue);
        for (std::size_t k = 0; k < CueHeight(layout_, cue); ++k) raw[r++] = row[column + k];
      }
      Measure(*subspace, raw, &scratch);
      const Verdict verdict = kpsa::Judge(*subspace, always, &scratch);
      double largest = 0, largest_mean = 0;  // squared
      std::size_t column = 0;
      for (std::size_t m = 0; m < buffers.size(); ++m) {
        double output_sum = 0;
        subspace->tiles[m].Reconstruct(scratch.inputs(), buffers[m].view());
        const ConstPointsView p = std::as_const(buffers[m]).view();
        for (std::size_t i = 0; i < p.count; ++i, column += 3) {
          const Double3 d{p.x[i] - static_cast<double>(row[column]),
                          p.y[i] - static_cast<double>(row[column + 1]),
                          p.z[i] - static_cast<double>(row[column + 2])};
          const double squared = Dot(d, d);
          output_sum += squared;
          largest = std::max(largest, squared);
        }
        sum += output_sum;
        largest_mean =
            std::max(largest_mean, output_sum / static_cast<double>(std::max<std::size_t>(1, p.count)));
      }
      subspace->calibration.push_back({verdict.score, std::sqrt(of_light() ? largest_mean : largest)});
      record_.held_out_max = std::max(record_.held_out_max, std::sqrt(largest));
    }
    if (held_out.poses() > 0)
      record_.held_out_rms = std::sqrt(sum / static_cast<double>(held_out.poses() * layout_.points));
  }

  const TrainingRig& rig_;
  const std::vector<TrainingClip>& clips_;
  const TrainOptions& options_;
  Compiler compiler_;
  std::unique_ptr<PoseRecorder> recorder_;
  PoseLayout layout_;
  std::vector<Index> totals_;
  std::vector<CuePlace> places_;
  double full_cost_ = 0;
  std::vector<Double3> positions_;
  std::vector<TrainedRange> ranges_;
  Pca pca_;
  CueSet cues_;
  double diagonal_ = 0;
  CueNoise noise_{0};
  TrainingRecord record_;
};

}  // namespace

Result<Subspace> Train(const TrainingRig& rig, const std::vector<TrainingClip>& clips,
                       const TrainOptions& options) {
  return Trainer(rig, clips, options).Run();
}

}  // namespace kpsa
