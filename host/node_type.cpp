#include "host/node_type.h"

#include <algorithm>
#include <memory>
#include <set>
#include <vector>

#include "base/thrown.h"

namespace kpsa::engine {
namespace {

std::size_t NumbersIn(NodeAttribute::Type type) {
  switch (type) {
    case NodeAttribute::Type::kNumber:
      return 1;
    case NodeAttribute::Type::kVector:
      return 3;
    case NodeAttribute::Type::kQuaternion:
      return 4;
    case NodeAttribute::Type::kMatrix:
      return 16;
  }
  return 0;
}

Value DefaultOf(const NodeAttribute& attribute) {
  const std::vector<double>& v = attribute.value;
  switch (attribute.type) {
    case NodeAttribute::Type::kNumber:
      return Value(v.empty() ? 0.0 : v[0]);
    case NodeAttribute::Type::kVector:
      return Value(v.empty() ? Double3() : Double3{v[0], v[1], v[2]});
    case NodeAttribute::Type::kQuaternion:
      return Value(v.empty() ? Quaternion() : Quaternion{v[0], v[1], v[2], v[3]});
    case NodeAttribute::Type::kMatrix:
      break;
  }
  Matrix4 matrix;
  std::ranges::copy(v, matrix.m.begin());
  return Value(matrix);
}

Type TypeOf(NodeAttribute::Type type) {
  constexpr Type kTypes[] = {Type::kDouble, Type::kDouble3, Type::kQuaternion, Type::kMatrix};
  return kTypes[static_cast<int>(type)];
}

// A type's function with what it needs to be called; its kernel has the points that are wanted as well.
struct Function {
  std::function<std::string(const NodeCall&)> compute;
  struct Attribute {
    std::string name;
    std::size_t numbers = 0;
  };
  std::vector<Attribute> inputs, outputs;
  bool deformer = false;
};
struct Kernel {
  std::shared_ptr<const Function> function;
  std::vector<Index> points;  // of a deformer: those that come out, of all
};

std::string Call(const Function& function, const NodeCall& call) {
  try {
    return function.compute(call);
  } catch (...) {
    return ThrownText();
  }
}

// Values are read and written where they stand: numbers in a row (base/types.h).
void Compute(ComputeContext& c) {
  const auto& kernel = c.kernel_as<Kernel>();
  const Function& function = *kernel.function;
  const int first = function.deformer ? 1 : 0;  // after inPoints, outPoints
  std::vector<Row<const double>> inputs;
  std::vector<Row<double>> outputs;
  for (std::size_t i = 0; i < function.inputs.size(); ++i) {
    const auto& [name, numbers] = function.inputs[i];
    inputs.emplace_back(std::span(&c.slot<double>(first + static_cast<int>(i)), numbers), name);
  }
  for (std::size_t i = 0; i < function.outputs.size(); ++i) {
    const auto& [name, numbers] = function.outputs[i];
    outputs.emplace_back(std::span(&c.out_slot<double>(first + static_cast<int>(i)), numbers), name);
  }
  NodeCall call;
  call.inputs = {inputs, "inputs"}, call.outputs = {outputs, "outputs"};
  call.points = {{}, "points"}, call.out_points = {{}, "out_points"};
  if (!function.deformer) {
    if (const std::string wrong = Call(function, call); !wrong.empty()) c.host->Fail(wrong);
    return;
  }
  const ConstPointsView in = c.slot<ConstPointsView>(0);
  std::vector<float> points(3 * std::size_t{in.count});
  for (std::size_t i = 0; i < in.count; ++i)
    points[3 * i] = in.x[i], points[3 * i + 1] = in.y[i], points[3 * i + 2] = in.z[i];
  std::vector<float> moved = points;
  call.points = {points, "points"}, call.out_points = {moved, "out_points"};
  if (const std::string wrong = Call(function, call); !wrong.empty()) return c.host->Fail(wrong);
  const PointsView out = c.out_slot<PointsView>(0);
  for (std::size_t i = 0; i < out.count; ++i) {
    const std::size_t from = 3 * std::size_t{kernel.points[i]};
    out.x[i] = moved[from], out.y[i] = moved[from + 1], out.z[i] = moved[from + 2];
  }
}

}  // namespace

std::string PrototypeNodeOf(const Graph& graph) {
  for (const NodeId node : graph.Nodes()) {
    if (graph.def(node).prototype) return graph.name(node);
  }
  return "";
}

std::string PrototypeNodeAbove(const Graph& graph, std::span<const PlugRef> plugs) {
  std::set<Index> seen;
  std::vector<NodeId> nodes;
  const auto add = [&](NodeId node) {
    if (seen.insert(node.index).second) nodes.push_back(node);
  };
  for (const PlugRef& plug : plugs) add(plug.node);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const NodeId node = nodes[i];
    if (graph.def(node).prototype) return graph.name(node);
    for (const Connection& input : graph.Inputs(node)) add(input.source.node);
  }
  return "";
}

Status DeclareNode(const NodeType& type, NodeRegistry* registry) {
  const auto wrong = [&](std::string_view what) {
    return Status::Usage("node type \"{}\": {}", type.name, what);
  };
  if (!type.compute) return wrong("expected a function that computes it");
  if (type.outputs.empty() && !type.deformer) return wrong("expected an output");
  auto function = std::make_shared<Function>();
  function->compute = type.compute;
  function->deformer = type.deformer;
  NodeBuilder node = registry->add(type.name, type.doc);
  node.category("prototype").prototype();
  if (type.deformer) node.points_in("inPoints", "the points to deform").per_geometry();
  for (const NodeAttribute& input : type.inputs) {
    const std::size_t count = NumbersIn(input.type);
    if (!input.value.empty() && input.value.size() != count)
      return wrong(fmt::format("{}: expected {} numbers, got {}", input.name, count, input.value.size()));
    function->inputs.push_back({input.name, count});
    node.in(input.name, DefaultOf(input));
  }
  if (type.deformer) node.out("outPoints", Type::kPoints, "the deformed points").per_geometry();
  for (const NodeAttribute& output : type.outputs) {
    function->outputs.push_back({output.name, NumbersIn(output.type)});
    node.out(output.name, TypeOf(output.type));
  }
  if (type.deformer && !type.outputs.empty())
    return wrong("a deformer gives points; expected no other outputs");
  node.compute(&Compute);
  node.bind([function](const Binding& binding) -> Result<BoundKernel> {
    auto kernel = std::make_shared<Kernel>();
    kernel->function = function;
    if (function->deformer) kernel->points = binding.output("outPoints").ToVector();
    return BoundKernel{std::move(kernel), 0, 0};
  });
  if (type.deformer)
    node.demand(
        [](Demand& demand) { demand.Require("inPoints", 0, PointSet::All(demand.input_total("inPoints"))); });
  return Status();
}

}  // namespace kpsa::engine
