#include "kpsa/binomial.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/check.h"

namespace kpsa::engine {
namespace {

constexpr double kNegligible = 1e-17;  // of a sum: a term that ends it

// ln i!, by Stirling's series where it is exact to double precision. (std::lgamma writes a global variable.)
double LogFactorial(double i) {
  if (i < 32) {
    double product = 1;
    for (double f = 2; f <= i; ++f) product *= f;
    return std::log(product);
  }
  const double square = i * i;
  const double rest = (1.0 / 12 - (1.0 / 360 - (1.0 / 1260 - 1.0 / (1680 * square)) / square) / square) / i;
  return (i + 0.5) * std::log(i) - i + 0.5 * std::log(2 * std::numbers::pi) + rest;
}

// P(X = k) of X ~ Bin(n, p), 0 < p < 1.
double Probability(double k, double n, double p) {
  const double ways = LogFactorial(n) - LogFactorial(k) - LogFactorial(n - k);
  return std::exp(ways + k * std::log(p) + (n - k) * std::log1p(-p));
}

// P(X <= k), 0 <= k < n. Of the two tails the one is summed whose terms fall from k on: they soon are
// negligible.
double Cumulative(double k, double n, double p) {
  const double odds = p / (1 - p);
  double sum = 0;
  if (k < n * p) {
    for (double i = k, term = Probability(k, n, p); i >= 0 && term > kNegligible * sum; --i) {
      sum += term;
      term *= i / (n - i + 1) / odds;
    }
    return sum;
  }
  for (double i = k + 1, term = Probability(i, n, p); i <= n && term > kNegligible * sum; ++i) {
    sum += term;
    term *= (n - i) / (i + 1) * odds;
  }
  return 1 - sum;
}

}  // namespace

double BinomialUpperBound(std::size_t k, std::size_t n, double confidence) {
  KPSA_CHECK(confidence > 0 && confidence < 1);
  if (k >= n) return 1;
  const auto successes = static_cast<double>(k), count = static_cast<double>(n);
  // P(X <= k) falls as p grows: halve until no number lies between
  double lo = successes / count, hi = 1;
  for (;;) {
    const double middle = lo + (hi - lo) / 2;
    if (middle <= lo || middle >= hi) return hi;
    (Cumulative(successes, count, middle) <= 1 - confidence ? hi : lo) = middle;
  }
}

double BinomialLowerBound(std::size_t k, std::size_t n, double confidence) {
  // Of those that are not among the k of n, the other bound
  return 1 - BinomialUpperBound(n - std::min(k, n), n, confidence);
}

}  // namespace kpsa::engine
