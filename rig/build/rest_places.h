// Inside of the rig builder: places in the world at rest that a rig file names. Nothing outside rig/build includes
// this.
#pragma once

#include <string>

#include "rig/build/made_nodes.h"
#include "rig/character/rest_pose.h"

namespace kpsa::engine {

// local_from_parent of a transform with everything as set; the identity for what carries a referenced character.
Matrix4 LocalAtRest(const Rig& rig, NodeId transform);

// Refers to its arguments. All return false after an error. Handles are placed when they are first asked for: what
// is placed `at` one of them waits for it. That sets offsetParentMatrix and may connect parentMatrix.
class RestPlaces {
 public:
  RestPlaces(const BuildInput& in, const RestCurves& curves, RestPose* rest, MadeNodes* nodes, Graph* graph)
      : in_(in), curves_(curves), rest_(rest), nodes_(nodes), graph_(graph) {}

  // A curve (its middle cv), a cv (`lips[2]`), a transform, {vertex: 812, mesh: NAME} or [x, y, z].
  bool Read(const YamlNode& node, int source, Double3* place) { return ReadPlace(node, source, 0, place); }
  // Of vertices of a mesh (of the only one, where none is named).
  bool VertexPlaces(const YamlNode& vertices, const YamlNode* mesh, Places* places) const;
  // world_from_local of a transform with everything as set and no connection followed but its parent's. Errors of
  // what it hangs under are at `asked`.
  bool WorldOf(NodeId transform, const YamlNode& asked, Matrix4* world) {
    return RestWorld(transform, asked, 0, world);
  }
  // Follows `at`: sets offsetParentMatrix so that translate 0 is at the place. The axes stay the parent's.
  bool Place(MadeNode* made) { return Place(made, 0); }

 private:
  bool ReadPlace(const YamlNode& node, int source, int depth, Double3* place);
  bool RestWorld(NodeId transform, const YamlNode& asked, int depth, Matrix4* world);
  bool Place(MadeNode* made, int depth);
  bool HangUnderReference(const MadeNode& made, const YamlNode& at);
  const Places* CurveOf(const std::string& name) const;

  const BuildInput& in_;
  const RestCurves& curves_;
  RestPose* rest_;
  MadeNodes* nodes_;
  Graph* graph_;
};

}  // namespace kpsa::engine
