#include "bench/ablation_poses.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/median.h"
#include "files/npz.h"
#include "kpsa/training/cue_places.h"
#include "kpsa/training/mode_choice.h"
#include "kpsa/training/poses.h"
#include "kpsa/training/signal_noise.h"
#include "kpsa/training/training_signals.h"
#include "nodes/standard_nodes.h"

namespace kpsa::engine::ablation {
namespace {

constexpr int kModes = 200;
constexpr std::size_t kStageCandidates = 2000, kProducts = 160, kFrameStep = 3;

}  // namespace

Status AblationPoses::Load(const std::string& path, std::size_t samples) {
  AddStandardNodes(registry);
  AddKpsaNode(registry);
  RigOptions rest;
  rest.rest = true;
  Result<Rig> loaded = LoadRig(registry, path, rest);
  if (!loaded.ok()) return loaded.status();
  rig = std::move(*loaded);
  if (rig.accelerate.empty() || rig.accelerate[0].test_clips.empty())
    return Status::Invalid("expected an accelerate entry with a test clip").At({path});
  entry = rig.accelerate[0];
  if (samples == 0) samples = TrainOptionsOf(rig, entry).samples;
  training_rig_ = MakeTrainingRig(&rig, entry);
  Result<std::vector<TrainingClip>> clips = ClipFrames(rig, entry.train_clips),
                                    tests = ClipFrames(rig, {entry.test_clips[0]});
  if (!clips.ok()) return clips.status();
  if (!tests.ok()) return tests.status();
  for (TrainingClip& clip : *clips) {
    for (std::size_t i = 0; kFrameStep * i < clip.times.size(); ++i)
      clip.times[i] = clip.times[kFrameStep * i];
    clip.times.resize((clip.times.size() + kFrameStep - 1) / kFrameStep);
  }
  KPSA_RETURN_IF_ERROR(MakeRecorder(*clips));
  KPSA_RETURN_IF_ERROR(Record(*clips, (*tests)[0], samples));
  AddProducts();
  KPSA_RETURN_IF_ERROR(FindModes());
  return SetClip(&rig, entry.test_clips[0]);
}

// Candidates of the last stage but one of each mesh, evenly spread; signals under the controls and every
// clip.
Status AblationPoses::MakeRecorder(const std::vector<TrainingClip>& clips) {
  Result<std::vector<Index>> totals = PointTotals(training_rig_, &compiler_);
  if (!totals.ok()) return totals.status();
  totals_ = std::move(*totals);
  std::vector<CandidateStage> candidates;
  for (std::size_t m = 0; m < totals_.size(); ++m) {
    const auto& stages = training_rig_.target.meshes[m].stages;
    if (stages.size() < 2) continue;
    candidates.push_back({m, stages.size() - 2, EvenSpread(totals_[m], kStageCandidates)});
    stage = stages[candidates.back().stage].name;
  }
  Result<TrainingSignals> found = FindTrainingSignals(training_rig_, &compiler_, clips, true);
  if (!found.ok()) return found.status();
  std::vector<Signal> signals = std::move(found->watched);
  signals.insert(signals.end(), found->relative.begin(), found->relative.end());
  recorder_ =
      std::make_unique<PoseRecorder>(training_rig_, &compiler_, std::move(candidates), std::move(signals));
  return Status();
}

Status AblationPoses::Record(const std::vector<TrainingClip>& clips, const TrainingClip& test_clip,
                             std::size_t samples) {
  const Result<PoseLayout> layout = recorder_->Layout(kProducts);
  if (!layout.ok()) return layout.status();
  training = std::make_unique<PoseMatrix>(*layout);
  test = std::make_unique<PoseMatrix>(*layout);
  for (const TrainingClip& clip : clips) KPSA_RETURN_IF_ERROR(recorder_->AddClip(clip, training.get()));
  Result<ClipPoses> clip_poses = recorder_->ControlsOfClips(clips);
  if (!clip_poses.ok()) return clip_poses.status();
  KPSA_RETURN_IF_ERROR(recorder_->AddSamples(Sweeps(training_rig_.controls), clips, training.get()));
  KPSA_RETURN_IF_ERROR(recorder_->AddSamples(
      SamplePoses(training_rig_.controls, *clip_poses, {}, clips.size(), samples, 1), clips, training.get()));
  KPSA_RETURN_IF_ERROR(recorder_->AddClip(test_clip, test.get()));
  test_times_ = test_clip.times;
  return Status();
}

void AblationPoses::AddProducts() {
  recorder_->SetProducts(ChooseCueProducts(
      *training, ProductOptionsOf(recorder_->signals(), recorder_->layout(), entry.tolerance)));
  for (PoseMatrix* poses : {training.get(), test.get()}) {
    for (std::size_t t = 0; t < poses->poses(); ++t)
      StoreProducts(recorder_->products(), recorder_->layout(), poses->row(t));
  }
}

Status AblationPoses::FindModes() {
  const PoseLayout& layout = recorder_->layout();
  const Eigen::VectorXd mean = training->Mean();
  training->Subtract(mean);
  test->Subtract(mean);
  PcaOptions options;
  options.max_modes = kModes;
  Result<Pca> found = ComputePca(*training, mean, options);
  if (!found.ok()) return found.status();
  pca = std::move(*found);
  MeanShape shape = MeanShapeOf(layout, mean);
  positions = std::move(shape.positions);
  diagonal = shape.diagonal;
  noise = NoiseOf(recorder_->signals(), *training, mean, diagonal, entry.tolerance, false);
  double energy = 0;
  for (std::size_t t = 0; t < test->poses(); ++t) {
    for (std::size_t c = 0; c < layout.outputs(); ++c) energy += double{test->row(t)[c]} * test->row(t)[c];
  }
  motion_rms = std::sqrt(energy / static_cast<double>(test->poses() * layout.points));
  return Status();
}

AblationPoses::Sort AblationPoses::SortOf(Index scalar) const {
  const PoseLayout& layout = training->layout();
  if (scalar >= layout.relative_begin) return Sort::kMatrix;
  return scalar >= layout.products_begin() ? Sort::kProduct : Sort::kLocal;
}

std::shared_ptr<const Plan> AblationPoses::PlanOf(const std::vector<CueRef>& cues) {
  Request request;
  request.varying = {rig.scene.time};
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
    std::vector<Index> of_stage = among(CueKind::kStage, begin, candidate.points.size());
    begin += candidate.points.size();
    for (Index& point : of_stage) point = candidate.points[point];
    if (!of_stage.empty())
      request.outputs.push_back({target.meshes[candidate.mesh].stages[candidate.stage].points,
                                 PointSet::Of(of_stage, totals_[candidate.mesh])});
  }
  // Scalars, and the factors of products
  std::vector<char> wanted(training->layout().scalars, 0);
  for (const CueRef& cue : cues) {
    if (cue.kind != CueKind::kScalar) continue;
    if (SortOf(cue.index) != Sort::kProduct) {
      wanted[cue.index] = 1;
      continue;
    }
    const CueProduct& product = recorder_->products()[cue.index - training->layout().products_begin()];
    wanted[product.a] = 1;
    if (product.b != kNoIndex) wanted[product.b] = 1;
  }
  const std::vector<Index> first = FirstScalars(recorder_->signals(), recorder_->layout());
  bool relative = false;
  for (std::size_t s = 0; s < first.size(); ++s) {
    const Signal& signal = recorder_->signals()[s];
    const auto of_signal = wanted.begin() + static_cast<std::ptrdiff_t>(first[s]);
    if (std::count(of_signal, of_signal + static_cast<std::ptrdiff_t>(signal.entries()), 1) == 0) continue;
    request.outputs.push_back({signal.plug, {}});
    relative |= signal.relative;
  }
  for (const PlugRef& space : target.space) {
    if (relative) request.outputs.push_back({space, {}});
  }
  Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(*rig.graph, request);
  return plan.ok() ? *plan : nullptr;
}

