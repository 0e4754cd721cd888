// Patches of a subspace (kpsa/patches.h) in a plan of the KPSA node: which of their points are wanted, where
// these are in what the node writes and in what it reads. Immutable; for any thread.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/points.h"
#include "base/types.h"
#include "graph/compute_context.h"
#include "graph/point_set.h"
#include "kpsa/patches.h"

namespace kpsa::engine {

// The points of a region that some of the wanted ones of its output are.
PointSet WantedOfRegion(const PatchRegion& region, std::span<const PatchPoints> patches,
                        const PointSet& wanted);

class BoundPatches {
 public:
  BoundPatches() = default;
  // wanted: the points of an output that are asked for; held: those of a region that are evaluated.
  BoundPatches(const PatchLayout& layout, std::span<const PatchPoints> patches,
               const std::function<PointSet(Index output)>& wanted,
               const std::function<PointSet(Index region)>& held);

  std::size_t count() const { return patches_.size(); }
  // Points of an output that have been reconstructed go over into exact ones where patches are doubtful: into
  // `full`, its wanted points, or into those of the regions that were evaluated.
  void Blend(const PatchChoice& choice, Index output, ConstPointsView full,
             const ArrayView<ConstPointsView>& regions, PointsView out) const;

 private:
  struct Held {
    Index region = 0;
    std::vector<Index> places;  // of the patch's points, in those of the region
  };
  struct Patch {
    Index output = 0;
    std::vector<Index> places;   // of its wanted points, in what is written
    std::vector<float> weights;  // theirs
    std::vector<Held> held;      // by regions that it belongs to
    // from: the places of its points in the exact ones.
    void Blend(float weight, ConstPointsView exact, const std::vector<Index>& from, PointsView out) const;
  };
  std::vector<Patch> patches_;
};

}  // namespace kpsa::engine
