// Characters that nobody tuned the program for: made from a seed, written as .glb.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "bench/untouched_surface.h"
#include "scenes/glb_writer.h"

namespace kpsa::engine::untouched {

enum class Kind : std::uint8_t { kBody, kHead, kCreature };
inline constexpr std::array kKinds{Kind::kBody, Kind::kHead, Kind::kCreature};
const char* KindName(Kind kind);
std::size_t UsualPoints(Kind kind);

// One skinned mesh, its morph targets, its joints, 5 or 6 clips at 30 fps. The same seed and number of points
// give the same character on every machine. About so many points are made.
scenes::GlbScene MakeCharacter(Kind kind, std::uint64_t seed, std::size_t points);
// The clip that is made by another formula than the others, in the ranges that they have.
std::string TestClip(Kind kind);

// Weights from distances to the part's bones in terms of their reach: those nearest to a point, and what
// hangs on it or it hangs on; smoothed over the surface. The four strongest.
std::vector<scenes::Influences> WeighSurface(const Design& design, const Part& part, const Surface& surface);

}  // namespace kpsa::engine::untouched