double AblationPoses::PointsComputed(const std::vector<CueRef>& cues) {
  double points = 0;
  const std::shared_ptr<const Plan> plan = PlanOf(cues);
  if (plan == nullptr) return points;
  for (const Plan::StepInfo& info : plan->infos()) points += info.points;
  return points;
}

double AblationPoses::Microseconds(const std::vector<CueRef>& cues) {
  using Clock = std::chrono::steady_clock;
  const std::shared_ptr<const Plan> plan = PlanOf(cues);
  if (plan == nullptr) return 0;
  Evaluator evaluator(plan);
  const Index time = plan->FindVarying(rig.scene.time);
  std::vector<double> us;
  for (int pass = 0; pass < 2; ++pass) {
    for (const double t : test_times_) {
      if (time != kNoIndex) evaluator.Set(time, t);
      const auto begin = Clock::now();
      if (!evaluator.Evaluate().ok()) return 0;
      if (pass > 0) us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    }
  }
  return UpperMedian(std::move(us));
}

Status AblationPoses::Dump(const std::string& path) const {
  const PoseLayout& layout = training->layout();
  const std::size_t local = layout.products_begin(), matrices = layout.scalars - layout.relative_begin;
  Result<NpzWriter> file = NpzWriter::Create(path, true);
  if (!file.ok()) return file.status();
  for (const auto& [name, poses] : {std::pair("train", training.get()), std::pair("test", test.get())}) {
    const Result<NpzWriter::ArrayId> inputs =
        file->Declare(std::string(name) + "_inputs", NpzType::kFloat32, {poses->poses(), local + matrices});
    if (!inputs.ok()) return inputs.status();
    const Result<NpzWriter::ArrayId> points =
        file->Declare(std::string(name) + "_points", NpzType::kFloat32, {poses->poses(), layout.outputs()});
    if (!points.ok()) return points.status();
    for (std::size_t t = 0; t < poses->poses(); ++t) {
      const std::span<const float> row = std::as_const(*poses).row(t),
                                   scalars = row.subspan(layout.scalar_begin());
      KPSA_RETURN_IF_ERROR(file->Append(*inputs, scalars.first(local)));
      KPSA_RETURN_IF_ERROR(file->Append(*inputs, scalars.last(matrices)));
      KPSA_RETURN_IF_ERROR(file->Append(*points, row.first(layout.outputs())));
    }
  }
  const double count[] = {static_cast<double>(local)}, size[] = {diagonal};
  KPSA_RETURN_IF_ERROR(file->Add("local_inputs", {}, count));
  KPSA_RETURN_IF_ERROR(file->Add("diagonal", {}, size));
  return file->Finish();
}

}  // namespace kpsa::engine::ablation
