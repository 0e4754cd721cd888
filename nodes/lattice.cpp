#include "nodes/kernels/lattice.h"

#include <algorithm>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/carried_delta.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

enum class LatticeInterpolation { kLinear, kBspline, kBernstein };

struct LatticeBound {
  LatticeKernel kernel;
  bool carried = false;  // by the parent: in world space
  // At rest, from the cube [-0.5, 0.5]^3: to the parent where it carries, to the stage otherwise
  Matrix4 from_lattice;
  PointBuffer grid;  // the controls' places at rest, as the attribute holds them
  std::size_t offset_floats = 0, moved_floats = 0;
};

std::vector<std::int64_t> Divisions(const Structural& s) {
  return s.value("divisions").get<std::vector<std::int64_t>>();
}

std::vector<Double3> Grid(const std::vector<std::int64_t>& d) {
  std::vector<Double3> grid;
  for (std::int64_t u = 0; u < d[2]; ++u) {
    for (std::int64_t t = 0; t < d[1]; ++t) {
      for (std::int64_t s = 0; s < d[0]; ++s) {
        grid.push_back({static_cast<double>(s) / static_cast<double>(d[0] - 1),
                        static_cast<double>(t) / static_cast<double>(d[1] - 1),
                        static_cast<double>(u) / static_cast<double>(d[2] - 1)});
      }
    }
  }
  return grid;
}

Status CheckDivisions(const std::vector<std::int64_t>& d) {
  if (d.size() != 3) return Status::Invalid("divisions takes three numbers, not {}", d.size());
  for (std::int64_t n : d) {
    if (n < 2 || n > 32) return Status::Invalid("divisions of {}: expected 2 to 32", n);
  }
  return Status();
}

Value DefaultControls(const Structural& s) {
  const std::vector<std::int64_t> d = Divisions(s);
  if (!CheckDivisions(d).ok()) return Value(PointBufferPtr(std::make_shared<PointBuffer>(0)));
  return Value(PointBufferPtr(std::make_shared<PointBuffer>(PointBuffer::FromPlaces(Grid(d)))));
}

// The box in the stage's space at rest: given, or around the members.
Result<Matrix4> RestBox(const Binding& binding, ConstPointsView rest) {
  const Structural& s = binding.structural();
  Double3 lo = s.value("boxMin").get<Double3>(), hi = s.value("boxMax").get<Double3>();
  if (s.is_set("boxMin") != s.is_set("boxMax")) return Status::Invalid("boxMin and boxMax go together");
  if (!s.is_set("boxMin")) {
    const auto* weights = s.asset<WeightMap>("weights");
    bool any = false;
    for (std::size_t i = 0; i < rest.count; ++i) {
      if (weights != nullptr && !(i < weights->weights().size() && weights->weights()[i] > 0)) continue;
      const Double3 p{rest.x[i], rest.y[i], rest.z[i]};
      for (int a = 0; a < 3; ++a) {
        lo[a] = any ? std::min(lo[a], p[a]) : p[a];
        hi[a] = any ? std::max(hi[a], p[a]) : p[a];
      }
      any = true;
    }
    if (!any) return Status::Invalid("it has no members: nothing gives it a size");
    // A hair wider than the members, which then lie inside whatever the rounding; flat sides get some
    // thickness
    const double margin = 1e-4 * Length(hi - lo) + 1e-9;
    for (int a = 0; a < 3; ++a) lo[a] -= margin, hi[a] += margin;
  }
  const Double3 size = hi - lo;
  if (!(size.x > 0 && size.y > 0 && size.z > 0))
    return Status::Invalid("its box is empty: {} x {} x {} m", size.x, size.y, size.z);
  return Translation((lo + hi) * 0.5) * Scaling(size);
}

