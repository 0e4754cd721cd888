// The language of graph tests: build a graph from a few lines, pull plugs, count computes.
//
//   TestGraph g;
//   g.add("remapValue", "r", {{"inputValue", 5.0}, {"inputMax", 10.0}});
//   EXPECT_DOUBLE_EQ(g.pull<double>("r.outValue"), 0.5);
//
// For laziness: g.vary("a.input"); g.set("a.input", 2.0); g.pull<double>("b.output"); g.computes("a").
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/compiler.h"
#include "graph/evaluator.h"
#include "graph/graph.h"

namespace kpsa::engine {

class TestGraph {
 public:
  explicit TestGraph(const NodeRegistry& registry) : graph(registry) {}

  NodeId add(const std::string& type, const std::string& name,
             const std::vector<std::pair<std::string, Value>>& values = {}) {
    Result<NodeId> node = graph.AddNode(type, name);
    EXPECT_TRUE(node.ok()) << node.status().ToString();
    for (const auto& [attribute, value] : values) hold(name + "." + attribute, value);
    return *node;
  }
  void hold(const std::string& plug_name, Value value) {
    const Status status = graph.Set(plug(plug_name), std::move(value));
    EXPECT_TRUE(status.ok()) << status.ToString();
    plan = nullptr;
  }
  void connect(const std::string& source, const std::string& destination) {
    const Status status = graph.Connect(plug(source), plug(destination));
    EXPECT_TRUE(status.ok()) << status.ToString();
    plan = nullptr;
  }
  PlugRef plug(const std::string& name) const {
    Result<PlugRef> found = graph.FindPlug(name);
    EXPECT_TRUE(found.ok()) << found.status().ToString();
    return found.ok() ? *found : PlugRef();
  }
  void vary(const std::string& name) {
    request.varying.push_back(plug(name));
    plan = nullptr;
  }
  // Asks for an output; pull does so by itself for plugs that nobody asked for before.
  Index want(const std::string& name, PointSet points = {}) {
    for (Index i = 0; i < request.outputs.size(); ++i) {
      if (names[i] == name) return i;
    }
    request.outputs.push_back({plug(name), std::move(points)});
    names.push_back(name);
    plan = nullptr;
    return static_cast<Index>(request.outputs.size() - 1);
  }
  Status compile() {
    if (plan != nullptr) return Status();
    Result<std::shared_ptr<const Plan>> compiled = compiler.Compile(graph, request);
    if (!compiled.ok()) return compiled.status();
    plan = *compiled;
    evaluator = std::make_unique<Evaluator>(plan, options);
    profile = std::make_unique<Profile>(*plan);
    evaluator->Record(profile.get());
    return Status();
  }
  template <typename T>
  void set(const std::string& name, const T& value) {
    ASSERT_TRUE(compile().ok());
    const PlugRef p = plug(name);
    const Result<PlugHandle> handle = evaluator->FindVarying(graph, p);
    ASSERT_TRUE(handle.ok()) << handle.status().ToString();
    // Without the check of values: nodes must bear impossible ones
    if constexpr (std::is_integral_v<T>) {
      evaluator->SetInt(handle->varying, value);
    } else if constexpr (std::is_same_v<T, double>) {
      evaluator->Set(handle->varying, value, handle->component);
    } else {
      evaluator->Set(handle->varying, value);
    }
  }
  Status try_pull(const std::string& name) {
    const Index output = want(name);
    Status status = compile();
    return status.ok() ? evaluator->Pull(output) : status;
  }
  template <typename T>
  T pull(const std::string& name) {
    const Status status = try_pull(name);
    EXPECT_TRUE(status.ok()) << status.ToString();
    return status.ok() ? evaluator->Get<T>(want(name)) : T();
  }
  std::vector<float> pull_points(const std::string& name) {  // x0 y0 z0 x1 ...
    const Status status = try_pull(name);
    EXPECT_TRUE(status.ok()) << status.ToString();
    std::vector<float> xyz;
    if (!status.ok()) return xyz;
    const ConstPointsView p = evaluator->Points(want(name));
    for (std::size_t i = 0; i < p.count; ++i) {
      for (const float* component : {p.x, p.y, p.z}) {
        if (component != nullptr) xyz.push_back(component[i]);
      }
    }
    return xyz;
  }
  // How often steps of a node computed since the plan was made, with or without a label ("gather").
  std::uint64_t computes(const std::string& node, const std::string& label = "") const {
    std::uint64_t count = 0;
    for (Index s = 0; plan != nullptr && s < plan->steps().size(); ++s) {
      if (node == plan->step_name(s) && label == plan->step_label(s)) count += profile->counts()[s];
    }
    return count;
  }

  Graph graph;
  Request request;
  std::vector<std::string> names;
  Compiler compiler;
  EvaluatorOptions options;
  std::shared_ptr<const Plan> plan;
  std::unique_ptr<Evaluator> evaluator;
  std::unique_ptr<Profile> profile;
};

}  // namespace kpsa::engine

namespace kpsa {
using engine::TestGraph;  // node authors test with it
}
