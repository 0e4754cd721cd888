#include "nodes/kernels/delta_mush_step.h"

#include <algorithm>
#include <utility>

#include "base/check.h"
#include "nodes/kernels/delta_mush_run.h"
#include "nodes/kernels/weights.h"

namespace kpsa::engine {
namespace {

constexpr float kNoPivot[3] = {};
constexpr std::size_t kFew = 16;  // of so many points, one: these are smoothed by themselves

bool CountsUp(std::span<const Index> numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] != i) return false;
  }
  return true;
}

void CopyPoint(ConstPointsView from, std::size_t i, PointsView to, std::size_t j) {
  to.x[j] = from.x[i], to.y[j] = from.y[i], to.z[j] = from.z[i];
}

}  // namespace

DeltaMushStep::DeltaMushStep(const Topology& topology, ConstPointsView rest,
                             const DeltaMushSettings& settings, Constants constants)
    : topology_(&topology),
      settings_(settings),
      whole_(std::make_unique<Whole>()),
      envelope_(static_cast<float>(constants.envelope)),
      displacement_(static_cast<float>(constants.displacement)),
      masks_(std::move(constants.weights)),
      in_rows_(AllPoints(rest.count)),
      smoothed_(rest.count, false) {
  if (masks_.empty()) masks_.assign(rest.count, 1.0f);
  KPSA_CHECK_EQ(masks_.size(), rest.count);
  std::vector<std::uint8_t> smooths(points());  // quicker than bits
  for (Index p = 0; p < points(); ++p) smooths[p] = settings.iterations > 0 && Smooths(topology, settings, p);
  for (Index p = 0; p < points(); ++p) {
    if (envelope_ * masks_[p] == 0 || !smooths[p]) masks_[p] = 0;
    if (!Changes(p)) continue;
    changes_ = true;
    smoothed_[p] = true;
    for (Index q : topology.neighbors().row(p)) smoothed_[q] = smooths[q];
  }
  for (Index p = 0; p < points(); ++p) {
    if (smoothed_[p] == 0 || envelope_ * masks_[p] == 1) continue;
    in_rows_[p] = static_cast<Index>(inner_points());
    extra_.push_back(p);
  }
  rest_ = PointBuffer(inner_points());
  const PointsView own = rest_.view();
  CopyPoints(rest, {own.x, own.y, own.z, points()});
  for (std::size_t k = 0; k < extra_.size(); ++k) CopyPoint(rest, extra_[k], own, points() + k);
}

const DeltaMushStep::Whole& DeltaMushStep::whole() const {
  std::call_once(whole_->made, [&] {
    const std::vector<Index> all = AllPoints(points());
    whole_->smoothing.emplace(*topology_, rest(), settings_, all, all, std::span<const float>(),
                              MiddleOf(rest()));
    whole_->rest = PointBuffer(inner_points());
    Inner(*whole_->smoothing, rest(), whole_->rest.view());
  });
  return *whole_;
}

void DeltaMushStep::Inner(ConstPointsView in, PointsView inner) const {
  KPSA_CHECK_EQ(in.count, points());
  KPSA_CHECK_EQ(inner.count, inner_points());
  Inner(*whole().smoothing, in, inner);
}

void DeltaMushStep::Inner(const DeltaMushKernel& smoothing, ConstPointsView in, PointsView inner) const {
  AlignedFloats scratch(smoothing.ScratchFloats());
  smoothing.Run({.envelope = 1, .displacement = 0, .pivot = MiddleOf(in)}, in,
                {inner.x, inner.y, inner.z, points()}, scratch.span());
  for (std::size_t i = 0; i < points(); ++i) {
    if (smoothed_[i] == 0) CopyPoint(in, i, inner, i);
  }
  for (std::size_t k = 0; k < extra_.size(); ++k) CopyPoint(in, extra_[k], inner, points() + k);
}

