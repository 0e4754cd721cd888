// How what is reconstructed stands where some points go through a last step (kpsa/stepped_points.h).
#include "kpsa/stepped_points.h"

#include <gtest/gtest.h>

#include "kpsa/partial_step.h"
#include "kpsa/subspace.h"
#include "kpsa/tiles.h"

namespace kpsa::engine {
namespace {

// out(p) = 2 inner(p) + inner(p + 1), in a row of points.
class RowStep final : public LastStep {
 public:
  explicit RowStep(Index points) : points_(points) {}
  std::size_t points() const override { return points_; }
  std::size_t inner_points() const override { return points_; }
  Index PointOf(Index inner) const override { return inner; }
  float cost_ns() const override { return static_cast<float>(points_); }
  void Inner(ConstPointsView in, PointsView inner) const override { CopyPoints(in, inner); }
  std::unique_ptr<const Bound> Bind(const PointSet& out) const override {
    return std::make_unique<RowBound>(out);
  }

 private:
  class RowBound final : public Bound {
   public:
    explicit RowBound(const PointSet& out) : out_(out.ToVector()), last_(out.total() - 1) {
      for (const Index p : out_) {
        for (const Index i : {p, std::min(p + 1, last_)}) {
          if (inner_.empty() || inner_.back() < i) inner_.push_back(i);
        }
      }
    }
    const std::vector<Index>& inner() const override { return inner_; }
    std::size_t scratch_floats() const override { return 0; }
    void Run(ConstPointsView inner, PointsView out, std::span<float>) const noexcept override {
      for (std::size_t k = 0; k < out_.size(); ++k) {
        const Index p = out_[k], q = std::min(p + 1, last_);
        out.x[k] = 2 * inner.x[p] + inner.x[q];
        out.y[k] = 2 * inner.y[p] + inner.y[q];
        out.z[k] = 2 * inner.z[p] + inner.z[q];
      }
    }

   private:
    std::vector<Index> out_, inner_;
    Index last_;
  };
  Index points_;
};

PointBuffer RowOfPoints(std::size_t count) {
  PointBuffer points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = static_cast<float>(i);
    points.view().x[i] = at, points.view().y[i] = at * at, points.view().z[i] = -at;
  }
  return points;
}

constexpr Index kRowPoints = 700;

TEST(SteppedPoints, LayTilesWithWhatStandsAboutThem) {
  const RowStep step(kRowPoints);
  // The second and the fourth hundred, every other one: each reads a point that does not go through the step
  std::vector<Index> points;
  for (Index p = 101; p < 400; p += p == 199 ? 102 : 2) points.push_back(p);
  const SteppedPoints stepped = LayOut(step, points);
  EXPECT_TRUE(stepped.Fit(kRowPoints));
  ASSERT_GT(stepped.starts.size(), kRowPoints / kTilePoints + 1);
  std::size_t full = 0;
  for (std::size_t t = 0; t < stepped.starts.size(); ++t) {
    const auto [begin, end] = stepped.PointsOf(t, kRowPoints);
    std::size_t about = 0;
    for (Index p = begin; p < end; ++p) {
      about += p > 0 && stepped.Has(p - 1);  // none of them is stepped
      EXPECT_EQ(stepped.TileOf(p), t);
    }
    EXPECT_LE(end - begin + about, kTilePoints);
    full += end - begin == kTilePoints;
    if (t + 1 < stepped.starts.size() && about > 0) {
      EXPECT_GT(end - begin + about + 2 * SteppedPoints::kStartsAt, kTilePoints) << "there is room for more";
    }
  }
  EXPECT_GT(full, 0u) << "where nothing goes through the step, tiles are whole";

  const auto partial = MakePartialStep(std::make_shared<RowStep>(step), stepped);
  ASSERT_NE(partial, nullptr);
  const PointBuffer in = RowOfPoints(kRowPoints);
  PointBuffer inner(partial->inner_points()), expected(kRowPoints);
  partial->Inner(in.view(), inner.view());
  step.Bind(PointSet::All(kRowPoints))->Run(in.view(), expected.view(), {});
  for (Index row = 0; row < partial->inner_points(); ++row) EXPECT_LT(partial->PointOf(row), kRowPoints);
  for (const std::vector<Index>& wanted : {std::vector<Index>{0, 1, 699},
                                           {101},
                                           {100, 101, 102, 103, 398, 399},
                                           PointSet::All(kRowPoints).ToVector()}) {
    const auto bound = partial->Bind(PointSet::Of(wanted, kRowPoints));
    PointBuffer read(partial->inner_points()), out(wanted.size());
    std::fill_n(read.view().x, read.count(), 1e9f);
    for (const Index i : bound->inner()) {  // and nothing else
      read.view().x[i] = inner.view().x[i], read.view().y[i] = inner.view().y[i];
      read.view().z[i] = inner.view().z[i];
    }
    AlignedFloats scratch(bound->scratch_floats());
    bound->Run(read.view(), out.view(), scratch.span());
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      EXPECT_EQ(out.view().x[k], expected.view().x[wanted[k]]) << wanted[k];
      EXPECT_EQ(out.view().y[k], expected.view().y[wanted[k]]) << wanted[k];
      EXPECT_EQ(out.view().z[k], expected.view().z[wanted[k]]) << wanted[k];
    }
  }
}

