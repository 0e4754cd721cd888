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

std::size_t Plan::MemoryBytes() const {
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  std::size_t total = sizeof(*this) + bytes(steps_) + bytes(tables_) + bytes(deps_) + bytes(consumers_) +
                      bytes(consumer_offsets_) + bytes(branches_) + bytes(batches_) + bytes(segments_) +
                      bytes(buffers_) + bytes(varying_) + bytes(outputs_) + bytes(infos_) +
                      bytes(initial_values_) + bytes(owned_) + bytes(closures_) + text_.capacity();
  for (const auto& ranges : closures_) total += bytes(ranges);
  for (const Segment& segment : segments_) total += bytes(segment.levels);
  return total;
}

}  // namespace kpsa::engine
