// Work that takes long and is ended from within: whoever may want its end says so in a scope, and the work asks on its
// way, wherever it is split (base/parallel.h) and between the blocks of long loops. It ends by an exception, which the
// one that opened the scope catches.
#pragma once

#include <atomic>
#include <exception>

namespace kpsa::engine {

class CancelSource {
 public:
  virtual ~CancelSource() = default;
  // On any thread, as often as every few hundred microseconds. Once true, it stays.
  virtual bool asked() const = 0;
};

struct Cancelled : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

// For work on this thread, and on those that it hands parts to, up to the end of the scope; one within another takes its
// place. Null: nothing asks.
class CancelScope {
 public:
  explicit CancelScope(const CancelSource* source);
  ~CancelScope();
  CancelScope(const CancelScope&) = delete;
  CancelScope& operator=(const CancelScope&) = delete;

 private:
  const CancelSource* outer_;
};

// Of the innermost scope on this thread; null where there is none.
const CancelSource* CurrentCancel();
// Throws Cancelled where that asks for the end.
void ThrowIfCancelled();

// A flag that is set from anywhere, a signal's handler too, or what the scope around it has.
class FlagCancel final : public CancelSource {
 public:
  explicit FlagCancel(const std::atomic<bool>* flag) : flag_(flag), outer_(CurrentCancel()) {}
  bool asked() const override {
    return (flag_ != nullptr && flag_->load(std::memory_order_relaxed)) ||
           (outer_ != nullptr && outer_->asked());
  }

 private:
  const std::atomic<bool>* flag_;
  const CancelSource* outer_;
};

}  // namespace kpsa::engine