TEST(SteppedPoints, OfWholeTilesMayHaveTheOthersBehindAll) {
  const RowStep step(kRowPoints);
  const SteppedPoints tiles{PointsOfTiles(std::vector<Index>{1, 5}, kRowPoints), {}};
  EXPECT_TRUE(tiles.Fit(kRowPoints));
  EXPECT_EQ(tiles.points.size(), kTilePoints + kRowPoints - 5 * kTilePoints);
  EXPECT_EQ(WholeTiles(tiles.points, kRowPoints), (std::vector<Index>{1, 5}));
  const auto partial = MakePartialStep(std::make_shared<RowStep>(step), tiles);
  ASSERT_NE(partial, nullptr);
  EXPECT_EQ(partial->inner_points(), kRowPoints + 1) << "the point behind tile 1";
  EXPECT_EQ(partial->PointOf(kRowPoints), 2 * kTilePoints);
  SubspaceOutput output{"m@mush", kRowPoints, "mush", kRowPoints + 1, tiles};
  EXPECT_FALSE(output.HoldsInner(0));
  EXPECT_TRUE(output.HoldsInner(1));
  EXPECT_FALSE(output.HoldsInner(2));
  EXPECT_TRUE(output.HoldsInner(5)) << "the tile that ends with the mesh";
}

TEST(SteppedPoints, ThatDoNotFitAreToldApart) {
  EXPECT_TRUE(SteppedPoints().Fit(kRowPoints));
  EXPECT_TRUE((SteppedPoints{{3}, {0, 112, 240, 368, 496, 624}}).Fit(kRowPoints));
  EXPECT_FALSE((SteppedPoints{{3}, {}}).Fit(kRowPoints)) << "no whole tile";
  EXPECT_FALSE((SteppedPoints{{3, 3}, {0, 112, 240, 368, 496, 624}}).Fit(kRowPoints));
  EXPECT_FALSE((SteppedPoints{{kRowPoints}, {0, 112, 240, 368, 496, 624}}).Fit(kRowPoints));
  EXPECT_FALSE((SteppedPoints{{3}, {0, 144, 272, 400, 528, 656}}).Fit(kRowPoints)) << "more than a tile";
  EXPECT_FALSE((SteppedPoints{{3}, {0, 111, 239, 367, 495, 623}}).Fit(kRowPoints))
      << "not where a block begins";
  EXPECT_FALSE((SteppedPoints{{3}, {16, 112, 240, 368, 496, 624}}).Fit(kRowPoints));
  EXPECT_TRUE((SteppedPoints{{3}, {0, 128}}).Fit(129));
  EXPECT_FALSE((SteppedPoints{{3}, {0, 128}}).Fit(128)) << "a tile without points";
  EXPECT_FALSE((SteppedPoints{{}, {0, 112, 240, 368, 496, 624}}).Fit(kRowPoints));
  // What the step reads about them has to have room
  std::vector<Index> starts;
  for (Index p = 0; p < kRowPoints; p += kTilePoints) starts.push_back(p);
  EXPECT_TRUE((SteppedPoints{{3}, starts}).Fit(kRowPoints));
  EXPECT_EQ(MakePartialStep(std::make_shared<RowStep>(kRowPoints), {{3}, starts}), nullptr);
}

}  // namespace
}  // namespace kpsa::engine
