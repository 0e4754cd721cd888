#include "base/cancel.h"

#include <utility>

namespace kpsa::engine {
namespace {

thread_local const CancelSource* current = nullptr;

}  // namespace

CancelScope::CancelScope(const CancelSource* source) : outer_(std::exchange(current, source)) {}
CancelScope::~CancelScope() { current = outer_; }

const CancelSource* CurrentCancel() { return current; }

void ThrowIfCancelled() {
  if (current != nullptr && current->asked()) throw Cancelled();
}

}  // namespace kpsa::engine
