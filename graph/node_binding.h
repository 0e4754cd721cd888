// Point demand and kernel binding of one instance: which points of its inputs an output set needs, and the
// kernel for exactly those sets. Internal to graph/.
#pragma once

#include <vector>

#include "graph/structural_view.h"

namespace kpsa::engine {

// Point sets by input (Instance::inputs) and by output (position, element), of points plugs only.
struct InstanceSets {
  std::vector<PointSet> inputs;
  std::vector<std::vector<PointSet>> outputs;
  std::vector<bool> skipped;  // by input: not needed for these outputs; empty: all are
};

// Points of an output's array: from the definition, or as many as the first points input.
class PointTotals {
 public:
  PointTotals(InstanceTable& table, StaticValues& statics) : table_(table), statics_(statics) {}
  Result<Index> OfSource(const Source& source);
  Result<Index> OfOutput(Index instance, int position, int element);

 private:
  InstanceTable& table_;
  StaticValues& statics_;
  std::vector<std::vector<std::vector<Index>>>
      memo_;  // by instance, position, element; kNoIndex: not known yet
};

// All points of every points output.
Result<InstanceSets> FullOutputs(InstanceTable& table, PointTotals& totals, Index instance);
// Fills sets.inputs from sets.outputs.
Status FillDemand(InstanceTable& table, PointTotals& totals, StaticValues& statics, Index instance,
                  InstanceSets* sets);
// Of an assembly of points: an error if a child is driven that the array of `count` points does not have.
Status CheckChildren(const InstanceTable& table, const Instance& instance, std::size_t count);
Result<BoundKernel> Bind(InstanceTable& table, StaticValues& statics, Index instance,
                         const InstanceSets& sets);
// "node "mush" (deltaMush)"
std::string Describe(const InstanceTable& table, const Instance& instance);

}  // namespace kpsa::engine
