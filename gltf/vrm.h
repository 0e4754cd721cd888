// What is read of VRM's extensions of glTF: expressions of VRM 0.x (`VRM`, blendShapeMaster) and of VRM 1.0
// (`VRMC_vrm`, expressions), and node constraints (`VRMC_node_constraint` 1.0). Of expressions only what
// moves points: morph targets, and how expressions hold one another back.
//
// None of it is needed to show the character: what is damaged is left out, with one warning.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/types.h"

namespace kpsa::engine::gltf {

// A share of one morph target at an expression's full weight.
struct ExpressionBind {
  Index mesh = kNoIndex;
  Index node = kNoIndex;  // whose mesh it is (VRM 1.0); kNoIndex: wherever the mesh is shown (VRM 0.x)
  Index target = 0;
  double weight = 0;  // 0 .. 1
};

struct Expression {
  // What systems move by themselves, so that other expressions may hold it back.
  enum class Kind : std::uint8_t { kOther, kBlink, kLookAt, kMouth };
  enum class Override : std::uint8_t { kNone, kBlock, kBlend };
  std::string name;  // VRM 1.0: the key; VRM 0.x: presetName, or name where that is unknown. Unique.
  Kind kind = Kind::kOther;
  bool is_binary = false;  // above 0.5: all of it, else nothing
  Override blink = Override::kNone, look_at = Override::kNone, mouth = Override::kNone;
  std::vector<ExpressionBind> binds;
};

struct NodeConstraint {
  enum class Type : std::uint8_t { kRoll, kAim, kRotation };
  Index node = kNoIndex, source = kNoIndex;  // never the same
  Type type = Type::kRotation;
  int axis = 0;       // kRoll: 0 to 2, x to z; kAim: 0 to 5, +x, -x, +y, -y, +z, -z
  double weight = 1;  // 0 .. 1
};

}  // namespace kpsa::engine::gltf
