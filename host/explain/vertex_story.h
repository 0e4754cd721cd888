// What moves one vertex at one time: the joints, the morph targets and the stages of its mesh's stack.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

// Lengths in metres. "Moved" is against the same rig at rest: no clip, no pose, nothing set.
struct VertexStory {
  struct Stage {
    std::string name, type;
    bool world = false;  // its points are in world space, not in the mesh's
    double weight = 1;   // of the point in the deformer's weight map
    std::optional<double> envelope = {};
    double moved = 0;  // how far the stage moves the point from where the stage before has it; a stage that
                       // carries it to world space, from where it would carry it at rest
  };
  struct Joint {
    std::string name;
    double weight = 0;
    double moved = 0;  // the part of the skin's movement that is this joint's
  };
  struct Morph {
    std::string name;
    double size = 0;    // displacement at weight 1
    double weight = 0;  // now
  };
  std::string mesh;
  Index vertex = 0, point = 0, points = 0;
  double time = 0;
  std::array<double, 3> rest{}, position{};  // after the last stage
  double moved = 0;                          // between these two
  std::vector<Stage> stages;
  std::vector<Joint> joints;  // heaviest first
  std::vector<Morph> morphs;  // that touch the point; those that move it most first
};

// A vertex of a mesh of the rig, counted over the primitives of its file.
struct VertexName {
  const CharacterMesh* mesh = nullptr;
  Index vertex = 0;
};

// `rest` is the same rig without clip, pose and settings.
Result<VertexStory> TellOfVertex(const Rig& rig, const Rig& rest, const VertexName& name, double time);

}  // namespace kpsa::engine
