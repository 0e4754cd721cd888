#include "graph/plan.h"

namespace kpsa::engine {

Index Plan::FindVarying(const PlugRef& plug) const {
  for (Index v = 0; v < varying_.size(); ++v) {
    const PlugRef& p = varying_[v].plug;
    // Of points that are no array, an element is one of them
    const bool points = p.element < 0 && IsPointType(varying_[v].type);
    if (p.node == plug.node && p.attribute == plug.attribute && (p.element == plug.element || points))
      return v;
  }
  return kNoIndex;
}

PlugHandle Plan::Handle(const PlugRef& plug) const {
  const Index varying = FindVarying(plug);
  if (varying == kNoIndex) return {};
  const bool one = plug.component >= 0;
  if (IsPointType(varying_[varying].type) && (one || plug.element != varying_[varying].plug.element))
    return {};
  return {varying, plug.component, one ? Type::kDouble : varying_[varying].type};
}

std::size_t Plan::AddNeeds(Index producer, std::span<std::uint64_t> bits, std::vector<Index>* stack) const {
  std::size_t visited = 0;
  const auto need = [&](Index step) {
    if (step >= steps_.size()) return;
    const std::uint64_t bit = std::uint64_t{1} << (step % 64);
    if ((bits[step / 64] & bit) != 0) return;
    bits[step / 64] |= bit;
    stack->push_back(step);
  };
  need(producer);
  for (; !stack->empty(); ++visited) {
    const Index top = stack->back();
    stack->pop_back();
    const Step& step = steps_[top];
    for (Index d = 0; d < step.deps_count; ++d) need(deps_[step.deps + d]);
    if (step.branch != kNoIndex) {
      for (const Index lazy : branches_[step.branch].lazy_deps) need(lazy);
    }
    // A unit runs as a whole
    const Index first = top - step.unit_offset;
    for (Index member = first; member < first + steps_[first].unit_size; ++member) need(member);
  }
  return visited;
}

std::size_t Plan::MemoryBytes() const {
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  std::size_t total = sizeof(*this) + bytes(steps_) + bytes(tables_) + bytes(deps_) + bytes(consumers_) +
                      bytes(consumer_offsets_) + bytes(branches_) + bytes(batches_) + bytes(segments_) +
                      bytes(buffers_) + bytes(varying_) + bytes(outputs_) + bytes(infos_) +
                      bytes(initial_values_) + bytes(owned_) + bytes(closures_) + text_.capacity();
  for (const auto& ranges : closures_) total += bytes(ranges);
  for (const std::vector<std::uint64_t>& bits : needs_) total += bytes(bits) + sizeof(bits);
  for (const Segment& segment : segments_) total += bytes(segment.levels);
  return total;
}

}  // namespace kpsa::engine
