#include "nodes/kernels/power.h"

#include <cmath>

#include "base/scalar_math.h"

namespace kpsa::engine {

double Power(double x, double y) {
  if (y == std::floor(y) && std::fabs(y) <= 64) {
    double result = 1;
    for (int i = 0; i < static_cast<int>(std::fabs(y)); ++i) result *= x;
    return y < 0 ? 1 / result : result;
  }
  if (x == 0 && y > 0) return 0;
  return x > 0 ? Exp(y * Log(x)) : std::nan("");
}

}  // namespace kpsa::engine
