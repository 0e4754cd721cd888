// Workplaces that evaluations borrow and give back: costly ones, of which any is as good as any other.
//
// Whoever finds none makes one, and gives it back like the others: there are as many as evaluations have been
// under way at once, or a few more, where one was given back behind the back of another that looked.
// Thread-safe, without locks; allocates nothing.
#pragma once

#include <array>
#include <atomic>
#include <memory>

namespace kpsa::engine {

template <typename T>
class Spares {
 public:
  Spares() = default;
  Spares(const Spares&) = delete;
  Spares& operator=(const Spares&) = delete;
  ~Spares() {
    while (Take() != nullptr) {
    }
  }
  // Null where all are in use.
  std::unique_ptr<T> Take() {
    for (std::atomic<T*>& slot : free_) {
      if (slot.load(std::memory_order_relaxed) == nullptr) continue;
      if (T* one = slot.exchange(nullptr, std::memory_order_acquire)) return std::unique_ptr<T>(one);
    }
    return nullptr;
  }
  // More than there is room for are let go.
  void Give(std::unique_ptr<T> one) {
    for (std::atomic<T*>& slot : free_) {
      T* none = nullptr;
      if (slot.compare_exchange_strong(none, one.get(), std::memory_order_release,
                                       std::memory_order_relaxed)) {
        one.release();
        return;
      }
    }
  }

 private:
  std::array<std::atomic<T*>, 64> free_ = {};
};

}  // namespace kpsa::engine
