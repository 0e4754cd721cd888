// Small line plots as SVG: axes with round numbers, a legend, marks along the x axis. Text only, the same
// bytes for the same numbers.
#pragma once

#include <string>
#include <vector>

namespace kpsa::engine {

struct PlotLine {
  std::string name;       // in the legend
  std::string color;      // of SVG: "#2060c0"
  std::vector<double> y;  // at x = 0, 1, 2, ...; what is not finite interrupts the line
};

struct LinePlot {
  std::string title, x_label, y_label;
  std::vector<PlotLine> lines;
  std::string marks_name;          // "" where there are none
  std::vector<std::size_t> marks;  // x of small crosses on the axis
};

// Plots in rows from the left, `columns` in each; of the size of a page's width.
std::string PlotsAsSvg(const std::vector<LinePlot>& plots, std::size_t columns);

// A distance of ticks so that at most `most` fit into [0, top]: 1, 2 or 5 times a power of ten.
double RoundStep(double top, int most);

}  // namespace kpsa::engine
