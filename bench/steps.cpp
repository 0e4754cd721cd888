// What a step costs beyond the arithmetic of its points, where it has few of them, as the steps that measure the cues
// of an accelerated frame have: chains of one deformer, every step of which is stale, over 16 and over 80 points. A line
// through the two times meets no points at all at the cost of the step. Cold: between two runs 2 MB of something else go
// through the caches, as a subspace does in every frame.
//   bench_steps [deformers in a chain [deformer]]          40 if not given, of all types
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/check.h"
#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "graph/geometry.h"
#include "nodes/standard_nodes.h"
#include "tests/nodes/kernel_support.h"

namespace kpsa::engine {
namespace {

constexpr Index kEdge = 41;
constexpr Index kFew = 16, kMany = 80;

// What a chain is made of: a type, what is set on each of its nodes, and the plugs that change before each run.
struct Chain {
  std::string type, what;
  std::vector<std::pair<std::string, Value>> held;
  std::vector<std::pair<std::string, std::function<Value(double)>>> moving;
};

void ComputeNudge(
    NodeContext<In<"inPoints", ConstPointsView>, In<"by", double>, Out<"outPoints", PointsView>> c) {
  const PointsView& out = c.out<"outPoints">();
  CopyPoints(c.get<"inPoints">(), out);
  out.x[0] += static_cast<float>(c.get<"by">());
}

const NodeRegistry& Registry() {
  static const NodeRegistry* registry = [] {
    auto* nodes = new NodeRegistry;
    AddStandardNodes(*nodes);
    nodes->add("nudge", "Moves its first point: a step and next to no arithmetic.")
        .points_in("inPoints", "")
        .in("by", 0.0)
        .out("outPoints", Type::kPoints)
        .compute<ComputeNudge>()
        .in_place("inPoints");
    return nodes;
  }();
  return *registry;
}

Value Moved(const Matrix4& matrix, double by) {
  return Value(matrix * ComposeTrs({by, 0.5 * by, 0}, Normalized({by, 0, 0.3 * by, 1}), {1, 1, 1}));
}
std::pair<std::string, std::function<Value(double)>> Moving(const std::string& plug,
                                                            const Matrix4& rest = {}) {
  return {plug, [rest](double by) { return Moved(rest, by); }};
}
std::pair<std::string, std::function<Value(double)>> Changing(const std::string& plug, double rest,
                                                              double much) {
  return {plug, [rest, much](double by) { return Value(rest + much * by); }};
}

// Nine of them or so are moved.
Value Offsets(const std::vector<Double3>& rest, double by) {
  std::vector<Double3> places = rest;
  for (std::size_t i = 0; i < places.size(); i += places.size() / 9)
    places[i] = places[i] + Double3{by, -by, 0.5 * by};
  return Value(PointBufferPtr(std::make_shared<PointBuffer>(PointBuffer::FromPlaces(places))));
}

std::vector<Double3> LatticeGrid(int divisions) {
  std::vector<Double3> grid;
  for (int u = 0; u < divisions; ++u) {
    for (int t = 0; t < divisions; ++t) {
      for (int s = 0; s < divisions; ++s)
        grid.push_back(Double3{double(s), double(t), double(u)} * (1.0 / (divisions - 1)));
    }
  }
  return grid;
}

std::shared_ptr<const Influences> Skinned(std::size_t points) {
  const TestSkin skin = MakeSkin(points, 8, 4, false);
  return std::make_shared<const Influences>(skin.offsets, skin.joints, skin.weights, Index{8});
}

std::vector<Chain> Chains(const TestMesh& mesh, const std::shared_ptr<const Mesh>& driver) {
  const Matrix4 handle = Translation({0.1, 0.05, 0.1});
  const auto parent = Moving("parentMatrix", Translation({0, 0.1, 0}));
  const auto bounds = [](std::vector<std::pair<std::string, Value>> held) {
    held.emplace_back("lowBound", Value(-2.0)), held.emplace_back("highBound", Value(2.0));
    return held;
  };
  std::vector<Chain> chains;
  chains.push_back({"nudge", "", {}, {Changing("by", 0, 0.1)}});
  chains.push_back({"cluster", "", {}, {parent, Moving("matrix", handle)}});
  chains.push_back({"softMod", "", {{"falloffRadius", Value(5.0)}}, {parent, Moving("matrix", handle)}});
  for (const char* type : {"bend", "twist", "squash"}) {
    const char* plug = type[0] == 'b' ? "curvature" : type[0] == 't' ? "endAngle" : "factor";
    chains.push_back({type, "", bounds({}), {parent, Moving("matrix", handle), Changing(plug, 0.2, 0.1)}});
  }
  chains.push_back({"sculpt", "", {{"radius", Value(0.4)}}, {parent, Moving("matrix", handle)}});
  std::vector<Double3> vertices;
  for (int i = 0; i < 9; ++i) vertices.push_back({0.1 * i - 0.4, 0.02 * i, 0.1});
  const std::vector<Double3> still(9);
  chains.push_back({"wire",
                    "9 vertices",
                    {{"curve", Value(AssetPtr(std::make_shared<const Curve>(vertices, false)))},
                     {"dropoff", Value(3.0)},
                     {"displacements", Offsets(still, 0)}},
                    {parent, {"displacements", [still](double by) { return Offsets(still, by); }}}});
  for (const char* interpolation : {"linear", "bernstein"}) {
    const std::vector<Double3> grid = LatticeGrid(5);
    chains.push_back({"lattice",
                      std::string("5x5x5, ") + interpolation,
                      {{"divisions", Value(std::vector<std::int64_t>{5, 5, 5})},
                       {"interpolation", Value(std::string(interpolation))},
                       {"points", Offsets(grid, 0)}},
                      {parent, {"points", [grid](double by) { return Offsets(grid, by); }}}});
  }
  for (const char* method : {"classicLinear", "dualQuaternion"}) {
    Chain skin{"skinCluster",
               std::string("8 joints, ") + method,
               {{"influences[0]", Value(AssetPtr(Skinned(mesh.count())))},
                {"skinningMethod", Value(std::string(method))}},
               {}};
    for (int j = 0; j < 8; ++j)
      skin.moving.push_back(Moving("matrix[" + std::to_string(j) + "]", Translation({0.1 * j, 0, 0})));
    chains.push_back(std::move(skin));
  }
  const std::vector<Double3> driving = ToDouble(driver->data().rest.view());
  chains.push_back({"wrap",
                    "driver of 36 points",
                    {{"driverMesh", Value(AssetPtr(driver))}, {"driverPoints", Offsets(driving, 0)}},
                    {parent, {"driverPoints", [driving](double by) { return Offsets(driving, by); }}}});
  return chains;
}

struct Cost {
  double step = 0, cold = 0, point = 0;  // nanoseconds
};

class ChainRun {
 public:
  ChainRun(const Chain& chain, const TestMesh& mesh, int length, Index points)
      : graph_(Registry()), length_(length) {
    std::string before;
    Request request;
    for (int i = 0; i < length; ++i) {
      const std::string name = fmt::format("n{}", i);
      KPSA_CHECK(graph_.AddNode(chain.type, name).ok());
      const std::string element = chain.type == "nudge" ? "" : "[0]";
      for (const auto& [plug, value] : chain.held) Set(name + "." + plug, value);
      for (const auto& [plug, value] : chain.moving) {
        Set(name + "." + plug, value(0));
        moving_.emplace_back(Plug(name + "." + plug), value);
        request.varying.push_back(moving_.back().first);
      }
      const std::string in = name + ".inPoints" + element;
      if (i == 0) {
        Set(in, Value(PointBufferPtr(std::make_shared<PointBuffer>(mesh.rest))));
      } else {
        KPSA_CHECK(graph_.Connect(Plug(before), Plug(in)).ok());
      }
      before = name + ".outPoints" + element;
    }
    std::vector<Index> wanted;
    for (Index i = 0; i < points; ++i) wanted.push_back(static_cast<Index>(i * mesh.count() / points));
    request.outputs.push_back({Plug(before), PointSet::Of(wanted, static_cast<Index>(mesh.count()))});
    Result<std::shared_ptr<const Plan>> plan = compiler_.Compile(graph_, request);
    if (!plan.ok()) fmt::print(stderr, "{}: {}\n", chain.type, plan.status().ToString());
    KPSA_CHECK(plan.ok());
    KPSA_CHECK_EQ((*plan)->steps().size(), static_cast<std::size_t>(length));
    evaluator_ = std::make_unique<Evaluator>(*plan);
    for (auto& [plug, value] : moving_) handles_.push_back(*evaluator_->FindVarying(graph_, plug));
  }
  // Nanoseconds of an evaluation in which everything has moved.
  double Run(int turn) {
    using Clock = std::chrono::steady_clock;
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const Value value = moving_[i].second(turn % 2 == 0 ? 0.01 : 0.013);
      const Status set = value.points() != nullptr
                             ? evaluator_->SetPoints(handles_[i], value.points()->view())
                             : evaluator_->Set(handles_[i], value);
      KPSA_CHECK(set.ok());
    }
    const auto before = Clock::now();
    KPSA_CHECK(evaluator_->Evaluate().ok());
    return std::chrono::duration<double, std::nano>(Clock::now() - before).count() / length_;
  }

