#include "report/line_plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace kpsa::engine {
namespace {

std::size_t Count(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(LinePlot, StepsAreRoundAndFew) {
  EXPECT_DOUBLE_EQ(RoundStep(1, 5), 0.2);
  EXPECT_DOUBLE_EQ(RoundStep(0.0301, 6), 0.01);
  EXPECT_DOUBLE_EQ(RoundStep(240, 6), 50);
  for (double top = 1e-4; top < 1e4; top *= 1.37) {
    const double step = RoundStep(top, 6);
    EXPECT_LE(top / step, 6 * (1 + 1e-9)) << top;
    EXPECT_GT(top / step, 6 / 2.6) << top;
  }
}

TEST(LinePlot, LinesBreakWhereThereIsNoNumber) {
  LinePlot plot{"a < b", "frame", "error", {{"one", "#112233", {0, 1, NAN, 2, 4}}}, "misses", {2}};
  const std::string svg = PlotsAsSvg({plot}, 2);
  EXPECT_EQ(Count(svg, "<polyline"), 2u);
  EXPECT_EQ(Count(svg, "a &lt; b"), 1u);
  EXPECT_EQ(Count(svg, ">misses<"), 1u);
  EXPECT_EQ(Count(svg, ">4<"), 2u);  // the last frame and the top of the error
  EXPECT_EQ(svg, PlotsAsSvg({plot}, 2));
  EXPECT_NE(PlotsAsSvg({plot, plot, plot}, 2).find("height=\"500\""), std::string::npos);
  plot.lines[0].y = {std::numeric_limits<double>::infinity(), 0};  // nothing to scale by
  EXPECT_EQ(Count(PlotsAsSvg({plot}, 1), "nan") + Count(PlotsAsSvg({plot}, 1), "inf"), 0u);
}

}  // namespace
}  // namespace kpsa::engine
