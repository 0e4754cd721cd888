// The words in which a node type is declared. A utility node needs five lines:
//
//   registry.add("remapValue", "Maps a value from one range to another.")
//       .in("inputValue", 0.0).in("inputMin", 0.0).in("inputMax", 1.0)
//       .out("outValue", Type::kDouble)
//       .compute([](double value, double lo, double hi) { return (value - lo) / (hi - lo); });
//
// compute() of a captureless function takes its inputs in the order of declaration (structural ones left out)
// and returns the one output: bool, std::int64_t or any integer (int, enum), a scoped enum (enum), double,
// Double3, Quaternion, const Matrix4&, ConstPointsView, ArrayView<T>. Number and types are held against the
// declaration. What is more than that takes a NodeContext (graph/node_context.h), which names its inputs and
// outputs.
//
// Nothing here aborts: what is wrong with a declaration is noted in NodeDef::problems, one sentence each with
// node, attribute, what was expected and what was given; NodeRegistry::status() tells, and no graph takes
// such a type.
#pragma once

#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "graph/compute_signature.h"
#include "graph/node_context.h"
#include "graph/node_def.h"

namespace kpsa::engine {

struct AttributeOptions {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  Unit unit = Unit::kNone;
  std::string doc = {};
  bool diagnostic = false;
};

// A value of an enum attribute, and its name in rigs.
template <typename E>
struct Choice {
  const char* name;
  E value;
};

class NodeBuilder {
 public:
  explicit NodeBuilder(NodeDef* def) : def_(def) {}

  NodeBuilder& category(std::string name) {
    def_->category = std::move(name);
    return *this;
  }
  NodeBuilder& version(int number) {
    def_->version = number;
    return *this;
  }
  NodeBuilder& animation() {
    def_->animation = true;
    return *this;
  }
  NodeBuilder& stateful() {
    def_->stateful = true;
    return *this;
  }
  NodeBuilder& prototype() {
    def_->prototype = true;
    return *this;
  }
  NodeBuilder& last_step(LastStepFn fn) {
    def_->last_step = std::move(fn);
    return *this;
  }
  NodeBuilder& passes_points() {
    def_->passes_points = true;
    return *this;
  }

  // An animatable input; its type follows from the default (bool, int, double, Double3, Quaternion, Matrix4).
  NodeBuilder& in(std::string name, Value default_value, AttributeOptions options = {});
  template <typename T>
  requires std::is_same_v<T, bool>  // a Value does not tell a bool from an int
      NodeBuilder& in(std::string name, T default_value, AttributeOptions options = {}) {
    in(std::move(name), Value(default_value), std::move(options));
    attribute().type = Type::kBool;
    return *this;
  }
  // A structural input. The type is given where no default tells it.
  NodeBuilder& structural(std::string name, Value default_value, AttributeOptions options = {});
  NodeBuilder& structural(std::string name, Type type, AttributeOptions options = {});
  template <typename T>
  requires std::is_same_v<T, bool> NodeBuilder& structural(std::string name, T default_value,
                                                           AttributeOptions options = {}) {
    in(std::move(name), default_value, std::move(options));
    attribute().structural = true;
    return *this;
  }
  // An enum input, as a scoped enum whose values are 0, 1, 2, ... in this order; computes and
  // Structural::choice read it as that.
  template <typename E>
  requires std::is_enum_v<E> NodeBuilder& enumeration(std::string name,
                                                      std::initializer_list<Choice<E>> choices,
                                                      bool structural, std::string doc = {},
                                                      E default_choice = E{}) {
    std::vector<std::string> names;
    for (const Choice<E>& choice : choices) {
      if (static_cast<std::size_t>(choice.value) != names.size())
        problem(name, "its choices are not the values 0, 1, 2, ... of its enum in their order");
      names.emplace_back(choice.name);
    }
    enumeration(std::move(name), std::move(names), structural, std::move(doc),
                static_cast<int>(default_choice));
    attribute().choice = &typeid(E);
    return *this;
  }
  // The same by number; the default is the first name.
  NodeBuilder& enumeration(std::string name, std::vector<std::string> names, bool structural,
                           std::string doc = {}, int default_choice = 0);
  // A points, colors or weights input.
  NodeBuilder& points_in(std::string name, std::string doc = {}, Type type = Type::kPoints);
  NodeBuilder& out(std::string name, Type type, std::string doc = {});

  // Change the attribute that was declared last.
  NodeBuilder& array();
  NodeBuilder& per_geometry();  // implies array
  NodeBuilder& lazy(bool together = false);
  NodeBuilder& world_place();
  NodeBuilder& alias(std::string other_name);
  NodeBuilder& unit(Unit u) {
    attribute().unit = u;
    return *this;
  }
  NodeBuilder& doc(std::string text) {
    attribute().doc = std::move(text);
    return *this;
  }
  NodeBuilder& grid(std::string divisions_attribute);
  NodeBuilder& default_from(std::function<Value(const Structural&)> f);