 private:
  PlugRef Plug(const std::string& name) const {
    const Result<PlugRef> plug = graph_.FindPlug(name);
    if (!plug.ok()) fmt::print(stderr, "{}\n", plug.status().ToString());
    KPSA_CHECK(plug.ok());
    return *plug;
  }
  void Set(const std::string& plug, Value value) {
    const Status set = graph_.Set(Plug(plug), std::move(value));
    if (!set.ok()) fmt::print(stderr, "{}\n", set.ToString());
    KPSA_CHECK(set.ok());
  }
  Graph graph_;
  Compiler compiler_;
  int length_;
  std::vector<std::pair<PlugRef, std::function<Value(double)>>> moving_;
  std::vector<PlugHandle> handles_;
  std::unique_ptr<Evaluator> evaluator_;
};

Cost Measure(const Chain& chain, const TestMesh& mesh, int length) {
  ChainRun few(chain, mesh, length, kFew), many(chain, mesh, length, kMany);
  double least_few = 1e30, least_cold = 1e30, least_many = 1e30;
  std::vector<char> other(std::size_t{2} << 20);
  for (int turn = 0; turn < 400; ++turn) {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
    least_cold = std::min(least_cold, few.Run(2 * turn));
    least_few = std::min(least_few, few.Run(2 * turn + 1));
    least_many = std::min(least_many, many.Run(turn));
  }
  const double point = (least_many - least_few) / (kMany - kFew);
  return {least_few - kFew * point, least_cold - kFew * point, point};
}

int Main(int argc, char** argv) {
  const int length = argc > 1 ? std::clamp(std::atoi(argv[1]), 1, 10000) : 40;
  const TestMesh mesh = MakeSheet(kEdge, kEdge);
  Mesh::Data data;
  const TestMesh cage = MakeSheet(6, 6);
  data.name = "cage";
  data.rest = cage.rest;
  data.triangles = {cage.topology.triangles().begin(), cage.topology.triangles().end()};
  for (Index i = 0; i < cage.count(); ++i) data.vertex_to_point.push_back(i);
  const auto driver = std::make_shared<const Mesh>(std::move(data));
  fmt::print("{:<36} {:>16} {:>10} {:>10}\n", "deformer", "beyond points", "cold", "a point");
  for (const Chain& chain : Chains(mesh, driver)) {
    if (argc > 2 && chain.type != argv[2]) continue;
    const Cost cost = Measure(chain, mesh, length);
    fmt::print("{:<36} {:>13.0f} ns {:>7.0f} ns {:>7.2f} ns\n",
               chain.type + (chain.what.empty() ? "" : ", " + chain.what), cost.step, cost.cold, cost.point);
  }
  return 0;
}

}  // namespace
}  // namespace kpsa::engine

int main(int argc, char** argv) { return kpsa::engine::Main(argc, argv); }
