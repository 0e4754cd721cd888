// The graph rewrite that puts a KPSA node in the place of a stack: consumers of the accelerated points read
// the node, its cues read the stack where the subspace says, its fullPoints stay connected to the stack,
// lazily.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "graph/compiler.h"
#include "kpsa/kpsa_node.h"
#include "kpsa/signals.h"
#include "kpsa/signature.h"

namespace kpsa::engine {

// Points to accelerate: of one mesh, up to and including a stage; and the stages before it, where cues may
// lie.
struct AccelerationTarget {
  struct Stage {
    std::string name;
    PlugRef points;
    bool world = true;  // world space; else mesh space
  };
  struct MeshPoints {
    std::string name;           // "head_mesh@mush", as the subspace calls it
    std::vector<Stage> stages;  // up to and including the accelerated one, which is the last
  };
  std::vector<MeshPoints> meshes;
  std::vector<Stage> all_stages;  // of all meshes of the rig: in which space points are
  bool colors = false;            // they are light at shading points, and no points of meshes
  std::vector<PlugRef> space;     // none, or the worldMatrix of the frame
  std::string space_name;         // "" for the world, or what is the world to a rig within another one
  RigWithin within;
  std::vector<PlugRef> varying;   // time, controls: all that may vary
  std::vector<PlugRef> controls;  // of these, the ones whose held value is no part of the rig's identity
  std::vector<PlugRef> outputs() const;
};

// Of each mesh, what its last step is and what comes into it, where it has one that no control reaches
// (graph/last_step.h).
Result<std::vector<Compiler::SplitPoints>> SplitMeshes(const Graph& graph, Compiler* compiler,
                                                       const AccelerationTarget& target);

// The points of a plug in the rest pose. Errors: they cannot be evaluated.
Result<std::vector<Double3>> RestPoints(const Graph& graph, Compiler* compiler, const PlugRef& points);

struct AccelerateOptions {
  double tolerance = -1;          // metres; below 0: the subspace's own; infinity: pure KPSA
  double violation_rate = -1;     // below 0: the subspace's own
  bool stale_is_miss = false;     // a stale subspace evaluates everything fully instead of being refused
  std::string stale_option = {};  // what people call that where they choose it, for errors; or ""
};

struct Accelerated {
  NodeId node;
  std::shared_ptr<const KpsaConfig> config;
  std::vector<std::string> notes;  // what may surprise
};

// Puts subspaces into a graph, all at once: each is checked against the graph as it was, and what one of them
// accelerates may drive what another does, in any order. Cues, guards and full evaluations read the stacks,
// never another KPSA node, as training did; nodes that no accelerated points depend on read the KPSA nodes.
class Accelerator {
 public:
  Accelerator(Graph* graph, Compiler* compiler) : graph_(graph), compiler_(compiler) {}
  // Errors: a subspace of other meshes or stages, or of a rig that differs (named). The graph is not changed.
  Status Add(const AccelerationTarget& target, std::shared_ptr<const Subspace> subspace,
             const std::string& node_name, const AccelerateOptions& options);
  // Adds the nodes and connects them; in the order of Add. On an error the graph is as it was.
  Result<std::vector<Accelerated>> Apply();

 private:
  struct Entry;
  static Result<Accelerated> Rewrite(const Entry& entry, const std::set<Index>& above, Graph* graph);
  Graph* graph_;
  Compiler* compiler_;
  std::vector<std::shared_ptr<const Entry>> entries_;
};

// One subspace alone.
Result<Accelerated> Accelerate(Graph* graph, Compiler* compiler, const AccelerationTarget& target,
                               std::shared_ptr<const Subspace> subspace, const std::string& node_name,
                               const AccelerateOptions& options);

}  // namespace kpsa::engine
