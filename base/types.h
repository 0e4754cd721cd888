// Vocabulary types, and every convention of units and spaces.
//
// Inside the runtime: metres, radians, seconds, Y up, right-handed. Matrices act on column vectors and are
// stored column by column, as glTF stores them; `a * b` applies b first. Transforms are named to_from:
// `world_from_local * local_from_bind` reads right to left. Quaternions are (x, y, z, w).
// Small values are double; points are float32 (base/points.h).
// All arithmetic here is plain IEEE without contraction, so that results do not depend on the machine.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace kpsa::engine {

using Index = std::uint32_t;
inline constexpr Index kNoIndex = 0xffffffffu;

struct Double3 {
  double x = 0, y = 0, z = 0;
  double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  friend bool operator==(const Double3&, const Double3&) = default;
};

inline Double3 operator+(Double3 a, Double3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Double3 operator-(Double3 a, Double3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Double3 operator*(Double3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline Double3 operator*(double s, Double3 a) { return a * s; }
inline double Dot(Double3 a, Double3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Double3 Cross(Double3 a, Double3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double Length(Double3 a) { return std::sqrt(Dot(a, a)); }
// Of unit length; zero where the square of the length is 0 or not finite.
inline Double3 UnitOrZero(Double3 v) {
  const double length = Length(v);
  return length > 0 && std::isfinite(length) ? v * (1 / length) : Double3();
}

// A rotation; unit length unless a function says otherwise.
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  friend bool operator==(const Quaternion&, const Quaternion&) = default;
};

// 4x4, column-major: m[4 * column + row]. The default is the identity.
struct Matrix4 {
  std::array<double, 16> m = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  double& operator()(int row, int column) { return m[static_cast<std::size_t>(4 * column + row)]; }
  double operator()(int row, int column) const { return m[static_cast<std::size_t>(4 * column + row)]; }
  friend bool operator==(const Matrix4&, const Matrix4&) = default;
};

// What a number measures; the runtime counts in metres, radians and seconds.
enum class Unit : std::uint8_t { kNone, kLength, kAngle, kTime };

// The order in which rotations about the axes are applied: kXyz turns about X first, as Maya does.
enum class RotateOrder : std::uint8_t { kXyz, kYzx, kZxy, kXzy, kYxz, kZyx };

}  // namespace kpsa::engine