  // Closes a group: computes the outputs that a function of a NodeContext names from the inputs that it names.
  template <auto kCompute>
  NodeBuilder& compute() {
    using Context = ContextOf<decltype(kCompute)>;
    return compute_ports([](ComputeContext& context) { kCompute(Context(context)); }, Context::kPorts);
  }
  NodeBuilder& compute_ports(ComputeFn f, std::span<const Port> ports);
  // Closes a group: computes all outputs that no group has yet, from all non-structural inputs.
  template <typename F>
  NodeBuilder& compute(F f) {
    return group_compute(Checked(f));
  }
  NodeBuilder& compute(ComputeFn f) { return group_compute({f, std::nullopt}); }
  // As compute, of the named outputs from the named inputs only.
  template <typename F>
  NodeBuilder& compute_for(std::vector<std::string> outputs, std::vector<std::string> inputs, F f) {
    if constexpr (std::is_convertible_v<F, ComputeFn>) {
      return group_for(std::move(outputs), std::move(inputs), {f, std::nullopt});
    } else {
      return group_for(std::move(outputs), std::move(inputs), Checked(f));
    }
  }

  // Change the group that was closed last.
  template <auto kDecide>  // a function of the compute's NodeContext, or of one that is its beginning
  NodeBuilder& decide() {
    using Context = ContextOf<decltype(kDecide)>;
    check_ports(Context::kPorts, "decide()");
    return decide([](ComputeContext& context) -> std::uint64_t { return kDecide(Context(context)); });
  }
  NodeBuilder& decide(DecideFn f) {
    group().decide = f;
    return *this;
  }
  NodeBuilder& block(ComputeBlockFn f) {
    group().compute_block = f;
    return *this;
  }
  // Many steps of the group run as one: `bind` (or null) makes its kernel of theirs, a function of a NodeBatch computes
  // all of them. Where it throws, they are computed one by one.
  template <auto kBatch>
  NodeBuilder& batch(BindBatchFn bind) {
    using Batch = ContextOf<decltype(kBatch)>;
    check_ports(Batch::kPorts, "batch()");
    return batch(std::move(bind), [](const BatchContext& context) { kBatch(Batch(context)); });
  }
  // The output equals `input`, bit for bit, while the inputs `held` hold their defaults: then plans do
  // without the step.
  NodeBuilder& passes(std::string_view input, const std::vector<std::string>& held);
  // Of the points of `input` that come out as the only output: readers of points that are not touched read
  // that input instead, and where no others are wanted, the node does not run. Null: it may touch any.
  NodeBuilder& touches(std::string_view input, TouchFn f);
  // A number that, while it is 0, lets the points of `touches` out as they came in: where it rests there and
  // cannot vary, the node does not run.
  NodeBuilder& strength(std::string_view input);
  NodeBuilder& demand(DemandFn f) {
    group().demand = std::move(f);
    return *this;
  }
  NodeBuilder& bind(BindFn f) {
    group().bind = std::move(f);
    return *this;
  }
  NodeBuilder& point_count(PointCountFn f) {
    group().point_count = std::move(f);
    return *this;
  }
  NodeBuilder& in_place(std::string_view input);
  // Of an input in the group that was closed last; -1, and a problem, if it has none of that name.
  int input_position(std::string_view input);
  NodeBuilder& cost(float ns, float ns_per_point) {
    group().cost_ns = ns;
    group().cost_ns_per_point = ns_per_point;
    return *this;
  }

 private:
  // A compute function, and what it says of its inputs and output; nothing of one that takes a
  // ComputeContext.
  struct CheckedCompute {
    ComputeFn function = nullptr;
    std::optional<ComputeSignature> signature;
  };
  template <typename F, typename R, typename... Args, std::size_t... I>
  static ComputeFn ThunkOf(std::index_sequence<I...>) {
    return [](ComputeContext& context) {
      const R result = F{}(ArgumentOf<std::decay_t<Args>>::Get(context, static_cast<int>(I))...);
      if constexpr (std::is_integral_v<R> || std::is_enum_v<R>) {
        context.out_slot<std::int64_t>(0) = static_cast<std::int64_t>(result);
      } else {
        context.out_slot<R>(0) = result;
      }
    };
  }
  template <typename F, typename R, typename... Args>
  static CheckedCompute CheckedAs(R (F::*)(Args...) const) {
    return {ThunkOf<F, R, Args...>(std::index_sequence_for<Args...>{}), SignatureOf<R, Args...>()};
  }
  template <typename F, typename R, typename... Args>
  static CheckedCompute CheckedAs(R (F::*)(Args...) const noexcept) {
    return {ThunkOf<F, R, Args...>(std::index_sequence_for<Args...>{}), SignatureOf<R, Args...>()};
  }
  template <typename F>
  static CheckedCompute Checked(F) {
    static_assert(!std::is_pointer_v<F>, "a function of a NodeContext is named: compute<F>()");
    static_assert(std::is_empty_v<F>, "compute must capture nothing: it may run on any thread");
    if constexpr (std::is_invocable_v<F, ComputeContext&>) {
      return {[](ComputeContext& context) { F{}(context); }, std::nullopt};
    } else {
      return CheckedAs(&F::operator());
    }
  }

  NodeBuilder& batch(BindBatchFn bind, ComputeBatchFn f);
  AttributeDef& attribute();  // the latest; a problem where there is none
  ComputeGroup& group();
  const AttributeDef& attribute_of(int number) const {
    return def_->attributes[static_cast<std::size_t>(number)];
  }
  NodeBuilder& add(AttributeDef attribute);
  NodeBuilder& group_compute(CheckedCompute compute);
  NodeBuilder& group_for(std::vector<std::string> outputs, std::vector<std::string> inputs,
                         CheckedCompute compute);
  void finish_group(const CheckedCompute& compute);
  void check_ports(std::span<const Port> ports, std::string_view word);
  bool one_output(std::string_view word);
  void problem(std::string_view attribute, std::string_view text);

  NodeDef* def_;
};

}  // namespace kpsa::engine
