// VRM's part of a character graph (gltf/vrm.h says what is read).
//
// Expressions: one node `expressions` (vrmExpressions) with a control for each, `expressions.weight[happy]`,
// 0 to 1; and for every mesh node that one of them moves a vrmMorphWeights before its blendShape, whose
// `weight` is then what `<mesh>.weight[...]` names and what clips drive. Constraints: `<node>_constraint`, a
// vrmRollConstraint, vrmAimConstraint or vrmRotationConstraint that drives the offsetParentMatrix of its
// transform; clips go to its inMatrix. Those that would follow what follows them are left out, with a note.
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "graph/graph.h"
#include "gltf/import.h"

namespace kpsa::engine {

struct CharacterGraph;
struct CharacterMesh;

class VrmGraph {
 public:
  VrmGraph(const gltf::Character& character, CharacterGraph* scene, Graph* graph);

  // Before the meshes. Errors: more expressions than kMaxExpressions.
  Status AddExpressions();
  // Where expressions move the mesh: mesh->morph_weights, connected to its blendShape. `names` are the
  // targets'.
  Status AddMorphWeights(const std::vector<std::string>& names, CharacterMesh* mesh);
  // After all transforms. Errors: more constraints than kMaxNodeConstraints.
  Status AddConstraints();

  static constexpr std::size_t kMaxExpressions = 4096;
  static constexpr std::size_t kMaxNodeConstraints = 1000;
  static constexpr std::size_t kMaxBinds = std::size_t{1} << 22;  // looked at, for all mesh nodes together

 private:
  Status AddConstraint(const gltf::NodeConstraint& constraint, std::vector<std::string>* left_out);

  const gltf::Character& character_;
  CharacterGraph& scene_;
  Graph* graph_;
  // By glTF mesh: expressions and their binds
  std::unordered_map<Index, std::vector<std::pair<Index, const gltf::ExpressionBind*>>> binds_;
  std::size_t looked_at_ = 0;
};

}  // namespace kpsa::engine
