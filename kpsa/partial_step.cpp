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

// What the step reads, but inner points of points that go through it and stand in their place: by point, and inner point.
struct OtherInner {
  Index point, inner;
  friend auto operator<=>(const OtherInner&, const OtherInner&) = default;
};
std::vector<OtherInner> OthersOf(const LastStep& step, const std::vector<Index>& stepped) {
  std::vector<OtherInner> others;
  for (const Index i : step.InnerOf(PointSet::Of(stepped, static_cast<Index>(step.points())))) {
    if (!std::ranges::binary_search(stepped, i)) others.push_back({step.PointOf(i), i});
  }
  return others;
}

// What is reconstructed: of a point, as it comes out, or an inner point of the step.
struct Row {
  Index point, inner;  // kNoIndex: it comes out
};

// The rows of a mesh; none where there is no room.
std::vector<Row> RowsOf(const LastStep& step, const SteppedPoints& stepped) {
  std::vector<OtherInner> others = OthersOf(step, stepped.points);
  const bool behind = stepped.starts.empty();
  if (!behind) std::ranges::sort(others);
  std::vector<Row> rows;
  const auto add = [&](SteppedPoints::Range of) {
    for (Index p = of.begin; p < of.end; ++p) rows.push_back({p, stepped.Has(p) ? p : kNoIndex});
  };
  if (behind) add({0, static_cast<Index>(step.points())});
  auto next = others.begin();
  for (std::size_t t = 0; t < stepped.starts.size(); ++t) {
    const SteppedPoints::Range of = stepped.PointsOf(t, step.points());
    const std::size_t end = (t + 1) * kTilePoints;
    add(of);
    for (; next != others.end() && next->point < of.end; ++next) rows.push_back({next->point, next->inner});
    if (rows.size() > end) return {};
    if (t + 1 < stepped.starts.size()) rows.resize(end, rows[t * kTilePoints]);
  }
  for (; next != others.end(); ++next) rows.push_back({next->point, next->inner});
  return rows;
}

// Of the points of a set, those of some points go through the step.
class PartialBound final : public LastStep::Bound {
 public:
  PartialBound(const LastStep& step, const SteppedPoints& stepped, const std::vector<Index>& row_of_point,
               const std::vector<std::pair<Index, Index>>& row_of_inner, const PointSet& out)
      : inner_points_(step.inner_points()) {
    std::vector<Index> wanted;
    for (Index i = 0; i < out.size(); ++i) {
      const Index row = row_of_point[out[i]];
      AddToRuns(row, i, &passed_);
      inner_.push_back(row);
      if (!stepped.Has(out[i])) continue;
      wanted.push_back(out[i]);
      places_.push_back(i);
    }
    if (!wanted.empty()) step_ = step.Bind(PointSet::Of(wanted, out.total()));
    for (std::size_t k = 0; k < (wanted.empty() ? 0 : step_->inner().size()); ++k) {
      const Index i = step_->inner()[k];
      const auto found = std::ranges::lower_bound(row_of_inner, std::pair(i, Index{0}));
      KPSA_CHECK(found != row_of_inner.end() && found->first == i);
      moves_.emplace_back(found->second, i);
      inner_.push_back(found->second);
    }
    std::ranges::sort(inner_);
    inner_.erase(std::unique(inner_.begin(), inner_.end()), inner_.end());
  }
  const std::vector<Index>& inner() const override { return inner_; }
  std::size_t scratch_floats() const override {
    return step_ == nullptr ? 0
                            : FloatsOf(inner_points_) + FloatsOf(places_.size()) + step_->scratch_floats();
  }
  void Run(ConstPointsView inner, PointsView out, std::span<float> scratch) const noexcept override {
    CopyRuns(inner, passed_, out);
    if (step_ == nullptr) return;
    const PointsView own = ViewOf(scratch, inner_points_);
    scratch = scratch.subspan(FloatsOf(inner_points_));
    const PointsView made = ViewOf(scratch, places_.size());
    for (const auto& [from, to] : moves_) CopyPoint(inner, from, own, to);
    step_->Run(own, made, scratch.subspan(FloatsOf(places_.size())));
    for (std::size_t k = 0; k < places_.size(); ++k) CopyPoint(made, k, out, places_[k]);
  }

