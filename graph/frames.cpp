#include "graph/frames.h"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

#include "base/cancel.h"
#include "base/check.h"
#include "base/parallel.h"
#include "base/thrown.h"

namespace kpsa::engine {
namespace {

// Where a thread is, for what is thrown there.
struct Place {
  std::optional<std::size_t> frame;  // none before the first
};

// The frames of one call: hands out blocks, and turns at the sink.
class FrameQueue {
 public:
  FrameQueue(std::size_t frame_count, std::size_t block_size, const FrameSink& sink,
             const std::atomic<bool>* cancel)
      : frame_count_(frame_count), block_size_(block_size), sink_(sink), cancel_(cancel) {}

  // The next block [begin, end); false if there is none or all is over.
  bool Take(std::size_t* begin, std::size_t* end) {
    if (stopped()) return false;
    *begin = next_.fetch_add(1) * block_size_;
    *end = std::min(frame_count_, *begin + block_size_);
    return *begin < frame_count_;
  }

  bool stopped() {
    if (cancel_ != nullptr && cancel_->load(std::memory_order_relaxed)) Stop(Status());
    return stop_.load(std::memory_order_relaxed);
  }

  // Waits until all frames before `begin` are handed on, then hands on these.
  void Sink(std::size_t begin, std::size_t end, const std::vector<std::unique_ptr<Evaluator>>& evaluators,
            const std::vector<Status>& evaluated, Place* at) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      turn_.wait(lock, [&] { return done_ == begin || stop_.load(std::memory_order_relaxed); });
    }
    for (std::size_t frame = begin; frame < end; ++frame) {
      if (stopped()) return;
      at->frame = frame;
      Status status = sink_(frame, *evaluators[frame - begin], evaluated[frame - begin]);
      if (!status.ok()) return Stop(std::move(status));
      std::lock_guard<std::mutex> lock(mutex_);
      done_ = frame + 1;
    }
    turn_.notify_all();
  }

  // An exception, while it is handled: all others are cancelled. It becomes an error once the threads are through and
  // have given back what they took: it may say that there is no memory.
  void Thrown(const Place& at) noexcept {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (thrown_ == nullptr) thrown_ = std::current_exception(), thrown_at_ = at;
      stop_.store(true, std::memory_order_relaxed);
    }
    turn_.notify_all();
  }

  // Once all threads are through.
  Status Result() const {
    if (error_.ok() && thrown_ != nullptr) return ThrownStatus();
    if (!error_.ok() || done_ == frame_count_) return error_;
    return InterruptedStatus();
  }

 private:
  Status InterruptedStatus() const {
    return Status::Make(ErrorKind::kInterrupted,
                        fmt::format("interrupted after {} of {} frames", done_, frame_count_));
  }

  Status ThrownStatus() const {
    try {
      std::rethrow_exception(thrown_);
    } catch (const Cancelled&) {
      return InterruptedStatus();
    } catch (...) {
      const std::string text = ThrownText();
      if (!thrown_at_.frame.has_value()) return Status::Evaluation("{}", text);
      return Status::Evaluation("frame {} of {}: {}", *thrown_at_.frame, frame_count_, text);
    }
  }

  void Stop(Status error) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (error_.ok()) error_ = std::move(error);
    stop_.store(true, std::memory_order_relaxed);
    turn_.notify_all();
  }

  const std::size_t frame_count_, block_size_;
  const FrameSink& sink_;
  const std::atomic<bool>* cancel_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::condition_variable turn_;
  std::size_t done_ = 0;
  Status error_;
  std::exception_ptr thrown_;
  Place thrown_at_;
};

// The evaluators of one thread.
class BlockEvaluator {
 public:
  BlockEvaluator(const std::shared_ptr<const Plan>& plan, std::size_t size, Profile* profile)
      : plan_(*plan), workspace_(*plan), profile_(profile) {
    for (std::size_t i = 0; i < size; ++i) {
      evaluators_.push_back(std::make_unique<Evaluator>(plan, EvaluatorOptions{false, &workspace_}));
    }
    evaluated_.resize(size);
    contexts_.resize(size);
    prepared_.resize(size);
    for (Index s = plan_.segments()[0].begin; s < plan_.segments()[0].end; ++s) {
      const Index branch = plan_.steps()[s].branch;
      if (branch != kNoIndex && plan_.branches()[branch].compute_block != nullptr) shared_.push_back(s);
    }
  }

