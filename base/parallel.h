// The one door to the thread pool. Work is split into ranges whose results do not depend on the split.
#pragma once

#include <cstddef>
#include <functional>

namespace kpsa::engine {

// A reference to a callable; does not own it. Two pointers, so passing one allocates nothing.
class RangeBody {
 public:
  template <typename F>
  RangeBody(const F& f)  // NOLINT: implicit by design
      : object_(&f), call_([](const void* object, std::size_t begin, std::size_t end) {
          (*static_cast<const F*>(object))(begin, end);
        }) {}
  void operator()(std::size_t begin, std::size_t end) const { call_(object_, begin, end); }

 private:
  const void* object_;
  void (*call_)(const void*, std::size_t, std::size_t);
};

// Calls body(begin, end) over disjoint ranges that cover [0, count), each range except the last a multiple of
// `grain` long. Runs inline where count <= grain. Blocks until all ranges are done. What a range throws ends the others
// and comes out here; so does Cancelled, where the scope around the call (base/cancel.h) asks for it before a range.
void ParallelFor(std::size_t count, std::size_t grain, RangeBody body);

// Limits the threads that ParallelFor may use, in this scope, process-wide (0: as many as there are cores).
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  void* impl_;
};
// Runs the body on this thread; ParallelFor within it uses at most so many (this one among them; 0: all), so
// that work in the background leaves the others to what shows.
void WithThreads(int threads, const std::function<void()>& body);
int HardwareThreads();
int AllowedThreads();  // as limited

}  // namespace kpsa::engine
