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
  const SubspaceOutput& of = subspace_->outputs[output_];
  if (step != nullptr && of.inner > 0) {
    Divide(of, wanted, *step);
  } else {
    if (step != nullptr)
      mends_ = BoundMends(subspace_->mends, tiles(), static_cast<Index>(output_), wanted, *step);
    std::vector<Index> points = all_ ? std::vector<Index>() : wanted.ToVector();
    for (Index i = 0; i < points.size(); ++i) AddToRuns(points[i], i, &places_);
    direct_ = TilesWith(points);
  }
  if (!direct() || step_ != nullptr) padded_ = PaddedCount(of.reconstructed());
}

void OutputReconstruction::Divide(const SubspaceOutput& output, const PointSet& wanted,
                                  const LastStep& step) {
  if (output.stepped.empty()) {
    step_ = step.Bind(wanted);
  } else {
    std::vector<Index> of_step;
    for (Index i = 0; i < wanted.size(); ++i) {
      const auto tile = static_cast<Index>(output.stepped.TileOf(wanted[i]));
      if (output.HoldsInner(tile)) {
        AddToRuns(static_cast<Index>(of_step.size()), i, &step_places_);
        of_step.push_back(wanted[i]);
        continue;
      }
      const Index start = output.stepped.PointsOf(tile, output.points).begin;
      AddToRuns(static_cast<Index>(tile * kTilePoints) + wanted[i] - start, i, &places_);
      if (!direct_.empty() && direct_.back() == tile) continue;
      direct_.push_back(tile);
      starts_.push_back(start);
    }
    if (of_step.empty()) return;
    if (!direct_.empty()) apart_ = of_step.size();
    step_ = step.Bind(PointSet::Of(std::move(of_step), wanted.total()));
  }
  tiles_ = TilesWith(step_->inner());
  if (tiles_.size() == tiles().tiles()) tiles_.clear();
}

std::size_t OutputReconstruction::scratch_floats() const {
  const std::size_t y = PaddedCount(kBlockFrames * subspace_->tile_inputs());
  const std::size_t step = step_ == nullptr ? 0 : FloatsOf(apart_) + step_->scratch_floats();
  return y + std::max(3 * padded_ + step, mends_.scratch_floats());
}

void OutputReconstruction::Run(std::span<const Frame> frames, float* scratch) const {
  const std::span<float> all(scratch, scratch_floats());
  const std::span<float> y = all.first(PaddedCount(kBlockFrames * subspace_->tile_inputs()));
  const PointsView mesh{all.data() + y.size(), all.data() + y.size() + padded_,
                        all.data() + y.size() + 2 * padded_, tiles().points()};
  if (direct()) Reconstruct(frames, direct_, false, nullptr, y);
  for (const Frame& frame : frames) {
    if (!direct() && (step_ == nullptr || !direct_.empty())) CopyPoints(frame, y, mesh);
    if (step_ != nullptr) RunStep(frame, y, mesh, all.subspan(y.size() + 3 * padded_));
    mends_.Run(tiles(), frame.measured, frame.world_from_space, frame.out, all.subspan(y.size()));
  }
}

void OutputReconstruction::Reconstruct(std::span<const Frame> frames, std::span<const Index> some,
                                       bool in_space, const PointsView* mesh, std::span<float> y) const {
  KPSA_DCHECK(!frames.empty() && frames.size() <= kBlockFrames);
  PointsView outs[kBlockFrames];
  Matrix4 spaces[kBlockFrames];
  const float* inputs[kBlockFrames] = {};
  bool moved = false;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    outs[f] = mesh == nullptr ? frames[f].out : *mesh;
    inputs[f] = frames[f].inputs;
    // A step runs in the space: that grows and turns all of it at once
    if (in_space || frames[f].world_from_space == nullptr) continue;
    spaces[f] = *frames[f].world_from_space;
    moved = true;
  }
  const std::size_t count = frames.size(), r = subspace_->tile_inputs();
  const std::span<const Matrix4> through(spaces, moved ? count : 0);
  const std::span<const Index> places = mesh == nullptr ? std::span(starts_) : std::span<const Index>();
  if (inputs[0] != nullptr)
    return tiles().ReconstructFrom({inputs, count}, {outs, count}, some, through, places);
  if (count == 1) return tiles().ReconstructBlock(frames[0].y, {outs, 1}, some, through, places);
  for (std::size_t f = 0; f < count; ++f)
    std::memcpy(y.data() + f * r, frames[f].y.data(), r * sizeof(float));
  tiles().ReconstructBlock(y.first(count * r), {outs, count}, some, through, places);
}

void OutputReconstruction::CopyPoints(const Frame& frame, std::span<float> y, PointsView mesh) const {
  Reconstruct({&frame, 1}, direct_, false, &mesh, y);
  CopyRuns(mesh, places_, frame.out);
}

void OutputReconstruction::RunStep(const Frame& frame, std::span<float> y, PointsView mesh,
                                   std::span<float> scratch) const {
  Reconstruct({&frame, 1}, tiles_, true, &mesh, y);
  const PointsView made = apart_ == 0 ? frame.out : ViewOf(scratch, apart_);
  step_->Run(mesh, made, scratch.subspan(FloatsOf(apart_)));
  if (frame.world_from_space != nullptr) TransformPoints(ToFloats(*frame.world_from_space), made);
  if (apart_ > 0) CopyRuns(made, step_places_, frame.out);
}

}  // namespace kpsa::engine