Result<BoundKernel> BindLattice(const Binding& binding) {
  const Structural& s = binding.structural();
  const std::vector<std::int64_t> d = Divisions(s);
  KPSA_RETURN_IF_ERROR(CheckDivisions(d));
  const auto& influence = s.value("localInfluence").get<std::vector<std::int64_t>>();
  if (influence.size() != 3)
    return Status::Invalid("localInfluence takes three numbers, not {}", influence.size());
  LatticeSettings settings;
  const auto interpolation = s.choice<LatticeInterpolation>("interpolation");
  settings.local = interpolation != LatticeInterpolation::kBernstein;
  for (std::size_t a = 0; a < 3; ++a) {
    settings.divisions[a] = static_cast<int>(d[a]);
    settings.influence[a] = interpolation == LatticeInterpolation::kLinear
                                ? 2
                                : static_cast<int>(std::clamp<std::int64_t>(influence[a], 0, 1000));
  }
  settings.outside = s.choice<LatticeOutside>("outside");
  settings.falloff_distance = s.get_double("outsideFalloffDist");
  KPSA_RETURN_IF_ERROR(settings.Validate());
  Result<ConstPointsView> rest = RestPoints(s);
  if (!rest.ok()) return rest.status();
  Result<CarriedFrame> frame = CarriedFrame::Bind(s);
  if (!frame.ok()) return frame.status();
  Result<Matrix4> box = RestBox(binding, *rest);
  if (!box.ok()) return box.status();
  const Value* controls = s.rest("points");
  PointBuffer grid = PointBuffer::FromPlaces(Grid(d));  // controls at rest give offsets of exactly 0
  const std::size_t count = grid.count();
  if (controls == nullptr || controls->points() == nullptr || controls->points()->count() != count)
    return Status::Invalid("points: expected {} control points", count);
  LatticeBound bound{LatticeKernel(settings, *rest, InverseOrIdentity(*box),
                                   binding.output("outPoints").ToVector(), BoundWeights(binding)),
                     !frame->fixed(),
                     frame->fixed() ? *box : frame->parent_rest_inverse() * *box,
                     std::move(grid),
                     PaddedCount(count * sizeof(Double3) / sizeof(float)),
                     PaddedCount(count)};
  const std::size_t scratch = bound.offset_floats + bound.moved_floats + bound.kernel.ScratchFloats();
  return MakeBound(std::move(bound), scratch);
}

void ComputeLattice(DeformerContext<In<"points", ConstPointsView>> c) {
  const auto& bound = c.kernel_as<LatticeBound>();
  const ConstPointsView& controls = c.get<"points">();
  const ConstPointsView rest = bound.grid.view();
  auto* offsets = reinterpret_cast<Double3*>(c.scratch());
  auto* moved = reinterpret_cast<Index*>(c.scratch() + bound.offset_floats);
  float* scratch = c.scratch() + bound.offset_floats + bound.moved_floats;
  const std::span<const Index> numbers(moved, FindMovedControls(controls, rest, moved));  // most often a few
  for (const Index i : numbers) {
    offsets[i] = {static_cast<double>(controls.x[i]) - rest.x[i],
                  static_cast<double>(controls.y[i]) - rest.y[i],
                  static_cast<double>(controls.z[i]) - rest.z[i]};
  }
  Matrix4 carried;
  if (bound.carried) FindProduct(c.get<"parentMatrix">(), bound.from_lattice, &carried);
  const Matrix4& now = bound.carried ? carried : bound.from_lattice;
  const Parallel parallel = HostParallel(c);
  bound.kernel.Run({{offsets, bound.grid.count()}, numbers, now, now, c.get<"envelope">()},
                   c.get<"inPoints">(), c.out<"outPoints">(), {scratch, bound.kernel.ScratchFloats()},
                   &parallel);
}

// The points of the geometry one by one; all controls.
void DemandLattice(Demand& demand) {
  demand.Require("inPoints", 0, demand.output("outPoints"));
  demand.Require("points", -1, PointSet::All(demand.input_total("points", -1)));
}

void DeclareLattice(NodeBuilder& b) {
  b.points_in("points",
              "the control points in lattice coordinates: the rest box is [0, 1]^3; points[s,t,u], s fastest")
      .grid("divisions")
      .default_from(DefaultControls);
  b.structural("divisions", std::vector<std::int64_t>{2, 5, 2},
               {.doc = "control points along s, t, u; 2 to 32 each"});
  b.structural("localInfluence", std::vector<std::int64_t>{2, 2, 2},
               {.doc = "order of the B-spline along s, t, u; 2 is linear"});
  b.enumeration<LatticeInterpolation>(
      "interpolation",
      {{"linear", LatticeInterpolation::kLinear},
       {"bspline", LatticeInterpolation::kBspline},
       {"bernstein", LatticeInterpolation::kBernstein}},
      true,
      "linear between neighbouring controls, B-splines of localInfluence, or Bernstein polynomials "
      "over all controls");
  b.enumeration<LatticeOutside>("outside",
                                {{"inside", LatticeOutside::kInside},
                                 {"all", LatticeOutside::kAll},
                                 {"falloff", LatticeOutside::kFalloff}},
                                true, "what becomes of points outside of the box");
  b.structural("outsideFalloffDist", 1.0, {.min = 1e-6, .doc = "of falloff, in widths of the lattice"});
  b.structural("boxMin", Double3(),
               {.unit = Unit::kLength,
                .doc = "corner of the box in the stage's space at rest; default: around the members"});
  b.structural("boxMax", Double3(), {.unit = Unit::kLength});
}

}  // namespace

KPSA_NODES(lattice, registry) {
  AddDeformer<ComputeLattice>(registry,
                              {.name = "lattice",
                               .doc = "Free-form deformation: points follow a grid of control points.",
                               .own = DeclareLattice,
                               .bind = BindLattice,
                               .demand = DemandLattice})
      .cost(130, 4);
}

}  // namespace kpsa::engine
