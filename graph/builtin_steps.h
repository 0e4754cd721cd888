// Computes of the steps that the compiler inserts by itself. Internal to graph/.
#pragma once

#include <cstdint>
#include <vector>

#include "base/types.h"
#include "graph/compute_context.h"

namespace kpsa::engine {

// Of a number, toward zero; 0 where that is beyond 64 bits, or no number.
inline std::int64_t WholeNumber(double v) {
  return v > -9.2e18 && v < 9.2e18 ? static_cast<std::int64_t>(v) : 0;
}

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
void ComputeDoubleToInt(ComputeContext& context);  // WholeNumber
void ComputeDoubleToBool(ComputeContext& context);
void ComputeIntToBool(ComputeContext& context);

}  // namespace kpsa::engine
