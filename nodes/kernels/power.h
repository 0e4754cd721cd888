// x^y with the same bits everywhere.
#pragma once

namespace kpsa::engine {

// Whole y up to 64 by multiplication, otherwise by exp and log; NaN for other powers of negative numbers.
double Power(double x, double y);

}  // namespace kpsa::engine
