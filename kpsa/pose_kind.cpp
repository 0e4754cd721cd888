#include "kpsa/pose_kind.h"

namespace kpsa::engine {

const char* PoseKindName(PoseKind kind) {
  constexpr const char* kNames[] = {"sampled", "mixtures", "neighbours", "beyond the ranges",
                                    "held controls"};
  return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace kpsa::engine
