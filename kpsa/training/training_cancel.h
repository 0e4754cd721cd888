// Asks whoever trains whether to go on, within what takes long, too. Internal to training.
#pragma once

#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "base/cancel.h"

namespace kpsa::engine {

// On the thread that made it, `progress` is called again where it was not for a while; on all threads the scope around
// it counts.
class TrainingCancel final : public CancelSource {
 public:
  using Progress = std::function<bool(const char* what, double share)>;
  explicit TrainingCancel(const Progress& progress) : progress_(progress) {}

  // As TrainOptions::progress.
  bool Say(const char* what, double share) {
    what_ = what, share_ = share;
    return Ask();
  }
  bool asked() const override {
    if (outer_ != nullptr && outer_->asked()) return true;
    if (no_more_.load(std::memory_order_relaxed)) return true;
    if (!progress_ || std::this_thread::get_id() != thread_ || asking_) return false;
    return std::chrono::steady_clock::now() - last_ >= kBetween && !Ask();
  }

 private:
  static constexpr std::chrono::milliseconds kBetween{100};
  bool Ask() const {
    asking_ = true;  // whatever it does meanwhile
    if (progress_ && !progress_(what_, share_)) no_more_ = true;
    asking_ = false;
    last_ = std::chrono::steady_clock::now();
    return !no_more_;
  }

  const Progress& progress_;
  const CancelSource* const outer_ = CurrentCancel();
  const std::thread::id thread_ = std::this_thread::get_id();
  const char* what_ = "poses";
  double share_ = 0;
  mutable std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  mutable bool asking_ = false;
  mutable std::atomic<bool> no_more_{false};
};

}  // namespace kpsa::engine
