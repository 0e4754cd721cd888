// Computes of the steps that the compiler inserts by itself. Internal to graph/.
#pragma once

#include <vector>

#include "base/types.h"
#include "graph/compute_context.h"

namespace kpsa::engine {

// Copies points: input 0 to output 0 through the positions of the kernel (a std::vector<Index>).
void ComputeGatherPoints(ComputeContext& context);
void ComputeGatherWeights(ComputeContext& context);

// Kernel of an assembly: `children` are (element in the output set * 4 + component), or -1 where the element
// is not in the set; component 3 means the whole double3.
struct AssembleKernel {
  std::vector<int> children;
  std::size_t value_size = 0;  // of small values
};
void ComputeAssembleSmall(ComputeContext& context);
void ComputeAssemblePoints(ComputeContext& context);

void ComputeIntToDouble(ComputeContext& context);
void ComputeDoubleToInt(ComputeContext& context);  // toward zero
void ComputeDoubleToBool(ComputeContext& context);
void ComputeIntToBool(ComputeContext& context);

}  // namespace kpsa::engine
