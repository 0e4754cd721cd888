// What the parameters and the result of a compute function say in C++, to be held against the attributes that
// a node declares (graph/node_builder.h). What no attribute can be is refused by the compiler; whether number
// and types agree is checked when the node type is registered.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <vector>

#include "base/points.h"
#include "base/types.h"
#include "graph/compute_context.h"
#include "graph/slot_kind.h"
#include "graph/value.h"

namespace kpsa::engine {

struct ComputeParameter {
  SlotKind kind = SlotKind::kOther;
  bool array = false;                      // ArrayView, OutArray
  const std::type_info* choice = nullptr;  // the scoped enum of kChoice
};

template <typename T>
constexpr ComputeParameter ParameterOfType(bool array) {
  if constexpr (std::is_enum_v<T>) {
    return {SlotKindOf<T>(), array, &typeid(T)};
  } else {
    return {SlotKindOf<T>(), array, nullptr};
  }
}

// A parameter as it is written: T, const T& or ArrayView<T>.
template <typename P>
struct ParameterOf {
  using Bare = std::remove_cv_t<std::remove_reference_t<P>>;
  static_assert(!std::is_reference_v<P> || std::is_const_v<std::remove_reference_t<P>>,
                "a compute reads its inputs: take them by value or by const reference");
  static constexpr ComputeParameter value = ParameterOfType<Bare>(false);
  static_assert(value.kind != SlotKind::kOther && !std::is_same_v<Bare, PointsView>,
                "no attribute is of this parameter's type: take bool, an integer, an enum, double, Double3, "
                "Quaternion, Matrix4, ConstPointsView, or an ArrayView of one of them");
};
template <typename T>
struct ParameterOf<ArrayView<T>> {
  static constexpr ComputeParameter value = ParameterOfType<T>(true);
  // Elements are read where they stand, eight bytes each at least
  static_assert(value.kind != SlotKind::kOther && (!std::is_integral_v<T> || sizeof(T) == 8) &&
                    !std::is_same_v<T, bool> && !std::is_enum_v<T> && !std::is_same_v<T, PointsView>,
                "no array attribute has elements of this type; those of bool, int and enum are std::int64_t");
};
template <typename T>
struct ParameterOf<const ArrayView<T>&> : ParameterOf<ArrayView<T>> {};

// How an input is read: T, const T& or ArrayView<T>, at a position of the group.
template <typename T>
struct ArgumentOf {
  static decltype(auto) Get(const ComputeContext& context, int i) {
    if constexpr (std::is_same_v<T, bool>) {
      return context.slot<std::int64_t>(i) != 0;
    } else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
      return static_cast<T>(context.slot<std::int64_t>(i));
    } else {
      return context.slot<T>(i);
    }
  }
};
template <typename T>
struct ArgumentOf<ArrayView<T>> {
  static ArrayView<T> Get(const ComputeContext& context, int i) { return context.slots<T>(i); }
};

// How an output is written: bools and integers as std::int64_t.
template <typename T>
struct OutputSlot {
  static constexpr ComputeParameter value = ParameterOfType<T>(false);
  static_assert(value.kind != SlotKind::kOther && value.kind != SlotKind::kChoice &&
                    !std::is_same_v<T, ConstPointsView>,
                "no output is of this type: write bool, an integer, double, Double3, Quaternion, Matrix4, "
                "PointsView, or an OutArray of one of them");
  static auto& Get(const ComputeContext& context, int i) {
    return context.out_slot<std::conditional_t<std::is_integral_v<T>, std::int64_t, T>>(i);
  }
};
template <typename T>
struct OutputSlot<OutArray<T>> {
  static constexpr ComputeParameter value = ParameterOfType<T>(true);
  static_assert(!std::is_integral_v<T> || std::is_same_v<T, std::int64_t>,
                "elements of bool and int are std::int64_t");
  static OutArray<T> Get(const ComputeContext& context, int i) { return context.out_slots<T>(i); }
};

struct ComputeSignature {
  std::vector<ComputeParameter> parameters;
  ComputeParameter result;
};

template <typename R, typename... Args>
ComputeSignature SignatureOf() {
  static_assert(!std::is_reference_v<R>, "a compute returns its output by value");
  static_assert(SlotKindOf<R>() != SlotKind::kOther && SlotKindOf<R>() != SlotKind::kPoints,
                "no output is of this type: return bool, an integer, an enum, double, Double3, Quaternion or "
                "Matrix4; points are written through a ComputeContext");
  return {{ParameterOf<Args>::value...}, ParameterOfType<R>(false)};
}

// One that a compute names (graph/node_context.h). The name lives as long as the program.
struct Port {
  std::string_view name;
  ComputeParameter parameter;
  bool input = true;
};

struct NodeDef;
struct ComputeGroup;

// What is wrong with a function of this signature for that group of `def`, a sentence each; nothing if it
// fits.
std::vector<std::string> SignatureProblems(const NodeDef& def, const ComputeGroup& group,
                                           const ComputeSignature& signature);
// The group of these ports: those of them that fit, in their order. What is wrong with the others is added.
ComputeGroup GroupOf(const NodeDef& def, std::span<const Port> ports, std::vector<std::string>* problems);
// What is wrong with ports that `word` (of "decide()") finds at the places of a group: its inputs and outputs,
// or the first of each.
std::vector<std::string> PortProblems(const NodeDef& def, const ComputeGroup& group,
                                      std::span<const Port> ports, std::string_view word);

}  // namespace kpsa::engine
