// Fresh memory costs a fault for each of its pages when it is first touched: 1 to 2 us on a virtual machine, more than
// what is written into it. A hint to the system gives many pages at once, and large ones where whole ones fit.
#pragma once

#include <cstddef>

namespace kpsa::engine {

inline constexpr std::size_t kLargePage = std::size_t{2} << 20;

// Where memory of so many bytes should begin, a power of two of at least 64.
std::size_t AlignmentFor(std::size_t bytes);
// For memory that is about to be written as a whole. Changes nothing that the program sees; never fails.
void FetchPages(void* begin, std::size_t bytes);

}  // namespace kpsa::engine
