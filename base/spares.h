// Workplaces that evaluations borrow and give back: costly ones, of which any is as good as any other.
//
// There are as many as evaluations have been under way at once. Whoever finds none makes one, announces it
// (AddRoom) and gives it back like the others; nothing else allocates. Thread-safe.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace kpsa {

template <typename T>
class Spares {
 public:
  // The latest one that was given back; null where all are in use.
  std::unique_ptr<T> Take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (free_.empty()) return nullptr;
    std::unique_ptr<T> last = std::move(free_.back());
    free_.pop_back();
    return last;
  }
  void Give(std::unique_ptr<T> one) {
    const std::lock_guard<std::mutex> lock(mutex_);
    free_.push_back(std::move(one));  // has room
  }
  void AddRoom() {
    const std::lock_guard<std::mutex> lock(mutex_);
    free_.reserve(++count_);
  }

 private:
  std::mutex mutex_;
  std::size_t count_ = 0;
  std::vector<std::unique_ptr<T>> free_;
};

}  // namespace kpsa
