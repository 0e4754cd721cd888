#include "kpsa/partial_step.h"

#include <algorithm>
#include <iterator>
#include <mutex>
#include <utility>

#include "base/check.h"
#include "kpsa/scratch_points.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

// Of the points of a set, those of some points go through the step.
class PartialBound final : public LastStep::Bound {
 public:
  // stepped: ascending; others: the step's inner points behind the N points, ascending.
  PartialBound(const LastStep& step, const std::vector<Index>& stepped, const std::vector<Index>& others,
               const PointSet& out)
      : inner_points_(step.inner_points()), out_(out) {
    std::vector<Index> wanted;
    for (Index i = 0; i < out.size(); ++i) {
      if (std::ranges::binary_search(stepped, out[i])) {
        wanted.push_back(out[i]);
        places_.push_back(i);
      } else {
        inner_.push_back(out[i]);
      }
    }
    if (wanted.empty()) return;
    step_ = step.Bind(PointSet::Of(wanted, out.total()));
    for (const Index i : step_->inner()) {
      Index from = i;  // among the inner points of this step
      if (!std::ranges::binary_search(stepped, i)) {
        const auto found = std::ranges::lower_bound(others, i);
        KPSA_CHECK(found != others.end() && *found == i);
        from = out.total() + static_cast<Index>(found - others.begin());
      }
      moves_.emplace_back(from, i);
      inner_.push_back(from);
    }
    std::ranges::sort(inner_);
  }
  const std::vector<Index>& inner() const override { return inner_; }
  std::size_t scratch_floats() const override {
    return step_ == nullptr ? 0
                            : FloatsOf(inner_points_) + FloatsOf(places_.size()) + step_->scratch_floats();
  }
  void Run(ConstPointsView inner, PointsView out, std::span<float> scratch) const noexcept override {
    for (Index i = 0; i < out_.size(); ++i) CopyPoint(inner, out_[i], out, i);
    if (step_ == nullptr) return;
    const PointsView own = ViewOf(scratch, inner_points_);
    scratch = scratch.subspan(FloatsOf(inner_points_));
    const PointsView made = ViewOf(scratch, places_.size());
    for (const auto& [from, to] : moves_) CopyPoint(inner, from, own, to);
    step_->Run(own, made, scratch.subspan(FloatsOf(places_.size())));
    for (std::size_t k = 0; k < places_.size(); ++k) CopyPoint(made, k, out, places_[k]);
  }

 private:
  std::size_t inner_points_;  // of the step
  PointSet out_;
  std::unique_ptr<const LastStep::Bound> step_;  // for the points that need it; null: there are none
  std::vector<Index> places_;                    // of these in the set
  std::vector<std::pair<Index, Index>> moves_;   // from what is reconstructed to what the step reads
  std::vector<Index> inner_;
};

class PartialStep final : public LastStep {
 public:
  PartialStep(std::shared_ptr<const LastStep> step, std::span<const Index> tiles)
      : step_(std::move(step)), stepped_(PointsOfTiles(tiles, step_->points())) {
    KPSA_CHECK(!stepped_.empty());
    const auto total = static_cast<Index>(step_->points());
    const std::vector<Index> inner = step_->InnerOf(PointSet::Of(stepped_, total));
    std::ranges::set_difference(inner, stepped_, std::back_inserter(others_));
  }
  std::size_t points() const override { return step_->points(); }
  std::size_t inner_points() const override { return step_->points() + others_.size(); }
  Index PointOf(Index inner) const override {
    const auto total = static_cast<Index>(step_->points());
    return inner < total ? inner : step_->PointOf(others_[inner - total]);
  }
  float cost_ns() const override {
    return step_->cost_ns() * static_cast<float>(stepped_.size()) / static_cast<float>(step_->points()) +
           kCopyCost * static_cast<float>(step_->points());
  }
  void Inner(ConstPointsView in, PointsView inner) const override {
    PointBuffer own(step_->inner_points()), out(step_->points());
    step_->Inner(in, own.view());
    const ConstPointsView of_step = std::as_const(own).view();
    std::call_once(bound_, [&] { all_ = step_->Bind(PointSet::All(static_cast<Index>(step_->points()))); });
    AlignedFloats scratch(all_->scratch_floats());
    all_->Run(of_step, out.view(), scratch.span());
    for (std::size_t i = 0; i < out.count(); ++i) CopyPoint(std::as_const(out).view(), i, inner, i);
    for (const Index i : stepped_) CopyPoint(of_step, i, inner, i);
    for (std::size_t k = 0; k < others_.size(); ++k) CopyPoint(of_step, others_[k], inner, out.count() + k);
  }
  std::unique_ptr<const Bound> Bind(const PointSet& out) const override {
    return std::make_unique<PartialBound>(*step_, stepped_, others_, out);
  }

 private:
  static constexpr float kCopyCost = 0.5f;  // ns a point
  std::shared_ptr<const LastStep> step_;
  std::vector<Index> stepped_, others_;  // points, and inner points of the step
  // For all points, where Inner is asked for
  mutable std::once_flag bound_;
  mutable std::unique_ptr<const Bound> all_;
};

}  // namespace

std::vector<Index> PointsOfTiles(std::span<const Index> tiles, std::size_t points) {
  std::vector<Index> found;
  for (const Index tile : tiles) {
    const std::size_t first = std::size_t{tile} * kTilePoints, end = std::min(points, first + kTilePoints);
    for (std::size_t i = first; i < end; ++i) found.push_back(static_cast<Index>(i));
  }
  return found;
}

std::shared_ptr<const LastStep> MakePartialStep(std::shared_ptr<const LastStep> step,
                                                std::span<const Index> tiles) {
  return std::make_shared<PartialStep>(std::move(step), tiles);
}

}  // namespace kpsa::engine
