// Free-form deformation (Sederberg and Parry 1986; Maya's ffd): points follow a grid of control points.
//
// Lattice space: the undeformed lattice is the cube [-0.5, 0.5]^3, its controls on a regular grid; control
// (s, t, u) has index s + ds (t + dt u). With q the incoming point in the space of the lattice base,
//     q' = q + sum_c w_c offset_c,   p' = p + w (matrix q' - p),   q = base_matrix^-1 p.
// The weights w_c come from the REST points, so the kernel is linear and local: an incoming point's detail is
// kept, and a lattice that moves as a whole moves its points rigidly. Where matrix == base_matrix, only
// offsets count.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/points.h"
#include "base/status.h"
#include "nodes/kernels/control_blend.h"
#include "nodes/kernels/parallel_hook.h"

namespace kpsa::engine {

enum class LatticeOutside : std::uint8_t {
  kInside,   // points outside of the lattice stay
  kAll,      // they move with the nearest point of the lattice
  kFalloff,  // as kAll, fading linearly to nothing at falloff_distance
};

struct LatticeSettings {
  std::array<int, 3> divisions = {2, 5, 2};  // controls along s, t, u; 2 to 32 each
  bool local = true;                         // false: Bernstein polynomials over all controls
  // Of local: the order of the clamped uniform B-spline along each axis; 2 is linear between neighbouring
  // controls. 2 to 32; more than the divisions means as many as the divisions.
  std::array<int, 3> influence = {2, 2, 2};
  LatticeOutside outside = LatticeOutside::kInside;
  double falloff_distance = 1;  // in lattice space, where the lattice is 1 wide; > 0
  Status Validate() const;
};

// Weights of the controls along one axis at coordinate x in [0, 1] (clamped); they sum to 1. order 0:
// Bernstein.
std::vector<double> LatticeBasis(int divisions, int order, double x);

// The controls that are not where they rest, ascending, in `moved` (as many as there are, at most); how many.
std::size_t FindMovedControls(const ConstPointsView& now, const ConstPointsView& rest, Index* moved) noexcept;

// A local kernel.
class LatticeKernel {
 public:
  struct Inputs {
    std::span<const Double3> offsets;  // of every control from its place on the grid; lattice space
    std::span<const Index> moved;      // the controls whose offsets are not 0, ascending: no other is read
    const Matrix4& base_matrix;        // point space from the lattice's base, now (bindPreMatrix^-1)
    const Matrix4& matrix;             // point space from the lattice, now
    double envelope = 1;
  };

  // rest: points of the whole mesh; lattice_from_rest takes them into lattice space as they were bound.
  // `settings` must be valid.
  LatticeKernel(const LatticeSettings& settings, ConstPointsView rest, const Matrix4& lattice_from_rest,
                std::span<const Index> out_points, std::span<const float> point_weights = {});

  std::size_t point_count() const { return count_; }
  std::size_t control_count() const { return controls_; }
  std::size_t ScratchFloats() const { return 4 * controls_; }
  void Run(const Inputs& inputs, ConstPointsView in, PointsView out, std::span<float> scratch,
           const Parallel* parallel = nullptr) const noexcept;

 private:
  std::size_t count_ = 0, controls_ = 0;
  std::array<std::size_t, 3> divisions_ = {};
  std::uint32_t over_s_ = 0, over_t_ = 0;  // of what is divided by their divisions, times 2^20
  AlignedFloats weights_;                  // per point: point weight x outside falloff
  bool sparse_ = false;         // linear and large: 8 controls a point; otherwise all, axis by axis
  ControlBlend blend_;          // of sparse_
  std::vector<Index> tiles_;    // of dense: first points of the tiles of 16 that have a weight
  AlignedFloats axis_weights_;  // of dense: per tile (ds + dt + du) rows of 16
};

}  // namespace kpsa::engine
