// Misses that cost a part. The points of a subspace lie in patches, consecutive tiles of an
// output. Where the doubts of tiles judge, a patch that is too doubtful is evaluated fully, with a border
// over which it goes over into what is reconstructed; the rest is reconstructed. Neighbouring patches share
// what deformers ask for about them, so regions of one, two, four... of them are evaluated as is cheapest.
// Frames do not depend on their order, and points not on what their full evaluation is a part of.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "base/matrix.h"
#include "base/scalar_math.h"
#include "base/types.h"

namespace kpsa::engine {

inline constexpr std::size_t kMaxPatches = 62, kMaxRegions = 62;  // lazy inputs of a node are 64
inline constexpr double kWholeFrom = 0.25;      // share of patches, from which all points come in,
inline constexpr double kWholeAt = 0.5;         // and at which they are exact
inline constexpr double kMostOfFull = 0.8;      // of the full evaluation: what costs more is no gain
inline constexpr std::size_t kFewestTiles = 4;  // of all outputs; with fewer nothing would be local

// Neighbouring patches that are evaluated together, since what deformers ask for about them is shared: one
// patch; or two regions, or the last one alone, of the level below.
struct PatchRegion {
  Index output = 0, first = 0, count = 1;  // patches
  Index level = 0;                         // 0: one patch
  Index below = kNoIndex;                  // the first of them, at a higher level
  Index belows = 0;
  bool top = false;  // of the highest level of its output
  friend bool operator==(const PatchRegion&, const PatchRegion&) = default;
};

struct PatchLayout {
  std::size_t tiles = 0;  // of a patch; the last one of an output may have fewer. 0: misses are of all points
  std::vector<PatchRegion> regions;  // output after output, level after level
  std::size_t patches = 0;
  // Of the largest doubt, in (0, 1]: errors are found by that, since one patch knows of a strange pose what
  // another does not. So where it is too large, all patches are with at least this share of what is too
  // large.
  double share = 1;
  // Misses are of all points, and patches miss by themselves only in the blend between a hit and a miss: each by
  // PatchScoreInBlend of its own doubt. `share` does not count.
  bool blends_only = false;
  std::vector<double> costs;  // of each region, of a full evaluation
  friend bool operator==(const PatchLayout&, const PatchLayout&) = default;
};
// With as few tiles a patch as there are regions; without costs. tiles 0 where nothing would be local.
PatchLayout MakePatchLayout(std::span<const std::size_t> tiles_of_outputs);

// What counts of a patch, from its own doubt and the largest one of all: one of them has the largest.
inline double PatchDoubt(const PatchLayout& layout, double own, double largest) {
  return std::min(largest, own / layout.share);
}

// Which points of its output a patch is evaluated for, ascending, and how much of that they take where it is
// wanted alone: 1 in its tiles, less in the border, which is three typical distances of neighbours wide.
struct PatchPoints {
  Index output = 0;
  std::vector<Index> points;
  std::vector<float> weights;
};
// The points of an output, at rest; those that are not finite lie nowhere. starts: of each tile, its first point, a
// multiple of PointBlocks::kSize (SteppedPoints::starts); empty: tiles have kTilePoints each.
struct PlacedOutput {
  std::vector<Double3> positions;
  std::span<const Index> starts = {};
};
std::vector<PatchPoints> MakePatches(std::span<const PlacedOutput> outputs, std::size_t tiles_of_patch);

// The points of any patch of a region.
std::vector<Index> PointsOfRegion(const PatchRegion& region, std::span<const PatchPoints> patches);

// What a frame does.
struct PatchChoice {
  std::array<float, kMaxPatches> weights{};  // of each patch in its own tiles
  double all = 0;                            // of all points
  double mean = 0;                           // of the weights
  double cost = 0;                           // of a full evaluation
  bool full = false;                         // all points are evaluated,
  std::uint64_t regions = 0;                 // or these; bit by region
};
// At least this weight for the patches of a mask (TrainedRange::patches).
inline void RaisePatches(std::uint64_t mask, float weight, std::span<float> weights) {
  for (; mask != 0; mask &= mask - 1) {
    float& patch = weights[static_cast<std::size_t>(std::countr_zero(mask))];
    patch = std::max(patch, weight);
  }
}
// How much of all points comes in, by the mean of the patches' weights.
inline double WholeWeight(double mean) {
  return Smoothstep(std::clamp((mean - kWholeFrom) / (kWholeAt - kWholeFrom), 0.0, 1.0));
}
// From the weights, and what all points ask for anyway (guards): the regions that hold all patches with a
// weight, and together cost least.
void ChooseRegions(const PatchLayout& layout, double all, PatchChoice* choice);

}  // namespace kpsa::engine
