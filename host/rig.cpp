#include "kpsa/rig.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "files/file.h"
#include "host/face_impl.h"
#include "host/node_type.h"
#include "host/problems.h"
#include "host/rig_training.h"
#include "kpsa/kpsa_node.h"
#include "kpsa/training_record.h"

namespace kpsa {
namespace {

ControlInfo InfoOf(const engine::Control& control, const engine::FileUnits& units) {
  ControlInfo info;
  info.name = control.name;
  info.unit = static_cast<ControlInfo::Unit>(control.unit);
  info.si = units.FactorOf(control.unit);
  info.min = control.min / info.si, info.max = control.max / info.si, info.value = control.value / info.si;
  return info;
}
static_assert(static_cast<int>(ControlInfo::Unit::kTime) == static_cast<int>(engine::Unit::kTime));

MeshInfo InfoOf(const engine::CharacterMesh& mesh, const engine::Graph& graph) {
  MeshInfo info;
  info.name = mesh.name;
  info.vertices = mesh.vertex_count;
  info.triangles = mesh.mesh().data().triangle_vertices;
  for (const engine::Stage& stage : mesh.stages) {
    info.stages.push_back(stage.name);
    info.stage_nodes.push_back(graph.name(stage.node));
  }
  return info;
}

// The options over those of the rig's entry.
engine::TrainOptions TrainOptionsOf(const TrainingOptions& options, const engine::Rig& rig,
                                    const engine::AccelerateEntry& entry) {
  engine::TrainOptions train = engine::TrainOptionsOf(rig, entry);
  if (options.paper) train.mode = engine::EstimatorMode::kPaper;
  if (options.samples.has_value()) train.samples = *options.samples;
  if (options.calibration.has_value()) train.calibration_poses = *options.calibration;
  if (options.key_points.has_value())
    (options.paper ? train.key_points : train.min_points) = *options.key_points;
  if (options.tolerance.has_value()) train.tolerance = *options.tolerance;
  if (options.violation_rate.has_value()) train.violation_rate = *options.violation_rate;
  train.seed = options.seed;
  train.seconds = options.seconds;
  if (options.progress) {
    train.progress = [&options](const char* what, double share) { return options.progress(what, share); };
  }
  return train;
}

engine::Status CheckNumbers(const TrainingOptions& options) {
  const auto above = [](const std::optional<double>& number, double most) {
    return !number.has_value() || (*number >= 0 && *number <= most);
  };
  constexpr double kHuge = 1e30;
  if (!above(options.tolerance, kHuge))
    return engine::Status::Usage("tolerance: expected a length of 0 or more, metres");
  if (!above(options.violation_rate, 1))
    return engine::Status::Usage("violation_rate: expected a share from 0 to 1");
  if (!(options.seconds > 0)) return engine::Status::Usage("seconds: expected a time above 0");
  if (options.samples > 1'000'000u) return engine::Status::Usage("samples: expected at most 1,000,000");
  if (options.calibration.has_value() && (*options.calibration < 20 || *options.calibration > 100'000))
    return engine::Status::Usage("calibration: expected 20 to 100,000 poses");
  if (options.key_points.has_value() && (*options.key_points < 2 || *options.key_points > 2000))
    return engine::Status::Usage("key_points: expected 2 to 2,000");
  if (options.threads < 0 || options.threads > 1024)
    return engine::Status::Usage("threads: expected 0 to 1,024");
  return engine::Status();
}

// Training evaluates poses on all threads, and many of them.
engine::Status CheckNodes(const engine::TrainingRig& rig) {
  std::vector<engine::PlugRef> evaluated = rig.target.outputs();
  evaluated.insert(evaluated.end(), rig.target.space.begin(), rig.target.space.end());
  for (const engine::ControlRange& control : rig.controls) {
    if (control.shown.has_value()) evaluated.push_back(*control.shown);
  }
  const std::string name = engine::PrototypeNodeAbove(*rig.graph, evaluated);
  if (name.empty()) return engine::Status();
  return engine::Status::Usage(
             "\"{}\" is computed by a function of this program, one thread at a time: no points that need "
             "such a "
             "node are trained; expected node types of the library or of a plugin",
             name)
      .OfNode(name);
}

}  // namespace

std::shared_ptr<Rig::Impl> Rig::Impl::Make(std::shared_ptr<Library::Impl> library, engine::Rig rest) {
  auto impl = std::make_shared<Impl>();
  impl->library = std::move(library);
  for (const engine::Control& control : rest.controls) impl->controls.push_back(InfoOf(control, rest.units));
  for (const engine::CharacterClip& clip : rest.scene.clips)
    impl->clips.push_back({clip.id, clip.begin, clip.duration});
  for (const std::size_t m : engine::ShownMeshes(rest.scene))
    impl->meshes.push_back(InfoOf(rest.scene.meshes[m], *rest.graph));
  impl->rest = std::move(rest);
  return impl;
}

engine::Result<std::shared_ptr<engine::Playing>> Rig::Impl::PlayingOf(
    const std::optional<std::string>& clip) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto it = playing_.find(clip); it != playing_.end()) return it->second;
  engine::Result<std::shared_ptr<engine::Playing>> made = engine::Playing::Make(rest, clip, {}, acceleration);
  if (made.ok()) playing_[clip] = *made;
  return made;
}

const std::string& Rig::path() const { return impl_->rest.path; }
double Rig::fps() const { return impl_->rest.fps; }
std::span<const ControlInfo> Rig::controls() const { return impl_->controls; }
std::span<const ClipInfo> Rig::clips() const { return impl_->clips; }
std::span<const MeshInfo> Rig::meshes() const { return impl_->meshes; }
std::span<const std::string> Rig::notes() const { return impl_->rest.notes; }
bool Rig::is_accelerated() const { return impl_->acceleration.has_value(); }

const MeshInfo* Rig::FindMesh(std::string_view name) const {
  const auto it = std::ranges::find(impl_->meshes, name, &MeshInfo::name);
  return it == impl_->meshes.end() ? nullptr : &*it;
}

kpsa::Result<kpsa::Rig> Rig::Accelerated(const AccelerationOptions& options) const {
  engine::AccelerationChoice choice;
  choice.subspace = options.subspace;
  choice.stale_is_miss = options.stale_is_miss;
  choice.stale_option = "stale_is_miss";
  choice.violation_rate = options.violation_rate;
  choice.tolerance = options.tolerance;
  if (options.tolerance.has_value() && !(*options.tolerance >= 0))
    return engine::ProblemsOf(
        engine::Status::Usage("tolerance: expected a length of 0 or more, metres").At({path()}));
  if (options.tolerance.has_value()) choice.tolerance = std::min(*options.tolerance, engine::kAnyError);
  if (options.violation_rate.has_value() && !(*options.violation_rate >= 0 && *options.violation_rate <= 1))
    return engine::ProblemsOf(
        engine::Status::Usage("violation_rate: expected a share from 0 to 1").At({path()}));
  auto impl = Impl::Make(impl_->library, impl_->rest);
  impl->acceleration = choice;
  // Whether the subspaces fit is known once they are in place
  const auto playing = impl->PlayingOf(std::nullopt);
  if (!playing.ok()) return engine::ProblemsOf(engine::Status(playing.status()).At({path()}));
  for (const engine::AppliedSubspace& one : (*playing)->applied()) {
    impl->acceleration->loaded.emplace_back(one.path, one.subspace);
    for (const std::string& note : one.notes) impl->rest.notes.push_back(one.name + ": " + note);
  }
  return kpsa::Rig(std::move(impl));
}

kpsa::Result<TrainingReport> Rig::Train(const TrainingOptions& options, const std::string& subspace) const {
  const auto failed = [&](const engine::Status& status) {
    return engine::ProblemsOf(engine::Status(status).At({this->path()}));
  };
  if (is_accelerated())
    return failed(engine::Status::Usage("this rig is accelerated: expected the one that it was made of"));
  if (const engine::Status numbers = CheckNumbers(options); !numbers.ok()) return failed(numbers);
  engine::Rig rig = impl_->rest;
  const auto entry =
      engine::ChooseEntry(rig, options.entry.empty() ? std::nullopt : std::optional(options.entry));
  if (!entry.ok()) return failed(entry.status());
  const engine::TrainingRig training = engine::MakeTrainingRig(&rig, *entry);
  if (const engine::Status status = CheckNodes(training); !status.ok()) return failed(status);
  const std::string path = subspace.empty() ? entry->subspace : subspace;
  if (path.empty())
    return failed(engine::Status::Usage("\"{}\" names no subspace file: expected one", entry->name));
  for (const std::string& clip : options.clips) {
    if (std::ranges::find(entry->test_clips, clip) != entry->test_clips.end())
      return failed(
          engine::Status::Usage("clip \"{}\" is a test clip of the rig, which is never trained on", clip));
  }
  const auto clips = engine::ClipFrames(rig, options.clips.empty() ? entry->train_clips : options.clips);
  if (!clips.ok()) return failed(clips.status());

  // Whether it can be written is known before the minutes of training; what the writer makes is removed at once
  if (const auto output = engine::OutputFile::Create(path, true); !output.ok())
    return failed(output.status());
  const engine::ThreadLimit limit(options.threads);
  const engine::TrainOptions train = TrainOptionsOf(options, rig, *entry);
  const engine::Result<engine::Subspace> trained = engine::Train(training, *clips, train);
  if (!trained.ok()) return failed(engine::Status(trained.status()).At({rig.path}));
  if (const engine::Status written = engine::WriteSubspace(*trained, path); !written.ok())
    return failed(written);

  const engine::TrainingRecord record = engine::ParseTraining(trained->training);
  const engine::Calibration calibration = engine::Calibrate(trained->calibration, trained->tolerance,
                                                            trained->violation_rate, trained->blend_start);
  TrainingReport report;
  report.subspace = path;
  for (const engine::SubspaceOutput& output : trained->outputs) report.points += output.points;
  report.cues = trained->cues.size();
  report.modes = trained->modes;
  report.held_out_rms = record.held_out_rms;
  report.held_out_max = record.held_out_max;
  report.tolerance = trained->tolerance;
  report.hit_rate = engine::ExpectedHitRate(calibration);
  report.warning = record.warning.empty() ? calibration.warning : record.warning;
  return report;
}

}  // namespace kpsa
