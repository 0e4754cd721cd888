// What subspaces measure, and where on the character that is.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "host/acceleration.h"
#include "rig/build/rig_builder.h"

namespace kpsa::engine {

struct CueMark {
  enum class Kind { kPoint, kMatrix, kScalar, kProduct };
  std::string name;  // "face_mesh@skin[812]", "head.matrix", "crownHigh.outValue"
  Kind kind = Kind::kScalar;
  std::string stage;                  // of a point: "skin"
  std::optional<std::size_t> vertex;  // of V (host/clip_record.h): of a point the one that it is, of a
                                      // matrix the nearest at rest
  std::optional<std::array<double, 3>> position;  // metres, world space, at rest
  std::string sees;                               // in words: what is measured of it
  struct Cue {
    std::size_t subspace = 0, cue = 0;  // of those that were applied; of its Subspace::cues
  };
  std::vector<Cue> cues;  // that it stands for
};
const char* KindName(CueMark::Kind kind);  // "point", "matrix", "scalar", "product"

// Of all subspaces: points, then matrices (the entries of one together), scalars and products. `rig` has the
// subspaces in place; vertices: [V, 3] at rest.
Result<std::vector<CueMark>> MarkCues(const Rig& rig, const std::vector<AppliedSubspace>& applied,
                                      std::span<const float> vertices);

}  // namespace kpsa::engine
