#include "tests/nodes/equivariance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nodes/kernels/constraint_math.h"
#include "tests/nodes/driver_rig.h"

namespace kpsa::engine {
namespace {

Matrix4 MotionOf(Trial trial) {
  if (trial == kAllFar || trial == kNowFar) return Translation({64, -48, 60});  // 100
  const Double3 axis = Double3{3, -7, 5} * (1 / std::sqrt(83.0));
  return Translation({0.7, -1.3, 2.1}) * RotationFromUnit(AxisAngle(axis, 2.2));
}

PointBufferPtr MovedPoints(const PointBuffer& points, const Matrix4& motion, Moves moves) {
  std::vector<float> xyz = points.Interleaved();
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
    const Double3 p{xyz[i], xyz[i + 1], xyz[i + 2]};
    const Double3 moved = moves == Moves::kPlace ? TransformPoint(motion, p) : TransformVector(motion, p);
    for (int a = 0; a < 3; ++a) xyz[i + static_cast<std::size_t>(a)] = static_cast<float>(moved[a]);
  }
  return std::make_shared<PointBuffer>(PointBuffer::FromInterleaved(xyz));
}

Matrix4 TurnAlone(const Matrix4& m) {
  Matrix4 turn = m;
  for (int row = 0; row < 3; ++row) turn(row, 3) = 0;
  return turn;
}

Value MovedAsset(const Value& value, const Matrix4& motion, Moves moves) {
  if (const auto* curve = value.asset<Curve>()) {
    std::vector<Double3> cvs = curve->cvs();
    for (Double3& cv : cvs) cv = TransformPoint(motion, cv);
    return Value(std::make_shared<const Curve>(std::move(cvs), curve->closed()));
  }
  if (const auto* mesh = value.asset<Mesh>()) {
    const Mesh::Data& data = mesh->data();
    Mesh::Data moved;
    moved.name = data.name;
    moved.triangles = data.triangles;
    moved.vertex_to_point = data.vertex_to_point;
    moved.triangle_vertices = data.triangle_vertices;
    moved.primitives = data.primitives;
    moved.rest = PointBuffer::FromInterleaved(MovedPoints(data.rest, motion, moves)->Interleaved());
    return Value(std::make_shared<const Mesh>(std::move(moved)));
  }
  const auto* targets = value.asset<MorphTargets>();
  if (targets == nullptr) return value;
  std::vector<MorphTargets::Target> moved = targets->targets();
  for (MorphTargets::Target& target : moved)
    target.deltas = MovedPoints(PointBuffer::FromInterleaved(target.deltas), motion, moves)->Interleaved();
  return Value(std::make_shared<const MorphTargets>(std::move(moved), targets->point_count()));
}

double ValuesApart(const Value& a, const Value& b, Moves moves) {
  if (const auto* m = a.get_if<Matrix4>()) {
    const Matrix4& n = b.get<Matrix4>();
    return moves == Moves::kPlace ? Apart(PlaceIn(*m), PlaceIn(n)) : Apart(*m, n);
  }
  if (const auto* q = a.get_if<Quaternion>())
    return Apart(RotationFromQuaternion(*q), RotationFromQuaternion(b.get<Quaternion>()));
  if (const auto* v = a.get_if<Double3>()) {
    const Double3& w = b.get<Double3>();
    if (moves != Moves::kTurn) return Apart(*v, w);
    return Apart(RotationFromEuler(*v, RotateOrder::kXyz), RotationFromEuler(w, RotateOrder::kXyz));
  }
  const PointBuffer* points = a.points();
  if (points == nullptr) return std::fabs(a.AsDouble() - b.AsDouble());
  const std::vector<float> p = points->Interleaved(), q = b.points()->Interleaved();
  double worst = p.size() == q.size() ? 0 : 1e30;
  for (std::size_t i = 0; i < std::min(p.size(), q.size()); ++i) {
    const double d = std::fabs(double{p[i]} - double{q[i]});
    if (!(d <= worst)) worst = std::isfinite(d) ? d : 1e30;
  }
  return worst;
}

void SetNow(TestGraph* g, const std::string& name, const Value& value) {
  const Result<PlugHandle> handle = g->evaluator->FindVarying(g->graph, g->plug(name));
  if (!handle.ok()) {
    ADD_FAILURE() << g->graph.def(g->plug(name).node).name << ": no output depends on " << name;
    return;
  }
  if (value.get_if<std::string>() != nullptr) return;  // the choice stays
  const PointBuffer* points = value.points();
  const Status set = points != nullptr ? g->evaluator->SetPoints(*handle, points->view())
                                       : g->evaluator->Set(*handle, value);
  EXPECT_TRUE(set.ok()) << set.ToString();
}

Value OutputOf(const TestGraph& g, Index output) {
  const Type type = g.graph.PlugType(g.request.outputs[output].plug);
  if (!IsPointType(type)) return Value::ReadSlot(type, &g.evaluator->Get<std::byte>(output));
  const ConstPointsView view = g.evaluator->Points(output);
  auto points = std::make_shared<PointBuffer>(view.count, PointComponents(type));
  const float* const from[] = {view.x, view.y, view.z};
  float* const to[] = {points->view().x, points->view().y, points->view().z};
  for (int a = 0; a < PointComponents(type); ++a) std::copy_n(from[a], view.count, to[a]);
  return Value(PointBufferPtr(std::move(points)));
}

}  // namespace

