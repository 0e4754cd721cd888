#include "kpsa/training/learner.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/parallel.h"
#include "base/thrown.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

// As that training was asked for.
TrainOptions OptionsOf(const Subspace& subspace, const TrainingRecord& record, std::size_t samples) {
  TrainOptions options;
  options.seed = record.seed;
  options.tolerance = subspace.tolerance, options.violation_rate = subspace.violation_rate;
  options.keep_modes = !subspace.kept_modes.values.empty();
  options.inner = subspace.of_inner() ? TrainOptions::Inner::kAlways : TrainOptions::Inner::kNever;
  for (const SubspaceOutput& output : subspace.outputs) options.stepped.push_back(output.stepped);
  options.at_rest = record.at_rest, options.may_leave_at_rest = false;
  if (record.mode == "paper") options.mode = EstimatorMode::kPaper;
  const TrainingRecord::Asked& asked = record.asked;
  options.samples = samples;
  if (asked.rows == 0) return options;  // an older file does not tell
  options.samples = std::min<std::size_t>(asked.samples, 1'000'000);
  options.calibration_poses = std::min<std::size_t>(asked.calibration, 100'000);
  options.rows = std::clamp<std::size_t>(asked.rows, 3, 3000);
  options.max_modes = static_cast<int>(std::clamp<std::size_t>(asked.modes, 1, 2000));
  (options.mode == EstimatorMode::kPaper ? options.key_points : options.min_points) =
      std::clamp<std::size_t>(asked.points, 2, 2000);
  options.may_have_cues_by_tile = asked.by_tile;
  return options;
}

std::set<Miss> LearntBy(const TrainingRecord& record) {
  std::set<Miss> learnt(record.learnt_poses.begin(), record.learnt_poses.end());
  for (const auto& [clip, times] : record.learnt) {
    for (const double time : times) learnt.insert({clip, time});
  }
  return learnt;
}

bool IsFinite(const Miss& miss) {
  return std::isfinite(miss.time) && std::ranges::all_of(miss.controls, [](const auto& control) {
           return std::isfinite(control.second);
         });
}

// What is trained on: the clips of the rig, then what was learnt before, then the misses.
struct Lesson {
  std::vector<TrainingClip> clips;
  std::vector<Miss> poses;
};
Result<Lesson> LessonOf(const TrainingRecord& record, const std::set<Miss>& misses, const LearnerRig& rig) {
  Lesson lesson;
  for (const std::string& name : record.clips) {
    Result<TrainingClip> clip = rig.frames(name);
    if (!clip.ok()) return clip.status();
    lesson.clips.push_back(std::move(*clip));
  }
  const auto trained = static_cast<std::ptrdiff_t>(lesson.clips.size());
  for (const auto& [clip, times] : record.learnt) lesson.clips.push_back({clip, times, true});
  lesson.poses = record.learnt_poses;
  std::map<std::string, std::set<double>> times;  // by clip
  for (const Miss& miss : misses) {
    if (miss.posed()) lesson.poses.push_back(miss);
    if (miss.clip.empty()) continue;
    std::set<double>& of_clip = times[miss.clip];
    if (!miss.posed()) of_clip.insert(miss.time);
  }
  for (auto& [name, all] : times) {
    const Result<TrainingClip> frames = rig.frames(name);
    if (!frames.ok()) return frames.status();
    auto known = std::find_if(lesson.clips.begin() + trained, lesson.clips.end(),
                              [&name = name](const TrainingClip& clip) { return clip.name == name; });
    if (known == lesson.clips.end()) known = lesson.clips.insert(known, {name, {}, true});
    all.insert(known->times.begin(), known->times.end());
    all.insert(frames->times.begin(), frames->times.end());
    known->times.assign(all.begin(), all.end());
  }
  return lesson;
}

}  // namespace

Learner::Learner(std::shared_ptr<const Subspace> subspace, LearnerRigFactory rig, LearnerOptions options)
    : rig_(std::move(rig)), options_(std::move(options)), newest_(std::move(subspace)) {
  learnt_ = LearntBy(ParseTraining(newest_->training));
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

Learner::~Learner() = default;

bool Learner::Add(const Miss& miss) {
  const std::lock_guard lock(mutex_);
  if (learnt_.contains(miss) || learning_.contains(miss) || waiting_.contains(miss)) {
    ++state_.known;
    return false;
  }
  if (state_.kept >= options_.most_misses || !IsFinite(miss)) {
    ++state_.dropped;
    return false;
  }
  waiting_.insert(miss);
  ++state_.kept;
  return true;
}

bool Learner::Learn() {
  {
    const std::lock_guard lock(mutex_);
    if (state_.learning || waiting_.empty()) return false;
    state_.learning = true;
    learning_ = std::exchange(waiting_, {});
  }
  begins_.notify_one();
  return true;
}

Status Learner::Wait() {
  std::unique_lock lock(mutex_);
  ends_.wait(lock, [&] { return !state_.learning; });
  return state_.last;
}

std::shared_ptr<const Subspace> Learner::TakeNewest() {
  const std::lock_guard lock(mutex_);
  return std::exchange(taken_, true) ? nullptr : newest_;
}

Learner::State Learner::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void Learner::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (begins_.wait(lock, stop, [&] { return state_.learning; })) {
    if (stop.stop_requested()) return;
    const std::shared_ptr<const Subspace> before = newest_;
    const Misses misses = learning_;
    lock.unlock();
    Result<Subspace> trained = Status();
    std::shared_ptr<const Subspace> made;
    Misses learnt;
    try {
      WithThreads(options_.threads, [&] { trained = TrainWith(*before, misses, stop); });
      if (trained.ok()) {
        made = std::make_shared<const Subspace>(std::move(*trained));
        learnt = LearntBy(ParseTraining(made->training));
      }
    } catch (...) {  // this is a thread of its own
      trained = Status::Invalid("{}", ThrownText());
      made = nullptr;
    }
    lock.lock();
    state_.last = trained.status();
    if (made != nullptr) {
      newest_ = std::move(made), taken_ = false;
      learnt_ = std::move(learnt);
      ++state_.versions;
    } else {  // for another time
      waiting_.merge(learning_);
    }
    learning_.clear();
    state_.kept = waiting_.size();
    state_.learning = false;
    ends_.notify_all();
  }
}

Result<Subspace> Learner::TrainWith(const Subspace& before, const Misses& misses,
                                    const std::stop_token& stop) {
  if (before.of_light())
    return Status::Invalid("the subspace is of light, which has no frames to learn from");
  const Result<LearnerRig> rig = rig_();
  if (!rig.ok()) return rig.status();
  const TrainingRecord record = ParseTraining(before.training);
  Result<Lesson> lesson = LessonOf(record, misses, *rig);
  if (!lesson.ok()) return lesson.status();
  TrainOptions options = OptionsOf(before, record, rig->samples);
  options.by_tile_as_before = before.by_tile();
  // What is learnt is to hit, not to miss in a part
  options.without.patches = !before.by_tile();
  options.learnt_poses = std::move(lesson->poses);
  options.progress = [&](const char* what, double share) {
    return !stop.stop_requested() && (!options_.progress || options_.progress(what, share));
  };
  return Train(rig->training, lesson->clips, options);
}

}  // namespace kpsa::engine
