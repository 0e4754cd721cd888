#include "kpsa/output_reconstruction.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/check.h"
#include "kpsa/rigid_points.h"
#include "kpsa/scratch_points.h"

namespace kpsa::engine {
namespace {

// That hold these rows, ascending.
std::vector<Index> TilesWith(std::span<const Index> rows) {
  std::vector<Index> tiles;
  for (const Index row : rows) {
    const auto tile = static_cast<Index>(row / kTilePoints);
    if (tiles.empty() || tiles.back() != tile) tiles.push_back(tile);
  }
  return tiles;
}

}  // namespace

OutputReconstruction::OutputReconstruction(std::shared_ptr<const Subspace> subspace, std::size_t output,
                                           const PointSet& wanted, const LastStep* step)
    : subspace_(std::move(subspace)), output_(output), all_(wanted.is_all()) {
  if (step != nullptr && subspace_->outputs[output_].inner > 0) {
    step_ = step->Bind(wanted);
  } else if (step != nullptr) {
    mends_ = BoundMends(subspace_->mends, tiles(), static_cast<Index>(output_), wanted, *step);
  }
  if (direct()) return;
  padded_ = PaddedCount(subspace_->outputs[output_].reconstructed());
  if (step_ == nullptr) points_ = wanted.ToVector();
  tiles_ = TilesWith(step_ == nullptr ? points_ : step_->inner());
  if (step_ != nullptr && tiles_.size() == tiles().tiles()) tiles_.clear();
}

std::size_t OutputReconstruction::scratch_floats() const {
  const std::size_t y = PaddedCount(kBlockFrames * subspace_->tile_inputs());
  return y +
         std::max(3 * padded_ + (step_ == nullptr ? 0 : step_->scratch_floats()), mends_.scratch_floats());
}

void OutputReconstruction::Run(std::span<const Frame> frames, float* scratch) const {
  const std::span<float> all(scratch, scratch_floats());
  const std::span<float> y = all.first(PaddedCount(kBlockFrames * subspace_->tile_inputs()));
  if (direct()) Reconstruct(frames, nullptr, y);
  for (const Frame& frame : frames) {
    if (!direct()) RunOne(frame, y, all.subspan(y.size()));
    mends_.Run(tiles(), frame.measured, frame.world_from_space, frame.out, all.subspan(y.size()));
  }
}

void OutputReconstruction::Reconstruct(std::span<const Frame> frames, const PointsView* mesh,
                                       std::span<float> y) const {
  KPSA_DCHECK(!frames.empty() && frames.size() <= kBlockFrames);
  PointsView outs[kBlockFrames];
  Matrix4 spaces[kBlockFrames];
  const float* inputs[kBlockFrames] = {};
  bool moved = false;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    outs[f] = mesh == nullptr ? frames[f].out : *mesh;
    inputs[f] = frames[f].inputs;
    // A step runs in the space: that grows and turns all of it at once
    if (step_ != nullptr || frames[f].world_from_space == nullptr) continue;
    spaces[f] = *frames[f].world_from_space;
    moved = true;
  }
  const std::size_t count = frames.size(), r = subspace_->tile_inputs();
  const std::span<const Matrix4> through(spaces, moved ? count : 0);
  if (inputs[0] != nullptr) return tiles().ReconstructFrom({inputs, count}, {outs, count}, tiles_, through);
  if (count == 1) return tiles().ReconstructBlock(frames[0].y, {outs, 1}, tiles_, through);
  for (std::size_t f = 0; f < count; ++f)
    std::memcpy(y.data() + f * r, frames[f].y.data(), r * sizeof(float));
  tiles().ReconstructBlock(y.first(count * r), {outs, count}, tiles_, through);
}

void OutputReconstruction::RunOne(const Frame& frame, std::span<float> y, std::span<float> scratch) const {
  const PointsView mesh{scratch.data(), scratch.data() + padded_, scratch.data() + 2 * padded_,
                        tiles().points()};
  Reconstruct({&frame, 1}, &mesh, y);
  if (step_ == nullptr) {
    for (std::size_t i = 0; i < points_.size(); ++i) CopyPoint(mesh, points_[i], frame.out, i);
    return;
  }
  step_->Run(mesh, frame.out, scratch.subspan(3 * padded_));
  if (frame.world_from_space != nullptr) TransformPoints(ToFloats(*frame.world_from_space), frame.out);
}

}  // namespace kpsa::engine
