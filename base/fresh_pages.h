// Fresh memory costs a fault for each of its pages when it is first touched: 1 to 2 us on a virtual machine, more than
// what is written into it. A hint to the system gives many pages at once, and large ones where whole ones fit. Hints change
// nothing that the program sees, and never fail.
#pragma once

#include <cstddef>

namespace kpsa::engine {

inline constexpr std::size_t kLargePage = std::size_t{2} << 20;

// Where memory of so many bytes should begin, a power of two of at least 64.
std::size_t AlignmentFor(std::size_t bytes);
// For memory that is written bit by bit, and read here and there: large pages as they are touched. Where rows far apart are
// read, these spare most of the misses of the TLB.
void PreferLargePages(void* begin, std::size_t bytes);
// For memory that is about to be written as a whole: all pages at once, of whatever size they are.
void TouchPages(void* begin, std::size_t bytes);
// Both: large pages where they fit, at once.
void FetchPages(void* begin, std::size_t bytes);

}  // namespace kpsa::engine
