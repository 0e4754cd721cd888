// Exact (Clopper-Pearson) bounds on a share of which a sample shows k of n. They are conservative: whatever
// the true share, a bound holds in at least `confidence` of all samples. One-sided; a two-sided interval of
// 95 % has the two bounds of 97.5 %. k above n counts as n; confidence within (0, 1).
#pragma once

#include <cstddef>

namespace kpsa::engine {

// The smallest share p in which k or fewer of n have a probability of 1 - confidence at most; 1 where k is n.
double BinomialUpperBound(std::size_t k, std::size_t n, double confidence);
// The largest share p in which k or more of n have a probability of 1 - confidence at most; 0 where k is 0.
double BinomialLowerBound(std::size_t k, std::size_t n, double confidence);

}  // namespace kpsa::engine
