// splineIk: a chain of joints along a curve.
#include <algorithm>
#include <cstring>
#include <utility>

#include "graph/geometry.h"
#include "nodes/deformer.h"
#include "nodes/kernels/matrix_parts.h"
#include "nodes/kernels/spline_chain.h"
#include "nodes/node_file.h"

namespace kpsa::engine {
namespace {

using SplineContext = NodeContext<In<"displacements", ConstPointsView>, In<"inMatrix", ArrayView<Matrix4>>,
                                  In<"tipMatrix", Matrix4>, In<"parentMatrix", Matrix4>,
                                  In<"startTwist", double>, In<"endTwist", double>, In<"blend", double>,
                                  In<"curveMatrix", Matrix4>, Out<"outMatrix", OutArray<Matrix4>>>;

struct SplineKernel {
  CurveShape shape;
  std::vector<Double3> vertices;        // at rest, world
  Matrix4 curve_rest, from_curve_rest;  // the curve's matrix at rest, its inverse
  bool maintain = false;
  PointBufferPtr displacements_rest;
  std::vector<Matrix4> in_rest, offsets;  // offset: what takes the solved local to the one at rest
  Matrix4 tip_rest, parent_rest;
  double start_twist_rest = 0, end_twist_rest = 0;
};

// The kernel's curve, carried by its matrix and moved; `moved` of as many vertices.
void MoveVertices(const SplineKernel& k, const Matrix4& curve, const ConstPointsView& by, Double3* moved) {
  const bool carried = !(curve == k.curve_rest);
  const Matrix4 motion = carried ? curve * k.from_curve_rest : Matrix4();
  for (std::size_t i = 0; i < k.vertices.size(); ++i) {
    const Double3 place = carried ? TransformPoint(motion, k.vertices[i]) : k.vertices[i];
    moved[i] = place + Double3{by.x[i], by.y[i], by.z[i]};
  }
}

bool SamePoints(const ConstPointsView& a, const ConstPointsView& b) {
  const std::size_t bytes = a.count * sizeof(float);
  return a.count == b.count && std::memcmp(a.x, b.x, bytes) == 0 && std::memcmp(a.y, b.y, bytes) == 0 &&
         std::memcmp(a.z, b.z, bytes) == 0;
}

std::size_t MatrixFloats(std::size_t count) { return count * sizeof(Matrix4) / sizeof(float); }

Result<BoundKernel> BindSpline(const Binding& binding) {
  const Structural& s = binding.structural();
  const auto* curve = s.asset<Curve>("curve");
  if (curve == nullptr) return Status::Invalid("curve is not set");
  if (binding.input("displacements", -1).size() != curve->cvs().size()) {
    return Status::Invalid(
        "displacements: {} given for a curve of {} vertices; connect the curve's displacements",
        binding.input("displacements", -1).size(), curve->cvs().size());
  }
  SplineKernel k;
  k.vertices = curve->cvs();
  k.shape.closed = curve->closed();
  k.shape.vertices = k.vertices.size();
  k.maintain = s.get_bool("maintainOffset");
  const int joints = s.array_size("inMatrix");
  for (int i = 0; i < joints; ++i) {
    const Value* in = s.rest("inMatrix", i);
    if (in == nullptr || in->get_if<Matrix4>() == nullptr)
      return Status::Invalid("inMatrix[{}] has no value at rest", i);
    k.in_rest.push_back(in->get<Matrix4>());
  }
  k.offsets.resize(k.in_rest.size());
  Result<Matrix4> tip = RestMatrix(s, "tipMatrix"), parent = RestMatrix(s, "parentMatrix"),
                  curve_matrix = RestMatrix(s, "curveMatrix");
  for (const Result<Matrix4>* one : {&tip, &parent, &curve_matrix}) {
    if (!one->ok()) return one->status();
  }
  k.tip_rest = *tip, k.parent_rest = *parent, k.curve_rest = *curve_matrix;
  if (!Invert(k.curve_rest, &k.from_curve_rest))
    return Status::Invalid("curveMatrix is singular at rest, so that it cannot carry the curve");
  const Value* displacements = s.rest("displacements");
  if (displacements == nullptr || displacements->points() == nullptr)
    return Status::Invalid("displacements have no value at rest");
  k.displacements_rest = displacements->get<PointBufferPtr>();
  if (k.maintain) {
    const Value *start = s.rest("startTwist"), *end = s.rest("endTwist");
    if (start == nullptr || end == nullptr) return Status::Invalid("twists have no value at rest");
    k.start_twist_rest = start->AsDouble(), k.end_twist_rest = end->AsDouble();
    std::vector<Double3> vertices(k.vertices.size());
    MoveVertices(k, k.curve_rest, k.displacements_rest->view(), vertices.data());
    std::vector<Matrix4> solved(k.in_rest.size());
    SolveSplineChain(
        {k.parent_rest, k.in_rest, k.tip_rest, k.shape, vertices, k.start_twist_rest, k.end_twist_rest},
        solved);
    for (std::size_t i = 0; i < solved.size(); ++i) {
      Matrix4 inverse;
      if (!Invert(solved[i], &inverse))
        return Status::Invalid("inMatrix[{}] is singular at rest, so that no offset can be maintained", i);
      k.offsets[i] = inverse * k.in_rest[i];
    }
  }
  const std::size_t scratch =
      k.vertices.size() * sizeof(Double3) / sizeof(float) + 2 * MatrixFloats(k.in_rest.size());
  return MakeBound(std::move(k), scratch);
}

void ComputeSpline(SplineContext c) {
  const auto& k = c.kernel_as<SplineKernel>();
  const ConstPointsView& displacements = c.get<"displacements">();
  const ArrayView<Matrix4> in = c.get<"inMatrix">();
  const Matrix4 &parent = c.get<"parentMatrix">(), &tip = c.get<"tipMatrix">();
  const Matrix4& curve = c.get<"curveMatrix">();
  const double blend = c.get<"blend">();
  const std::size_t joints = k.in_rest.size();
  auto* solved = reinterpret_cast<Matrix4*>(c.scratch());
  Matrix4* below = solved + joints;
  auto* vertices = reinterpret_cast<Double3*>(below + joints);
  bool at_rest = k.maintain && parent == k.parent_rest && tip == k.tip_rest && curve == k.curve_rest &&
                 c.get<"startTwist">() == k.start_twist_rest && c.get<"endTwist">() == k.end_twist_rest &&
                 SamePoints(displacements, k.displacements_rest->view());
  for (std::uint32_t i = 0; i < joints; ++i) {
    below[i] = in[i];
    at_rest = at_rest && in[i] == k.in_rest[i];
  }
  const bool solve = blend != 0 && !at_rest;
  if (solve) {
    MoveVertices(k, curve, displacements, vertices);
    SolveSplineChain({parent,
                      {below, joints},
                      tip,
                      k.shape,
                      {vertices, k.vertices.size()},
                      c.get<"startTwist">(),
                      c.get<"endTwist">()},
                     {solved, joints});
  }
  const OutArray<Matrix4> out_matrices = c.out<"outMatrix">();
  for (std::uint32_t i = 0; i < out_matrices.size(); ++i) {
    Matrix4& out = out_matrices[i];
    if (i >= joints) {
      out = Matrix4();
    } else if (!solve) {
      out = below[i];
    } else {
      out = BlendMatrices(below[i], k.maintain ? solved[i] * k.offsets[i] : solved[i], blend);
    }
  }
}

void DemandSpline(Demand& demand) {
  demand.Require("displacements", -1, PointSet::All(demand.input_total("displacements", -1)));
}

}  // namespace

KPSA_NODES(spline_ik, registry) {
  registry
      .add("splineIk",
           "Lays a chain of joints along a curve; bones keep their lengths. In rigs: `start` and `end` name "
           "the joints, `curve` the curve.")
      .category("constraint")
      .version(2)  // the curve hangs under its parent
      .points_in("displacements", "the curve's displacements")
      .in("inMatrix", Matrix4(), {.doc = "local matrices of the joints below, without the end's"})
      .array()
      .in("tipMatrix", Matrix4(), {.doc = "the end's local matrix"})
      .in("parentMatrix", Matrix4(), {.doc = "worldMatrix of the first joint's parent"})
      .world_place()
      .in("startTwist", 0.0, {.unit = Unit::kAngle, .doc = "about the first bone"})
      .in("endTwist", 0.0, {.unit = Unit::kAngle, .doc = "about the last bone; those between get a share"})
      .in("blend", 1.0, {.min = 0, .max = 1, .doc = "0: the matrices below, 1: along the curve"})
      .in("curveMatrix", Matrix4(), {.doc = "the curve's worldMatrix, which carries its vertices"})
      .world_place()
      .structural("curve", Type::kCurve, {.doc = "the curve at rest"})
      .structural("maintainOffset", false, {.doc = "keeps how the joints lie to the curve at rest"})
      .out("outMatrix", Type::kMatrix, "local, for the joints' offsetParentMatrix")
      .array()
      .compute<ComputeSpline>()
      .bind(BindSpline)
      .demand(DemandSpline)
      .cost(5000, 0);
}

}  // namespace kpsa::engine
