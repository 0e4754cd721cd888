// Elementary functions whose bits do not depend on the C library: library versions choose FMA variants at run
// time, so that the same rig would give different frames on different machines. Accurate to about 1 ulp to 2
// ulp.
#pragma once

namespace kpsa::engine {

double Sin(double radians);
double Cos(double radians);
void SinCos(double radians, double* sine, double* cosine);
double Atan2(double y, double x);  // (-pi, pi]
double Acos(double x);             // x clamped to [-1, 1]
double Asin(double x);             // x clamped to [-1, 1]
double Exp(double x);
double Log(double x);  // NaN below 0, -inf at 0

inline constexpr double kPi = 3.14159265358979323846;

// 3 t^2 - 2 t^3 of t in [0, 1].
constexpr double Smoothstep(double t) { return t * t * (3 - 2 * t); }

}  // namespace kpsa::engine
