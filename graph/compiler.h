// Request -> plan. Works backward from the request (only needed nodes, only needed points), folds what
// depends on no varying plug, binds kernels to their point sets, and lays out values.
//
// A Compiler keeps kernels and rest states between compilations, keyed by content: an edit of the graph
// rebinds only what it changed. Not thread-safe; the plans that it gives are.
#pragma once

#include <memory>
#include <vector>

#include "graph/graph.h"
#include "graph/last_step.h"
#include "graph/plan.h"

namespace kpsa::engine {

struct CompileStats {
  Index kernels_bound = 0, kernels_reused = 0;  // in the last Compile
  Index rest_evaluated = 0;
};

class Compiler {
 public:
  Compiler();
  ~Compiler();
  Compiler(const Compiler&) = delete;
  Compiler& operator=(const Compiler&) = delete;

  // Errors: a structural attribute driven by something that varies (names both ends), a kernel that cannot be
  // bound (the node's reason), a demanded point out of range, what a node's own functions throw.
  Result<std::shared_ptr<const Plan>> Compile(const Graph& graph, const Request& request);
  // The value of a plug with everything at its default and no clip (DESIGN of rest states: node_def.h,
  // Structural::rest).
  Result<Value> Rest(const Graph& graph, const PlugRef& plug);
  // The last step of the node that gives these points (NodeDef::last_step), and the points that come into it. Null where
  // it has none, or where an input besides points and matrices is driven: it might vary.
  struct SplitPoints {
    std::shared_ptr<const LastStep> step;
    PlugRef in;
  };
  Result<SplitPoints> Split(const Graph& graph, const PlugRef& points);
  const CompileStats& stats() const;

  // A node that a plan of the request has a step of.
  struct Stepped {
    NodeId node;
    bool points = false;  // of one that has points
  };
  // Of all nodes, without repetition, which is what Compile does before it binds. Errors: those of Compile that are
  // found by then.
  Result<std::vector<Stepped>> Steps(const Graph& graph, const Request& request);
  // Steps, and Split of each of these points, of which the request has what comes into them: cheaper than one after the
  // other. A plug without an attribute (-1) is not split.
  struct Survey {
    std::vector<Stepped> steps;
    std::vector<SplitPoints> split;
  };
  Result<Survey> SurveyOf(const Graph& graph, const Request& request, const std::vector<PlugRef>& points);

 private:
  Result<std::shared_ptr<const Plan>> CompileOrThrow(const Graph& graph, const Request& request);
  Result<Survey> SurveyOrThrow(const Graph& graph, const Request& request,
                               const std::vector<PlugRef>& points);
  Result<SplitPoints> SplitOrThrow(const Graph& graph, const PlugRef& points);
  Result<Value> RestOrThrow(const Graph& graph, const PlugRef& plug);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kpsa::engine