PointBuffer DeltaMushStep::InnerRest(std::span<const Index> of) const {
  if (of.size() > points() / kFew) return whole().rest;
  std::vector<Index> smoothed;
  std::ranges::copy_if(of, std::back_inserter(smoothed), [&](Index p) { return smoothed_[p] != 0; });
  const std::vector<Index> needed = DeltaMushDemand(*topology_, settings_, smoothed);
  const DeltaMushKernel smoothing(*topology_, rest(), settings_, smoothed, needed, {}, MiddleOf(rest()));
  PointBuffer in(needed.size()), out(smoothed.size());
  for (std::size_t i = 0; i < needed.size(); ++i) CopyPoint(rest(), needed[i], in.view(), i);
  AlignedFloats scratch(smoothing.ScratchFloats());
  smoothing.Run({.envelope = 1, .displacement = 0, .pivot = MiddleOf(rest())}, in.view(), out.view(),
                scratch.span());
  PointBuffer inner = rest_;
  for (std::size_t i = 0; i < smoothed.size(); ++i) CopyPoint(out.view(), i, inner.view(), smoothed[i]);
  return inner;
}

std::vector<bool> DeltaMushStep::ReadByFrames(std::span<const Index> out_points) const {
  std::vector<bool> read(inner_points(), false);
  for (Index p : out_points) {
    if (!Changes(p)) continue;
    read[p] = true;
    for (Index q : topology_->neighbors().row(p)) read[q] = true;
  }
  return read;
}

std::vector<Index> DeltaMushStep::InnerOf(std::span<const Index> out_points) const {
  KPSA_CHECK(IsSortedSet(out_points, points()));
  std::vector<bool> read = ReadByFrames(out_points);
  for (Index p : out_points) read[in_rows_[p]] = true;
  std::vector<Index> inner;
  for (Index i = 0; i < inner_points(); ++i) {
    if (read[i]) inner.push_back(i);
  }
  return inner;
}

DeltaMushStep::Part DeltaMushStep::Bind(std::span<const Index> out_points) const {
  KPSA_CHECK(IsSortedSet(out_points, points()));
  Part part;
  part.inputs_ = {envelope_, displacement_, {}};
  MushFrames::Outputs outputs{out_points, {}, {}};
  for (Index p : out_points) {
    outputs.in.push_back(in_rows_[p]);
    outputs.masks.push_back(masks_[p]);
  }
  if (CountsUp(outputs.in)) outputs.in.clear();
  if (std::ranges::all_of(outputs.masks, [](float w) { return w == 1; })) outputs.masks.clear();
  const std::vector<bool> read = ReadByFrames(out_points);
  std::vector<Index> local_of(points(), kNoIndex);
  for (Index p = 0; p < points(); ++p) {
    if (!read[p]) continue;
    local_of[p] = static_cast<Index>(part.source_.size());
    part.source_.push_back(p);
  }
  part.inner_ = InnerOf(out_points);
  part.local_count_ = part.source_.size();
  const PointBuffer inner_rest = InnerRest(part.source_);
  if (CountsUp(part.source_)) part.source_.clear();

  AlignedFloats smoothed(part.ScratchFloats());
  PackMush(std::as_const(inner_rest).view(), part.source_.empty() ? nullptr : part.source_.data(), kNoPivot,
           0, part.local_count_, smoothed.data());
  part.frames_ =
      MushFrames(*topology_, std::move(outputs), local_of, rest_.view(), smoothed.data(), kNoPivot);
  return part;
}

void DeltaMushStep::Part::Run(ConstPointsView inner, PointsView out, std::span<float> scratch,
                              const Parallel* parallel) const noexcept {
  KPSA_CHECK_LE(ScratchFloats(), scratch.size());
  KPSA_CHECK(inner_.empty() || inner_.back() < inner.count);
  ForRanges(parallel, local_count_, 8192, [&](std::size_t begin, std::size_t end) {
    PackMush(inner, source_.empty() ? nullptr : source_.data(), kNoPivot, begin, end, scratch.data());
  });
  frames_.Run(inputs_, scratch.data(), inner, out, parallel);
}

}  // namespace kpsa::engine
