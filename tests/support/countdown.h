// Work that is ended after so many questions whether to go on, whatever the time: what ends it early is tested at
// each of them.
#pragma once

#include <atomic>

#include "base/cancel.h"

namespace kpsa::engine {

class Countdown final : public CancelSource {
 public:
  Countdown() = default;  // never
  explicit Countdown(long long questions) : most_(questions) {}
  bool asked() const override { return ++questions_ > most_ && most_ >= 0; }
  long long questions() const { return questions_; }

 private:
  long long most_ = -1;
  mutable std::atomic<long long> questions_{0};
};

}  // namespace kpsa::engine