  void Run(std::size_t begin, std::size_t end, const SetFrame& set, FrameQueue& queue, Place* at) {
    const std::size_t count = end - begin;
    for (std::size_t i = 0; i < count; ++i) {
      at->frame = begin + i;
      set(begin + i, *evaluators_[i]);
      evaluators_[i]->Record(profile_, static_cast<int>(begin + i));
      evaluators_[i]->BeginRun();
    }
    for (Index step : shared_) {
      std::size_t ready = 0;
      for (std::size_t i = 0; i < count && !queue.stopped(); ++i) {
        evaluators_[i]->RunUntil(step);
        if (!evaluators_[i]->PrepareBlockStep(step, &contexts_[ready])) continue;
        prepared_[ready++] = evaluators_[i].get();
      }
      if (ready == 0) continue;
      const std::uint64_t start = profile_ != nullptr ? ProfileClock() : 0;
      try {
        plan_.branches()[plan_.steps()[step].branch].compute_block(contexts_.data(), ready);
      } catch (...) {
        for (std::size_t i = 0; i < ready; ++i)
          contexts_[i].host->Fail(ThrownByStep(plan_.shape(step), contexts_[i]));
      }
      const std::uint64_t share = profile_ != nullptr ? (ProfileClock() - start) / ready : 0;
      for (std::size_t i = 0; i < ready; ++i)
        prepared_[i]->FinishBlockStep(step, start + i * share, start + (i + 1) * share);
    }
    for (std::size_t i = 0; i < count && !queue.stopped(); ++i) {
      at->frame = begin + i;
      evaluated_[i] = evaluators_[i]->EndRun();
    }
  }

  void Work(const SetFrame& set, FrameQueue& queue, Place* at) {
    for (std::size_t begin, end; queue.Take(&begin, &end);) {
      Run(begin, end, set, queue, at);
      queue.Sink(begin, end, evaluators_, evaluated_, at);
    }
  }

 private:
  const Plan& plan_;
  Workspace workspace_;  // outlives the evaluators
  Profile* profile_;
  std::vector<std::unique_ptr<Evaluator>> evaluators_;
  std::vector<Status> evaluated_;
  std::vector<ComputeContext> contexts_;  // of the frames that are ready for a shared step
  std::vector<Evaluator*> prepared_;
  std::vector<Index> shared_;  // steps with compute_block
};

}  // namespace

Status EvaluateFrames(const std::shared_ptr<const Plan>& plan, std::size_t frame_count,
                      const FrameOptions& options, const SetFrame& set, const FrameSink& sink) {
  KPSA_CHECK_LE(1, options.block);
  const bool alone = !plan->stateful_node().empty() || !plan->prototype_node().empty();
  auto threads = static_cast<std::size_t>(options.threads > 0 ? options.threads : AllowedThreads());
  threads = std::clamp<std::size_t>(frame_count, 1, alone ? 1 : threads);
  const std::size_t share = (frame_count + threads - 1) / threads;
  const std::size_t block =
      std::clamp<std::size_t>(share, 1, alone ? 1 : static_cast<std::size_t>(options.block));
  FrameQueue queue(frame_count, block, sink, options.cancel);
  const FlagCancel cancel(options.cancel);  // within frames
  // Nothing leaves a thread but through the queue
  const auto work = [&](bool first) {
    Place at;
    const CancelScope scope(&cancel);
    try {
      std::optional<BlockEvaluator> evaluator;
      try {
        evaluator.emplace(plan, block, options.profile);
      } catch (const std::bad_alloc&) {  // no memory for another thread: those that are there do all
        if (first) throw;
        return;
      }
      evaluator->Work(set, queue, &at);
    } catch (...) {
      queue.Thrown(at);
    }
  };
  // Threads of its own rather than the pool's: they wait for each other, and a waiting pool thread may not
  // take a block
  std::vector<std::thread> workers;
  workers.reserve(threads);
  try {
    for (std::size_t i = 1; i < threads; ++i) workers.emplace_back(work, false);
  } catch (const std::system_error&) {  // no more threads to be had: those that are there do all
  } catch (const std::bad_alloc&) {
  }
  work(true);
  for (std::thread& worker : workers) worker.join();
  return queue.Result();
}

}  // namespace kpsa::engine
