#include "kpsa/bound_patches.h"

#include <algorithm>
#include <iterator>

namespace kpsa::engine {
namespace {

PointSet Among(const std::vector<Index>& points, const PointSet& wanted) {
  std::vector<Index> of;
  std::ranges::copy_if(points, std::back_inserter(of), [&](Index point) { return wanted.Contains(point); });
  return PointSet::Of(std::move(of), wanted.total());
}

}  // namespace

PointSet WantedOfRegion(const PatchRegion& region, std::span<const PatchPoints> patches,
                        const PointSet& wanted) {
  return Among(PointsOfRegion(region, patches), wanted);
}

BoundPatches::BoundPatches(const PatchLayout& layout, std::span<const PatchPoints> patches,
                           const std::function<PointSet(Index output)>& wanted,
                           const std::function<PointSet(Index region)>& held) {
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const PatchPoints& of = patches[p];
    const PointSet asked = wanted(of.output), points = Among(of.points, asked);
    Patch& patch = patches_.emplace_back();
    patch.output = of.output;
    patch.places = asked.PositionsOf(points);
    for (std::size_t i = 0; i < of.points.size(); ++i) {
      if (asked.Contains(of.points[i])) patch.weights.push_back(of.weights[i]);
    }
    for (std::size_t r = 0; r < layout.regions.size(); ++r) {
      const PatchRegion& region = layout.regions[r];
      if (p < region.first || p >= region.first + region.count) continue;
      patch.held.push_back({static_cast<Index>(r), held(static_cast<Index>(r)).PositionsOf(points)});
    }
  }
}

void BoundPatches::Patch::Blend(float weight, ConstPointsView exact, const std::vector<Index>& from,
                                PointsView out) const {
  float* const to[3] = {out.x, out.y, out.z};
  const float* const of[3] = {exact.x, exact.y, exact.z};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const float w = weight * weights[i];
    const Index place = places[i];
    for (int a = 0; a < 3; ++a) {
      const float value = of[a][from[i]];
      to[a][place] = w >= 1 ? value : to[a][place] + w * (value - to[a][place]);
    }
  }
}

void BoundPatches::Blend(const PatchChoice& choice, Index output, ConstPointsView full,
                         const ArrayView<ConstPointsView>& regions, PointsView out) const {
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    const Patch& patch = patches_[p];
    if (patch.output != output || patch.places.empty() || !(choice.weights[p] > 0)) continue;
    if (choice.full) patch.Blend(choice.weights[p], full, patch.places, out);
    for (const Held& held : patch.held) {
      if ((choice.regions >> held.region & 1) != 0)
        patch.Blend(choice.weights[p], regions[held.region], held.places, out);
    }
  }
}

}  // namespace kpsa::engine
