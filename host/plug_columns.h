// Plugs as columns of numbers, for tables over time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graph/evaluator.h"
#include "host/mesh_stage.h"
#include "kpsa/kpsa_node.h"

namespace kpsa::engine {

// A plug and the numbers that it gives each frame.
struct Column {
  std::string name;
  WantedPlug wanted;
  Type type = Type::kDouble;
  double factor = 1;  // from the runtime's unit to the file's
  std::string unit;
  Index output = kNoIndex;  // of the plan; kNoIndex: `text` is its constant value
  std::string text;
  std::vector<std::string> suffixes;  // one a number
  Index points = 0;                   // of a points plug
  // Of a KPSA node's missReason, which is told in words: the node's config, and its output offender.
  std::shared_ptr<const KpsaConfig> config;
  Index offender = kNoIndex;

  std::string Words(const Evaluator& evaluator) const;
  void Read(const Evaluator& evaluator, std::vector<double>* numbers) const;
};

// The columns that the plugs give, and the request that evaluates them. Errors: those of FindWanted; an array
// without an element.
Result<std::vector<Column>> FindColumns(const Rig& rig, const std::vector<std::string>& plugs,
                                        Request* request);
// Fills in what the plan knows: numbers of points, and the suffixes.
void CompleteColumn(const Plan& plan, Column* column);

}  // namespace kpsa::engine
