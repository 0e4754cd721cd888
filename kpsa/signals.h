// What can move a set of points besides points themselves: the local matrices of the transforms upstream, and
// the small values (morph weights, envelopes, drivers) that enter steps with points. They guard a subspace (a
// value outside its trained range is a miss) and serve as cheap cues.
//
// A matrix is measured as 12 entries (its upper three rows, column by column: three axes and the
// translation), so no angle has to be computed; a value as one entry.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "graph/compiler.h"

namespace kpsa::engine {

struct Signal {
  std::string name;  // "jaw.matrix", "head_mesh_blendShape.weight[smile]", "cage.points[3].y"
  PlugRef plug;      // a matrix or a double (children of vectors are signals of their own)
  bool matrix = false;
  // The world matrix of a transform, which is measured relative to the space of the points.
  bool relative = false;
  std::size_t entries() const { return matrix ? 12 : 1; }
};
// The entries of a matrix, in the order above.
void MatrixEntries(const Matrix4& m, double entries[12]);
// "jaw.matrix/3": entry 3 of a matrix; a value's name is its signal's.
std::string EntryName(const Signal& signal, std::size_t entry);
// The inverse: the signal's name, and the entry of a matrix. No attribute is a number, so that names with a
// '/' in them, "a/b.outValue", are told from it.
struct SignalEntry {
  std::string signal;
  std::optional<std::size_t> entry;
};
SignalEntry SplitEntryName(const std::string& name);

// The world matrices of transforms that enter steps with points under `varying`, sorted by name: cues that a
// skinCluster is linear in, as it is not in local matrices, which multiply along a chain; and
// the first that stands still, since relative to a space that moves it does not. No guards. Errors as of
// FindSignals.
Result<std::vector<Signal>> FindRelativeMatrices(const Graph& graph, Compiler* compiler,
                                                 const std::vector<PlugRef>& outputs,
                                                 const std::vector<PlugRef>& varying);
// Whether a plug is the world matrix of a transform.
bool IsWorldMatrix(const Graph& graph, const PlugRef& plug);

// The nodes from `node` up through parentMatrix.
std::vector<NodeId> ParentsFrom(const Graph& graph, NodeId node);

// All signals of the points `outputs` under the varying plugs `varying`, sorted by name. The local matrices
// of the transforms `carried` are left out: they move the points with their space. `unguarded` receives
// varying inputs that are no signals (arrays of points that are set from outside). Points that depend on a
// stateful node (NodeDef::stateful) are an error that names it.
Result<std::vector<Signal>> FindSignals(const Graph& graph, Compiler* compiler,
                                        const std::vector<PlugRef>& outputs,
                                        const std::vector<PlugRef>& varying, const std::set<Index>& carried,
                                        std::vector<std::string>* unguarded);
// The same of steps that Compiler::Steps gave of these outputs.
Result<std::vector<Signal>> FindSignals(const Graph& graph, const std::vector<Compiler::Stepped>& steps,
                                        const std::vector<PlugRef>& varying, const std::set<Index>& carried,
                                        std::vector<std::string>* unguarded);

}  // namespace kpsa::engine
