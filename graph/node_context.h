// A compute's inputs and outputs by name. The list of a NodeContext is what the compute reads and writes:
//
//   using MixContext = NodeContext<In<"a", double>, In<"weights", ArrayView<double>>, Out<"output", double>>;
//   void ComputeMix(MixContext c) { c.out<"output">() = c.get<"a">() * c.get<"weights">()[0]; }
//
//   registry.add("mix", "...").in("a", 0.0).in("weights", 1.0).array().out("output", Type::kDouble)
//       .compute<ComputeMix>();
//
// Names, types and shapes are held against the declaration when the type is registered; a name that is not in
// the list does not compile. While compiling, a name becomes a place in the list, which is the place of the
// value in the group's table: reading by name costs what reading by a number costs.
//
// T of an input: bool, std::int64_t (int), a scoped enum, double, Double3, Quaternion, Matrix4, ConstPointsView
// (points, colors, weights), ArrayView of one of these (elements of bool, int and enum are std::int64_t).
// T of an output: bool, std::int64_t, double, Double3, Quaternion, Matrix4, PointsView, OutArray of one of these.
// What is an array of one element a geometry is, in a group of one step a geometry, that element.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "graph/compute_signature.h"

namespace kpsa::engine {

// A text as a template argument.
template <std::size_t kSize>
struct FixedName {
  consteval FixedName(const char (&text)[kSize]) {
    std::copy_n(text, kSize, characters);
  }  // NOLINT: implicit
  constexpr std::string_view view() const { return {characters, kSize - 1}; }
  char characters[kSize] = {};
};

template <FixedName kName, typename T>
struct In {
  using Parameter = T;
  static constexpr Port kPort{kName.view(), ParameterOf<T>::value, true};
};
template <FixedName kName, typename T>
struct Out {
  using Parameter = T;
  static constexpr Port kPort{kName.view(), OutputSlot<T>::value, false};
};

// A name's place in a list, or -1; and that place among the inputs, or the outputs.
constexpr int PlaceOf(std::span<const Port> ports, std::string_view name, bool input) {
  for (std::size_t i = 0; i < ports.size(); ++i) {
    if (ports[i].input == input && ports[i].name == name) return static_cast<int>(i);
  }
  return -1;
}
constexpr int PositionOf(std::span<const Port> ports, int place) {
  int position = 0;
  for (int i = 0; i < place; ++i)
    position += ports[static_cast<std::size_t>(i)].input == ports[static_cast<std::size_t>(place)].input;
  return position;
}
constexpr bool NamesDiffer(std::span<const Port> ports) {
  for (std::size_t i = 0; i < ports.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (ports[i].name == ports[j].name) return false;
    }
  }
  return true;
}
template <int kPlace, typename... Ports>
using ParameterAt = typename std::tuple_element_t<static_cast<std::size_t>(kPlace < 0 ? 0 : kPlace),
                                                  std::tuple<Ports...>>::Parameter;

template <typename... Ports>
class NodeContext {
 public:
  static constexpr std::array<Port, sizeof...(Ports)> kPorts{Ports::kPort...};
  static_assert(NamesDiffer(kPorts), "a name is in the context's list twice");

  explicit NodeContext(ComputeContext& context) : context_(&context) {}
  // Of a list that begins as this one.
  template <typename... More>
  NodeContext(const NodeContext<Ports..., More...>& other)
      : context_(&other.context()) {}  // NOLINT: implicit

  // An input: bools, integers and enums by value, ArrayView by value, all else by reference.
  template <FixedName kName>
  decltype(auto) get() const {
    constexpr int kPlace = PlaceOf(kPorts, kName.view(), true);
    static_assert(kPlace >= 0, "no input of this name is in the context's list");
    constexpr int kPosition = PositionOf(kPorts, kPlace);
    return ArgumentOf<ParameterAt<kPlace, Ports...>>::Get(*context_, kPosition);
  }
  // An output, to be written: a reference to its slot (of bools: std::int64_t), the view of its points, or an
  // OutArray.
  template <FixedName kName>
  decltype(auto) out() const {
    constexpr int kPlace = PlaceOf(kPorts, kName.view(), false);
    static_assert(kPlace >= 0, "no output of this name is in the context's list");
    constexpr int kPosition = PositionOf(kPorts, kPlace);
    return OutputSlot<ParameterAt<kPlace, Ports...>>::Get(*context_, kPosition);
  }
  template <typename K>
  const K& kernel_as() const {
    return context_->kernel_as<K>();
  }
  template <typename S>
  S& state_as() const {
    return context_->state_as<S>();
  }
  float* scratch() const { return context_->scratch; }
  std::byte* state() const { return context_->state; }
  void Fail(std::string_view message) const { context_->host->Fail(message); }
  void For(std::size_t count, std::size_t grain, RangeBody body) const {
    context_->host->For(count, grain, body);
  }
  // All else.
  ComputeContext& context() const { return *context_; }

 private:
  ComputeContext* context_;
};

// The same of a batch: small values, of which `get` and `out` take the step.
template <typename... Ports>
class NodeBatch {
 public:
  static constexpr std::array<Port, sizeof...(Ports)> kPorts{Ports::kPort...};
  static_assert(NamesDiffer(kPorts), "a name is in the context's list twice");

  explicit NodeBatch(const BatchContext& context) : context_(&context) {}
  template <FixedName kName>
  const auto& get(std::size_t step) const {
    constexpr int kPlace = PlaceOf(kPorts, kName.view(), true);
    static_assert(kPlace >= 0, "no input of this name is in the context's list");
    constexpr int kPosition = PositionOf(kPorts, kPlace);
    using T = ParameterAt<kPlace, Ports...>;
    static_assert(!std::is_enum_v<T>, "a batch reads no enums");
    return context_->get<std::conditional_t<std::is_integral_v<T>, std::int64_t, T>>(step, kPosition);
  }
  template <FixedName kName>
  auto& out(std::size_t step) const {
    constexpr int kPlace = PlaceOf(kPorts, kName.view(), false);
    static_assert(kPlace >= 0, "no output of this name is in the context's list");
    using T = ParameterAt<kPlace, Ports...>;
    return context_->out_value<std::conditional_t<std::is_integral_v<T>, std::int64_t, T>>(step);
  }
  template <typename K>
  const K& kernel_as() const {
    return context_->kernel_as<K>();
  }
  std::size_t count() const { return context_->count; }  // steps

 private:
  const BatchContext* context_;
};

// The context that a function takes.
template <typename F>
struct ContextOfFunction {
  static_assert(sizeof(F) == 0, "expected the name of a function that takes a NodeContext, or a NodeBatch");
};
template <typename R, typename Context>
struct ContextOfFunction<R (*)(Context)> {
  using Type = Context;
};
template <typename F>
using ContextOf = typename ContextOfFunction<F>::Type;

}  // namespace kpsa::engine
