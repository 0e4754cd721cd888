#include "graph/static_eval.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/cancel.h"
#include "base/check.h"
#include "graph/authored.h"
#include "graph/step_shape.h"
#include "graph/structural_view.h"

namespace kpsa::engine {
namespace {

// A host for computations while compiling: serial, errors kept.
class StaticHost final : public ComputeHost {
 public:
  void Fail(std::string_view message) override { error = message; }
  void For(std::size_t count, std::size_t, RangeBody body) override { body(0, count); }
  void Check(const SlotAccess& access) const override { shape.Check(access); }
  StepShape shape;
  std::string error;
};

// Lays out slots for one run.
class Arena {
 public:
  std::uint32_t Add(std::size_t size) {
    const std::size_t at = bytes_.size() * 8;
    bytes_.resize(bytes_.size() + (size + 7) / 8);
    return static_cast<std::uint32_t>(at);
  }
  std::byte* data() { return reinterpret_cast<std::byte*>(bytes_.data()); }

 private:
  std::vector<std::uint64_t> bytes_;
};

}  // namespace

PointBuffer GatherPoints(ConstPointsView from, int components, const PointSet& set) {
  PointBuffer buffer(set.size(), components);
  const PointsView to = buffer.view();
  for (Index i = 0; i < set.size(); ++i) {
    to.x[i] = from.x[set[i]];
    if (components == 3) {
      to.y[i] = from.y[set[i]];
      to.z[i] = from.z[set[i]];
    }
  }
  return buffer;
}

Value AssembleValue(const Value& whole, const std::vector<int>& children,
                    const std::vector<const Value*>& parts) {
  if (whole.points() != nullptr) {
    auto buffer = std::make_shared<PointBuffer>(*whole.points());
    const PointsView view = buffer->view();
    for (std::size_t i = 0; i < children.size(); ++i) {
      const auto point = static_cast<std::size_t>(children[i] / 4);
      if (point >= view.count) continue;
      const int component = children[i] % 4;
      float* components[3] = {view.x, view.y, view.z};
      for (int c = 0; c < buffer->components(); ++c) {
        if (component != 3 && component != c) continue;
        components[c][point] = static_cast<float>(
            component == 3 && buffer->components() == 3 ? parts[i]->get<Double3>()[c] : parts[i]->AsDouble());
      }
    }
    return Value(PointBufferPtr(buffer));
  }
  std::byte slot[sizeof(Matrix4)];
  const Type type = whole.get_if<Double3>() != nullptr ? Type::kDouble3 : Type::kQuaternion;
  whole.WriteSlot(type, slot);
  for (std::size_t i = 0; i < children.size(); ++i) {
    const double v = parts[i]->AsDouble();
    std::memcpy(slot + 8 * (children[i] % 4), &v, 8);
  }
  return Value::ReadSlot(type, slot);
}

std::shared_ptr<const StaticEvaluator::Outputs>& StaticEvaluator::slot(Index instance, bool rest) {
  auto& memo = memo_[rest ? 1 : 0];
  if (memo.size() < table_.instances().size()) memo.resize(table_.instances().size());
  return memo[instance];
}

const Value* StaticEvaluator::Ready(const Source& source, bool rest) {
  if (source.kind != Source::Kind::kInstance) return source.value;
  const auto& outputs = slot(source.instance, rest);
  if (outputs == nullptr) return nullptr;
  const Value* value =
      &(*outputs)[static_cast<std::size_t>(source.output)][static_cast<std::size_t>(source.element)];
  if (source.component < 0) return value;
  std::byte bytes[sizeof(Matrix4)];
  value->WriteSlot(value->get_if<Double3>() != nullptr ? Type::kDouble3 : Type::kQuaternion, bytes);
  taken_.push_back(std::make_unique<Value>(Value::ReadSlot(Type::kDouble, bytes + 8 * source.component)));
  return taken_.back().get();
}

const Value* StaticEvaluator::Get(const Source& source, bool rest) {
  if (!status_.ok()) {
    told_ = true;  // whatever is asked for now, it has not failed
    return nullptr;
  }
  if (const Value* value = Ready(source, rest)) return value;
  // What is missing, consumers before sources
  std::vector<Index> missing{source.instance};
  std::vector<bool>& opened = opened_[rest ? 1 : 0];
  opened.resize(table_.instances().size(), false);
  while (!missing.empty()) {
    const Index top = missing.back();
    if (slot(top, rest) != nullptr) {
      missing.pop_back();
      continue;
    }
    if (!opened[top]) {
      opened[top] = true;
      const Instance& instance = table_.instances()[top];
      const auto need = [&](const Source& s) {
        if (s.kind == Source::Kind::kInstance && slot(s.instance, rest) == nullptr)
          missing.push_back(s.instance);
      };
      for (const Input& input : instance.inputs) need(rest ? input.rest : input.source);
      for (const StructuralInput& input : instance.structural) need(input.source);
      continue;
    }
    missing.pop_back();
    Status status = Run(top, rest);
    if (!status.ok()) {
      if (status_.ok()) status_ = std::move(status);
      return nullptr;
    }
  }
  return Ready(source, rest);
}

void StaticEvaluator::TellOfFailure(const std::string& plug) {
  if (std::exchange(told_, true) || status_.ok()) return;
  Status told;
  for (Error error : status_.errors()) {
    error.message += fmt::format("; it drives {}", plug);
    told.Add(std::move(error));
  }
  status_ = std::move(told);
}

bool StaticEvaluator::Touches(Index number, const PointSet& points) {
  std::optional<bool>* const known = touch_memo_ ? &touch_memo_(number, points) : nullptr;
  if (known != nullptr && known->has_value()) return **known;
  const Instance& instance = table_.instances()[number];
  const StructuralView view(table_, instance.node, instance.geometry, &instance, this);
  const bool touches =
      CallAuthored(table_, instance.node, [&] { return table_.group(instance).touches(view, points); });
  if (known != nullptr && status_.ok()) *known = touches;
  return touches;
}

Status StaticEvaluator::Run(Index number, bool rest) {
  ++evaluated_;
  const Instance& instance = table_.instances()[number];
  std::vector<const Value*> values;
  for (const Input& input : instance.inputs) {
    values.push_back(Ready(rest ? input.rest : input.source, rest));
    if (values.back() == nullptr)
      return Status::Invalid("{}: an input has no value", Describe(table_, instance))
          .OfNode(table_.graph().name(instance.node));
  }
  auto outputs = std::make_shared<Outputs>();
  if (instance.kind == Instance::Kind::kConvert) {
    const Value& v = *values[0];
    Value converted = v.AsDouble();
    if (instance.type == Type::kBool) converted = Value(v.AsDouble() != 0);
    if (instance.type == Type::kInt || instance.type == Type::kEnum) converted = Value(v.AsInt());
    outputs->push_back({converted});
    slot(number, rest) = outputs;
    return Status();
  }
  if (instance.kind == Instance::Kind::kAssemble) {
    if (values[0]->points() != nullptr)
      KPSA_RETURN_IF_ERROR(CheckChildren(table_, instance, values[0]->points()->count()));
    outputs->push_back({AssembleValue(*values[0], instance.children, {values.begin() + 1, values.end()})});
    slot(number, rest) = outputs;
    return Status();
  }

  // Bind to all points and lay out the slots
  Result<InstanceSets> sets = FullOutputs(table_, totals_, number);
  if (!sets.ok()) return sets.status();
  KPSA_RETURN_IF_ERROR(FillDemand(table_, totals_, *this, number, &*sets));
  Result<BoundKernel> kernel = binder_ ? binder_(number, *sets) : Bind(table_, *this, number, *sets);
  if (!kernel.ok()) return kernel.status();
  const ComputeGroup& group = table_.group(instance);
  Arena arena;
  std::vector<std::uint32_t> input_slots, in(group.inputs.size()), out(group.outputs.size());
  std::vector<std::vector<std::uint32_t>> output_slots;
  for (const Input& input : instance.inputs) input_slots.push_back(arena.Add(SlotSize(input.source.type)));
  std::size_t at = 0;
  for (std::size_t p = 0; p < group.inputs.size(); ++p) {
    const AttributeDef& a = table_.input_def(instance, static_cast<int>(p));
    const bool one = !a.array || (a.per_geometry && group.per_geometry);
    const auto count = static_cast<std::size_t>(instance.array_sizes[p]);
    if (one) {
      in[p] = input_slots[at];
    } else {
      in[p] = static_cast<std::uint32_t>(in.size());
      in.push_back(static_cast<std::uint32_t>(count));
      in.insert(in.end(), input_slots.begin() + static_cast<std::ptrdiff_t>(at),
                input_slots.begin() + static_cast<std::ptrdiff_t>(at + count));
    }
    at += count;
  }
  for (std::size_t p = 0; p < group.outputs.size(); ++p) {
    const AttributeDef& a = table_.output_def(instance, static_cast<int>(p));
    output_slots.emplace_back();
    for (int e = 0; e < instance.output_sizes[p]; ++e)
      output_slots.back().push_back(arena.Add(SlotSize(a.type)));
    if (!a.array || group.per_geometry) {
      out[p] = output_slots.back()[0];
    } else {
      out[p] = static_cast<std::uint32_t>(out.size());
      out.push_back(static_cast<std::uint32_t>(instance.output_sizes[p]));
      out.insert(out.end(), output_slots.back().begin(), output_slots.back().end());
    }
  }

  // Fill the inputs, run, and take the outputs
  std::vector<PointBuffer> buffers;
  buffers.reserve(instance.inputs.size() + 64);
  std::vector<std::shared_ptr<PointBuffer>> made;
  for (std::size_t i = 0; i < instance.inputs.size(); ++i) {
    const Type type = instance.inputs[i].source.type;
    if (!IsPointType(type)) {
      values[i]->WriteSlot(type, arena.data() + input_slots[i]);
      continue;
    }
    KPSA_CHECK(values[i]->points() != nullptr);
    ConstPointsView view = values[i]->points()->view();
    if (!sets->inputs[i].is_all()) {
      buffers.push_back(GatherPoints(view, PointComponents(type), sets->inputs[i]));
      view = std::as_const(buffers.back()).view();
    }
    std::memcpy(arena.data() + input_slots[i], &view, sizeof(view));
  }
  for (std::size_t p = 0; p < group.outputs.size(); ++p) {
    const Type type = table_.OutputType(instance, static_cast<int>(p));
    for (std::size_t e = 0; e < output_slots[p].size() && IsPointType(type); ++e) {
      made.push_back(std::make_shared<PointBuffer>(sets->outputs[p][e].size(), PointComponents(type)));
      const PointsView view = made.back()->view();
      std::memcpy(arena.data() + output_slots[p][e], &view, sizeof(view));
    }
  }
  AlignedFloats scratch(kernel->scratch_floats), state((kernel->state_bytes + 3) / 4);
  StaticHost host;
  host.shape = StepShape::Of(table_.graph().def(instance.node), group);
  ComputeContext context;
  context.values = arena.data();
  context.in = in.data();
  context.out = out.data();
  context.kernel = kernel->object.get();
  context.scratch = scratch.data();
  context.state = reinterpret_cast<std::byte*>(state.data());
  context.host = &host;
  context.at_rest = rest;
  try {
    if (group.decide != nullptr) context.chosen = group.decide(context);
    if (host.error.empty()) (kernel->compute != nullptr ? kernel->compute : group.compute)(context);
  } catch (const Cancelled&) {  // on to whoever compiles
    throw;
  } catch (...) {
    host.Fail(ThrownByStep(&host.shape, context));
  }
  if (!host.error.empty())
    return Status::Evaluation("{}: {}", Describe(table_, instance), host.error)
        .OfNode(table_.graph().name(instance.node));
  std::size_t next = 0;
  for (std::size_t p = 0; p < group.outputs.size(); ++p) {
    const Type type = table_.OutputType(instance, static_cast<int>(p));
    outputs->emplace_back();
    for (std::uint32_t slot_at : output_slots[p]) {
      outputs->back().push_back(IsPointType(type) ? Value(PointBufferPtr(made[next++]))
                                                  : Value::ReadSlot(type, arena.data() + slot_at));
    }
  }
  slot(number, rest) = outputs;
  return Status();
}

}  // namespace kpsa::engine
