// Learns from misses in the background: these are handed in from any thread while frames are evaluated, and
// when it is told to, a thread of the learner's own trains a new version of the subspace with them, on a rig
// of its own. A version never changes, and nobody's evaluator is touched: the caller takes the new one
// between two requests, and compiles its next plan with it (kpsa/accelerate.h).
//
//   Learner learner(subspace, load_rig);
//   if (evaluator.Get<double>(full_weight) > 0) learner.Add({.clip = "shot_12", .time = t});  // as they come
//   learner.Learn();                                                 // from all of them so far
//   if (auto newer = learner.TakeNewest()) ...                       // between requests
//
// What lies about a miss is as new as the miss, and one pose among thousands would weigh nothing: all frames
// of its clip are learnt, and what lies between the rest pose and what is posed over it. The bytes of a
// version follow from the version before and from which misses were handed in, whatever their order and the
// threads. What is promised is calibrated anew, on poses that are drawn as in training, and never are learnt
// frames.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "kpsa/miss.h"
#include "kpsa/subspace.h"
#include "kpsa/training/trainer.h"

namespace kpsa::engine {

// What a learner trains on. Nobody else may touch the graph in the meantime: graphs are not shared between
// threads.
struct LearnerRig {
  std::shared_ptr<void> owner;  // of what follows refers to
  TrainingRig training;
  // Every frame of a clip. Errors: a clip that the character lacks.
  std::function<Result<TrainingClip>(const std::string& clip)> frames;
  std::size_t samples = 0;  // TrainOptions::samples, where the subspace is too old to tell
};
// Called on the learner's thread, once each time that it learns.
using LearnerRigFactory = std::function<Result<LearnerRig>()>;

struct LearnerOptions {
  std::size_t most_misses = 100'000;  // that are kept until they are learnt; more are dropped
  int threads = 1;                    // that training takes, its own among them; 0: all
  std::function<bool(const char* what, double share)> progress = {};  // as TrainOptions has it
};

// All functions may be called from any thread.
class Learner {
 public:
  Learner(std::shared_ptr<const Subspace> subspace, LearnerRigFactory rig, LearnerOptions options = {});
  // Gives up what is being learnt, at the end of a step of training.
  ~Learner();
  Learner(const Learner&) = delete;
  Learner& operator=(const Learner&) = delete;

  // Keeps a miss until it is learnt. False where it is known (handed in or learnt before), or there is no
  // room, or a number of it is none.
  bool Add(const Miss& miss);
  // Begins to learn from all misses that are kept. False where there are none, or it is learning already:
  // they are kept then. (Nothing is ever learnt unasked, so that no version depends on the time.)
  bool Learn();
  // Until nothing is being learnt. How the last learning ended; where it failed, its misses are kept.
  Status Wait();
  // The newest version, once; null where there is none that was not taken yet.
  std::shared_ptr<const Subspace> TakeNewest();

  struct State {
    bool learning = false;
    std::size_t kept = 0;                // misses that wait or are being learnt
    std::size_t known = 0, dropped = 0;  // so often was a miss known, or there was no room
    std::size_t versions = 0;            // that were learnt
    Status last;                         // how the last learning ended
  };
  State state() const;

 private:
  using Misses = std::set<Miss>;

  void Run(const std::stop_token& stop);
  Result<Subspace> TrainWith(const Subspace& before, const Misses& misses, const std::stop_token& stop);

  const LearnerRigFactory rig_;
  const LearnerOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable_any begins_, ends_;
  std::shared_ptr<const Subspace> newest_;
  bool taken_ = true;
  Misses learnt_, learning_, waiting_;
  State state_;
  std::jthread thread_;  // last: it reads all others
};

}  // namespace kpsa::engine