Value MovedValue(const Value& value, const Matrix4& motion, Moves moves) {
  if (moves == Moves::kNot) return value;
  if (const auto* m = value.get_if<Matrix4>())
    return moves == Moves::kInverse ? *m * InverseOrIdentity(motion) : motion * *m;
  if (const auto* q = value.get_if<Quaternion>()) return QuaternionFromRotation(TurnAlone(motion)) * *q;
  if (const auto* v = value.get_if<Double3>()) {
    if (moves == Moves::kPlace) return TransformPoint(motion, *v);
    if (moves == Moves::kShift) return *v + PlaceIn(motion);
    if (moves == Moves::kDirection) return TransformVector(motion, *v);
    return EulerFromRotation(TurnAlone(motion) * RotationFromEuler(*v, RotateOrder::kXyz), RotateOrder::kXyz);
  }
  if (const PointBuffer* points = value.points()) return Value(MovedPoints(*points, motion, moves));
  return MovedAsset(value, motion, moves);
}

std::shared_ptr<const Mesh> EquivarianceSheet() {
  static const std::shared_ptr<const Mesh> sheet =
      GridMesh(9, 7, [](double x, double y) { return 0.2 * x * y + 0.1 * x * x; });
  return sheet;
}

std::shared_ptr<const Mesh> EquivarianceSurface() {
  static const std::shared_ptr<const Mesh> surface = [] {
    const auto grid = GridMesh(
        6, 5, [](double x, double y) { return 0.3 * std::sin(y + 0.4 * x + 0.07) - 0.1 * std::sin(2 * x); });
    std::vector<float> xyz = grid->data().rest.Interleaved();
    for (float& f : xyz) f *= 1.3f;
    return MeshOf(std::move(xyz), grid->data().triangles);
  }();
  return surface;
}

Value BentPoints(const Mesh& mesh, double amount) {
  std::vector<float> xyz = mesh.data().rest.Interleaved();
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
    const float x = xyz[i], y = xyz[i + 1], by = static_cast<float>(amount);
    xyz[i] += by * (x * y + 0.3f * x);
    xyz[i + 1] += by * (0.5f * y * y - 0.2f);
    xyz[i + 2] += by * (x * x - y);
  }
  return PointsOf(xyz);
}

Value NumberedPoints(Index count, double step) {
  auto weights = std::make_shared<PointBuffer>(count, 1);
  for (Index i = 0; i < count; ++i)
    weights->view().x[i] = static_cast<float>(std::fmod(step * static_cast<double>(i), 1.0));
  return Value(PointBufferPtr(std::move(weights)));
}

NodeSetUp AfterSkin(const std::string& type, const std::string& what, std::vector<GivenInput> own,
                    bool idle_parent) {
  RandomFrames random(11);
  const auto sheet = EquivarianceSheet();
  GivenInput parent = WorldMatrix("parentMatrix", &random);
  parent.idle = idle_parent;
  NodeSetUp s{type,
              "after the skin" + (what.empty() ? "" : ", " + what),
              {{"inPoints[0]", Moves::kPlace, BentPoints(*sheet, 0), BentPoints(*sheet, 0.2)},
               parent,
               {"mesh[0]", Moves::kPlace, sheet, {}, true}},
              {{"outPoints[0]", Moves::kPlace}},
              0,
              ""};
  s.given.insert(s.given.end(), own.begin(), own.end());
  return s;
}

