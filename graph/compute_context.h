// What a node's compute sees: its inputs and outputs as typed slots, its bound kernel, scratch and state. It
// sees no graph and no host. A compute may run on any thread, several at once on different contexts, and must
// give the same bytes whenever it is given the same inputs.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/parallel.h"
#include "base/points.h"
#include "base/types.h"
#include "graph/slot_kind.h"

namespace kpsa::engine {

// Throws what becomes an error of the node that computes, with the name of the array.
[[noreturn]] void ThrowNoElement(const std::uint32_t* table, std::uint32_t element);

// The elements of an array input, each in a slot of its own. An element that there is not is an error of the node.
template <typename T>
class ArrayView {
 public:
  ArrayView(const std::byte* values, const std::uint32_t* table) : values_(values), table_(table) {}
  std::uint32_t size() const { return table_[0]; }
  const T& operator[](std::uint32_t i) const {
    if (i >= table_[0]) [[unlikely]]
      ThrowNoElement(table_, i);
    return *reinterpret_cast<const T*>(values_ + table_[1 + i]);
  }

 private:
  const std::byte* values_;
  const std::uint32_t* table_;
};

// The elements of an array output, likewise.
template <typename T>
class OutArray {
 public:
  OutArray(std::byte* values, const std::uint32_t* table) : values_(values), table_(table) {}
  std::uint32_t size() const { return table_[0]; }
  T& operator[](std::uint32_t i) const {
    if (i >= table_[0]) [[unlikely]]
      ThrowNoElement(table_, i);
    return *reinterpret_cast<T*>(values_ + table_[1 + i]);
  }

 private:
  std::byte* values_;
  const std::uint32_t* table_;
};

// What the host offers to a compute besides data.
class ComputeHost {
 public:
  virtual ~ComputeHost() = default;
  // Records an error of the node that computes now; its outputs are then taken as not computed. Not to be
  // called from the body of a For: it would depend on the threads which message is kept.
  virtual void Fail(std::string_view message) = 0;
  // As kpsa::engine::ParallelFor where the host evaluates in parallel, inline otherwise.
  virtual void For(std::size_t count, std::size_t grain, RangeBody body) = 0;
  // Throws what becomes an error of the node that computes, where it has no such slot, or one of another type.
  virtual void Check(const SlotAccess& access) const { (void)access; }
  // For profiles: whether times are wanted, and how long a part of the node's work took. Parts are the node's
  // own, from 0 to kMaxParts - 1. In decide and compute.
  static constexpr int kMaxParts = 4;
  virtual bool recording() const { return false; }
  virtual void AddPart(int part, std::uint64_t ns) { (void)part, (void)ns; }
};

class ComputeContext {
 public:
  std::byte* values = nullptr;  // the evaluator's slots
  const std::uint32_t* in =
      nullptr;  // by input of the group: slot offset; for arrays: where their table begins
  const std::uint32_t* out = nullptr;  // by output of the group, likewise
  const void* kernel = nullptr;        // what bind returned, or null
  float* scratch = nullptr;            // as many floats as bind asked for; content undefined; 64-byte aligned
  std::byte* state =
      nullptr;               // as many bytes as bind asked for; kept from decide to compute; 64-byte aligned
  std::uint64_t chosen = 0;  // what decide returned: the bits of the lazy inputs that were evaluated
  ComputeHost* host = nullptr;
  bool at_rest =
      false;  // the rest state is computed while compiling: all lazy inputs are there, whatever decide says

  // Inputs and outputs by their position in the group's lists. T is the slot's type (graph/value.h). Each access is
  // looked up, and a wrong one is an error of the node; where a compute names what it reads (graph/node_context.h),
  // that is checked once, when its type is registered, and an access costs nothing.
  template <typename T>
  const T& get(int i) const {
    Check<T>(i, true, false);
    return slot<T>(i);
  }
  template <typename T>
  ArrayView<T> array(int i) const {
    Check<T>(i, true, true);
    return slots<T>(i);
  }
  const ConstPointsView& points(int i) const { return get<ConstPointsView>(i); }
  template <typename T>
  T& out_value(int i) const {
    Check<T>(i, false, false);
    return out_slot<T>(i);
  }
  template <typename T>
  OutArray<T> out_array(int i) const {
    Check<T>(i, false, true);
    return out_slots<T>(i);
  }
  template <typename T>
  T& out_value(int i, std::uint32_t element) const {
    return out_array<T>(i)[element];
  }
  const PointsView& out_points(int i) const { return out_value<PointsView>(i); }
  const PointsView& out_points(int i, std::uint32_t element) const {
    return out_value<PointsView>(i, element);
  }

  // The same unchecked, for positions and types that were checked before.
  template <typename T>
  const T& slot(int i) const {
    return *reinterpret_cast<const T*>(values + in[i]);
  }
  template <typename T>
  ArrayView<T> slots(int i) const {
    return ArrayView<T>(values, in + in[i]);
  }
  template <typename T>
  T& out_slot(int i) const {
    return *reinterpret_cast<T*>(values + out[i]);
  }
  template <typename T>
  OutArray<T> out_slots(int i) const {
    return OutArray<T>(values, out + out[i]);
  }

  template <typename K>
  const K& kernel_as() const {
    return *static_cast<const K*>(kernel);
  }
  template <typename S>
  S& state_as() const {
    return *reinterpret_cast<S*>(state);
  }

 private:
  template <typename T>
  void Check(int position, bool input, bool array) const {
    if (host != nullptr) host->Check(SlotAccess::Of<T>(position, input, array));
  }
};

// What a batch sees: steps of one kind, each with inputs of its own. Their outputs (one small value each) are
// not slots but stand in a row, so that the host can compare them with what they were. Nothing is checked here: nodes
// name what their batches read (NodeBatch in graph/node_context.h).
class BatchContext {
 public:
  const std::byte* values = nullptr;  // the evaluator's slots
  const std::uint32_t* in = nullptr;  // slot offsets of the first step's inputs
  std::size_t stride = 0;             // from a step's to the next one's
  const void* kernel = nullptr;       // what bind_batch returned
  std::byte* out = nullptr;           // 64-byte aligned
  std::size_t count = 0;

  template <typename T>
  const T& get(std::size_t step, int i) const {
    return *reinterpret_cast<const T*>(values + in[step * stride + static_cast<std::size_t>(i)]);
  }
  template <typename T>
  T& out_value(std::size_t step) const {
    return reinterpret_cast<T*>(out)[step];
  }
  template <typename K>
  const K& kernel_as() const {
    return *static_cast<const K*>(kernel);
  }
};

// Slot types agree between views: points are written as PointsView and read as ConstPointsView.
static_assert(sizeof(PointsView) == sizeof(ConstPointsView));

using ComputeFn = void (*)(ComputeContext&);
// Returns which lazy inputs to evaluate: bit i for the i-th in the order of declaration. Every element of a
// lazy array counts, but a lazy_together array counts as one; there are 64 at most. Sees eager inputs only,
// may write its state.
using DecideFn = std::uint64_t (*)(ComputeContext&);
// The same step of several evaluators at once (blocks of frames); same results as one by one. None of them
// has chosen a lazy input. All contexts share one scratch, of the size that bind asked for.
using ComputeBlockFn = void (*)(ComputeContext* contexts, std::size_t count);
// Several steps of one evaluator at once; gives the bytes that their computes give one by one. Cannot fail.
using ComputeBatchFn = void (*)(const BatchContext&);

}  // namespace kpsa::engine
