#include "base/scalar_math.h"

#include <cmath>
#include <cstdint>
#include <cstring>

namespace kpsa::engine {
namespace {

// pi/2 in three parts; the first two have trailing zero bits, so that k * part is exact for |k| < 2^20.
constexpr double kHalfPi1 = 1.57079632673412561417e+00;
constexpr double kHalfPi2 = 6.07710050630396597660e-11;
constexpr double kHalfPi3 = 2.02226624879595063154e-21;

// Taylor series on [-pi/4, pi/4]; the first term left out is below 1e-17.
double SinSeries(double r) {
  const double q = r * r;
  double s = -1.0 / 1307674368000.0;
  s = s * q + 1.0 / 6227020800.0;
  s = s * q - 1.0 / 39916800.0;
  s = s * q + 1.0 / 362880.0;
  s = s * q - 1.0 / 5040.0;
  s = s * q + 1.0 / 120.0;
  s = s * q - 1.0 / 6.0;
  return r + r * q * s;
}

double CosSeries(double r) {
  const double q = r * r;
  double c = 1.0 / 20922789888000.0;
  c = c * q - 1.0 / 87178291200.0;
  c = c * q + 1.0 / 479001600.0;
  c = c * q - 1.0 / 3628800.0;
  c = c * q + 1.0 / 40320.0;
  c = c * q - 1.0 / 720.0;
  c = c * q + 1.0 / 24.0;
  return 1.0 - 0.5 * q + q * q * c;
}

// atan(k / 8)
constexpr double kAtanEighth[9] = {0.0,
                                   0.12435499454676143503,
                                   0.24497866312686415417,
                                   0.35877067027057221997,
                                   0.46364760900080611621,
                                   0.55859931534356243597,
                                   0.64350110879328438680,
                                   0.71882999962162450542,
                                   0.78539816339744830962};

// atan on [0, 1]: the nearest eighth, and a series for the remainder (|t| <= 1/16).
double AtanUnit(double x) {
  const int k = static_cast<int>(x * 8.0 + 0.5);
  const double c = k / 8.0;
  const double t = (x - c) / (1.0 + x * c);
  const double q = t * t;
  double s = 1.0 / 13.0;
  s = s * q - 1.0 / 11.0;
  s = s * q + 1.0 / 9.0;
  s = s * q - 1.0 / 7.0;
  s = s * q + 1.0 / 5.0;
  s = s * q - 1.0 / 3.0;
  return kAtanEighth[k] + (t + t * q * s);
}

}  // namespace

void SinCos(double radians, double* sine, double* cosine) {
  if (!std::isfinite(radians)) {
    *sine = *cosine = std::nan("");
    return;
  }
  if (std::fabs(radians) > 1.0e6) radians = std::fmod(radians, 4.0 * (kHalfPi1 + kHalfPi2));  // fmod is exact
  const double k = std::floor(radians * (2.0 / kPi) + 0.5);
  const double r = ((radians - k * kHalfPi1) - k * kHalfPi2) - k * kHalfPi3;
  const double s = SinSeries(r), c = CosSeries(r);
  switch (static_cast<std::int64_t>(k) & 3) {
    case 0:
      *sine = s, *cosine = c;
      break;
    case 1:
      *sine = c, *cosine = -s;
      break;
    case 2:
      *sine = -s, *cosine = -c;
      break;
    default:
      *sine = -c, *cosine = s;
      break;
  }
}

double Sin(double radians) {
  if (std::fabs(radians) < 0.785) return SinSeries(radians);  // what follows gives the same bits
  double s, c;
  SinCos(radians, &s, &c);
  return s;
}

double Cos(double radians) {
  if (std::fabs(radians) < 0.785) return CosSeries(radians);
  double s, c;
  SinCos(radians, &s, &c);
  return c;
}

double Atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return std::nan("");
  const double ax = std::fabs(x), ay = std::fabs(y);
  if (ax == 0 && ay == 0) return std::signbit(x) ? std::copysign(kPi, y) : y;
  double angle;
  if (std::isinf(ax) && std::isinf(ay)) {
    angle = kPi / 4;
  } else {
    angle = ay <= ax ? AtanUnit(ay / ax) : kPi / 2 - AtanUnit(ax / ay);
  }
  if (std::signbit(x)) angle = kPi - angle;
  return std::copysign(angle, y);
}

double Acos(double x) {
  if (x >= 1) return 0;
  if (x <= -1) return kPi;
  return Atan2(std::sqrt((1 - x) * (1 + x)), x);
}

double Asin(double x) {
  if (x >= 1) return kPi / 2;
  if (x <= -1) return -kPi / 2;
  return Atan2(x, std::sqrt((1 - x) * (1 + x)));
}

double Exp(double x) {
  if (std::isnan(x)) return x;
  if (x > 709.782712893384) return HUGE_VAL;
  if (x < -745.2) return 0;
  constexpr double kLn2High = 6.93147180369123816490e-01, kLn2Low = 1.90821492927058770002e-10;
  const double k = std::floor(x * 1.44269504088896340736 + 0.5);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double sum = 1.0;
  for (int i = 14; i >= 1; --i) sum = 1.0 + sum * r / i;
  return std::ldexp(sum, static_cast<int>(k));
}

double Log(double x) {
  if (std::isnan(x) || x < 0) return std::nan("");
  if (x == 0) return -HUGE_VAL;
  if (std::isinf(x)) return x;
  int exponent;
  double m = std::frexp(x, &exponent);  // in [0.5, 1)
  if (m < 0.70710678118654752440) m *= 2, --exponent;
  // log m = 2 atanh((m - 1) / (m + 1)), |argument| < 0.172
  const double t = (m - 1) / (m + 1), q = t * t;
  double s = 0;
  for (int i = 21; i >= 3; i -= 2) s = (s + 1.0 / i) * q;
  return exponent * 0.69314718055994530942 + 2 * (t + t * s);
}

}  // namespace kpsa::engine