NodeSetUp BeforeSkin(const std::string& type, const std::string& what, std::vector<GivenInput> own,
                     bool idle_frames) {
  RandomFrames random(12);
  const auto sheet = EquivarianceSheet();
  NodeSetUp s{type,
              "before the skin" + (what.empty() ? "" : ", " + what),
              {{"inPoints[0]", Moves::kNot, BentPoints(*sheet, 0), BentPoints(*sheet, 0.2)},
               {"parentMatrix", Moves::kFrame, random.Rigid(0.5), random.Rigid(0.5), idle_frames},
               {"geometryMatrix[0]", Moves::kFrame, random.Rigid(0.5), {}, idle_frames},
               Setting("mesh[0]", sheet),
               Setting("space", "mesh")},
              {{"outPoints[0]", Moves::kNot}},
              0,
              ""};
  s.given.insert(s.given.end(), own.begin(), own.end());
  return s;
}

std::vector<Value> EvaluateSetUp(const NodeSetUp& set_up, const Matrix4& rest, const Matrix4& now,
                                 const std::string& unmoved) {
  TestGraph g(StandardNodes());
  g.add(set_up.type, "n");
  const auto moved = [&](const GivenInput& input, const Value& value, const Matrix4& motion) {
    return input.input == unmoved ? value : MovedValue(value, motion, input.moves);
  };
  std::vector<const GivenInput*> varying;
  for (const GivenInput& input : set_up.given) {
    const std::string name = "n." + input.input;
    g.hold(name, moved(input, input.rest, rest));
    const NodeDef& def = *StandardNodes().Find(set_up.type);
    if (def.attributes[static_cast<std::size_t>(g.plug(name).attribute)].structural) continue;
    g.vary(name);
    varying.push_back(&input);
  }
  for (const GivenOutput& output : set_up.gives) g.want("n." + output.output);
  const Status compiled = g.compile();
  const bool refused = std::any_of(set_up.given.begin(), set_up.given.end(), [&](const GivenInput& input) {
    return input.fits && input.input == unmoved;
  });
  EXPECT_EQ(compiled.ok(), !refused) << set_up.Name() << (unmoved.empty() ? "" : " without ") << unmoved
                                     << ": " << compiled.ToString();
  std::vector<Value> outputs;
  for (const bool frame : {false, true}) {
    if (!compiled.ok()) break;
    for (const GivenInput* input : varying)
      SetNow(
          &g, "n." + input->input,
          moved(*input, frame && !input->now.empty() ? input->now : input->rest, input->bound ? rest : now));
    const Status status = g.evaluator->Evaluate();
    EXPECT_TRUE(status.ok()) << set_up.Name() << ": " << status.ToString();
    for (Index i = 0; i < set_up.gives.size(); ++i) outputs.push_back(OutputOf(g, i));
  }
  return outputs;
}

double TrialError(const NodeSetUp& set_up, Trial trial, const std::vector<Value>& unmoved_outputs,
                  const std::string& unmoved) {
  const Matrix4 motion = MotionOf(trial);
  const std::vector<Value> outputs =
      EvaluateSetUp(set_up, (trial & kWithRest) != 0 ? motion : Matrix4(), motion, unmoved);
  double worst = outputs.size() == unmoved_outputs.size() && !outputs.empty() ? 0 : 1e30;
  for (std::size_t i = 0; i < std::min(outputs.size(), unmoved_outputs.size()); ++i) {
    const Moves moves = set_up.gives[i % set_up.gives.size()].moves;
    worst = std::max(worst, ValuesApart(outputs[i], MovedValue(unmoved_outputs[i], motion, moves), moves));
  }
  return worst;
}

double TrialTolerance(const NodeSetUp& set_up, Trial trial) {
  const bool far = (trial & (kAllFar | kNowFar)) != 0;
  for (const GivenInput& input : set_up.given) {
    if (input.rest.points() != nullptr) return far ? 3e-4 : 1e-5;  // 100 m and 2 m in float
  }
  return far ? 1e-9 : 1e-11;
}

std::string TrialName(Trial trial) {
  return std::string((trial & kWithRest) != 0 ? "rest and frame" : "frame alone") +
         ((trial & (kAllFar | kNowFar)) != 0 ? ", far" : ", turned");
}

}  // namespace kpsa::engine