 private:
  std::size_t inner_points_;                     // of the step
  std::unique_ptr<const LastStep::Bound> step_;  // for the points that need it; null: there are none
  std::vector<Index> places_;                    // of these in the set
  std::vector<PointRun> passed_;                 // all, as if none needed it: longer runs
  std::vector<std::pair<Index, Index>> moves_;   // from what is reconstructed to what the step reads
  std::vector<Index> inner_;
};

class PartialStep final : public LastStep {
 public:
  PartialStep(std::shared_ptr<const LastStep> step, SteppedPoints stepped, std::vector<Row> rows)
      : step_(std::move(step)),
        stepped_(std::move(stepped)),
        rows_(std::move(rows)),
        row_of_point_(step_->points(), kNoIndex) {
    for (Index r = 0; r < rows_.size(); ++r) {
      const Row& row = rows_[r];
      const bool in_place = row.inner == kNoIndex || (row.inner == row.point && stepped_.Has(row.point));
      if (in_place && row_of_point_[row.point] != kNoIndex) continue;  // what is left of a tile
      if (in_place) row_of_point_[row.point] = r;
      if (row.inner != kNoIndex) row_of_inner_.emplace_back(row.inner, r);
    }
    std::ranges::sort(row_of_inner_);
  }
  std::size_t points() const override { return step_->points(); }
  std::size_t inner_points() const override { return rows_.size(); }
  Index PointOf(Index inner) const override { return rows_[inner].point; }
  float cost_ns() const override {
    const float all = step_->cost_ns() / static_cast<float>(step_->points());
    return all * static_cast<float>(stepped_.points.size()) + kCopyCost * static_cast<float>(step_->points());
  }
  void Inner(ConstPointsView in, PointsView inner) const override {
    PointBuffer own(step_->inner_points()), out(step_->points());
    step_->Inner(in, own.view());
    const ConstPointsView of_step = std::as_const(own).view();
    std::call_once(bound_, [&] { all_ = step_->Bind(PointSet::All(static_cast<Index>(step_->points()))); });
    AlignedFloats scratch(all_->scratch_floats());
    all_->Run(of_step, out.view(), scratch.span());
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (rows_[r].inner == kNoIndex) {
        CopyPoint(std::as_const(out).view(), rows_[r].point, inner, r);
      } else {
        CopyPoint(of_step, rows_[r].inner, inner, r);
      }
    }
  }
  std::unique_ptr<const Bound> Bind(const PointSet& out) const override {
    return std::make_unique<PartialBound>(*step_, stepped_, row_of_point_, row_of_inner_, out);
  }

 private:
  static constexpr float kCopyCost = 0.5f;  // ns a point
  std::shared_ptr<const LastStep> step_;
  SteppedPoints stepped_;
  std::vector<Row> rows_;
  std::vector<Index> row_of_point_;                    // where what comes out, or stands in its place, is
  std::vector<std::pair<Index, Index>> row_of_inner_;  // inner points of the step, ascending, and their rows
  // For all points, where Inner is asked for
  mutable std::once_flag bound_;
  mutable std::unique_ptr<const Bound> all_;
};

}  // namespace

SteppedPoints LayOut(const LastStep& step, std::vector<Index> points) {
  std::vector<Index> about(step.points() + 1, 0);  // others that belong to the points before each
  for (const OtherInner& other : OthersOf(step, points)) ++about[other.point + 1];
  for (std::size_t p = 1; p < about.size(); ++p) about[p] += about[p - 1];
  SteppedPoints stepped{std::move(points), {}};
  const std::size_t total = step.points();
  for (std::size_t begin = 0; begin < total;) {
    stepped.starts.push_back(static_cast<Index>(begin));
    const auto rows = [&](std::size_t end) { return end - begin + about[end] - about[begin]; };
    std::size_t end = std::min(total, begin + kTilePoints);
    while (rows(end) > kTilePoints)
      end = begin + (end - begin - 1) / SteppedPoints::kStartsAt * SteppedPoints::kStartsAt;
    KPSA_CHECK_LT(begin, end);  // a point has two inner ones at most
    begin = end;
  }
  return stepped;
}

std::shared_ptr<const LastStep> MakePartialStep(std::shared_ptr<const LastStep> step,
                                                const SteppedPoints& stepped) {
  KPSA_CHECK(!stepped.empty() && stepped.Fit(step->points()));
  std::vector<Row> rows = RowsOf(*step, stepped);
  if (rows.empty()) return nullptr;
  return std::make_shared<PartialStep>(std::move(step), stepped, std::move(rows));
}

}  // namespace kpsa::engine
