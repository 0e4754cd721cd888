// How a call that takes long is watched, and ended early.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

#include "base/status.h"

namespace kpsa::engine {

struct Watch {
  // What is done, of all that there is to do (0: nobody knows). One call at a time, on any thread; may be null.
  std::function<void(std::size_t done, std::size_t all)> progress = {};
  // Set from any thread: the call ends soon after, with CancelledStatus. May be null.
  const std::atomic<bool>* cancel = nullptr;

  bool cancelled() const { return cancel != nullptr && cancel->load(std::memory_order_relaxed); }
  void Done(std::size_t done, std::size_t all) const {
    if (progress) progress(done, all);
  }
};

inline Status CancelledStatus() {
  return Status::Make(ErrorKind::kInterrupted, "interrupted; nothing was written");
}

}  // namespace kpsa::engine
