#include "report/line_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace kpsa::engine {
namespace {

constexpr int kWidth = 460, kHeight = 250;                       // of a plot with its margins
constexpr int kLeft = 58, kRight = 14, kTop = 46, kBottom = 38;  // of the margins
constexpr int kMostTicks = 6;
constexpr char kMarkColor[] = "#d03030";

std::string Escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    out += c == '<'   ? "&lt;"
           : c == '>' ? "&gt;"
           : c == '&' ? "&amp;"
           : c == '"' ? "&quot;"
                      : std::string(1, c);
  }
  return out;
}

std::string TextAt(double x, double y, const char* anchor, const std::string& text, const char* more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     Escaped(text));
}

// A line per stretch of finite values.
std::string Polylines(const PlotLine& line, double x_step, double y_scale) {
  std::string text, points;
  const auto close = [&] {
    if (!points.empty())
      text += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\" points=\"{}\"/>\n",
                          line.color, points);
    points.clear();
  };
  for (std::size_t i = 0; i < line.y.size(); ++i) {
    if (!std::isfinite(line.y[i])) {
      close();
      continue;
    }
    points += fmt::format("{}{:.1f},{:.1f}", points.empty() ? "" : " ",
                          kLeft + x_step * static_cast<double>(i), kHeight - kBottom - y_scale * line.y[i]);
  }
  close();
  return text;
}

std::string OnePlot(const LinePlot& plot) {
  double top = 0;
  std::size_t count = 2;
  for (const PlotLine& line : plot.lines) {
    count = std::max(count, line.y.size());
    for (double y : line.y) {
      if (std::isfinite(y)) top = std::max(top, y);
    }
  }
  if (!(top > 0)) top = 1;
  const double step = RoundStep(top, kMostTicks), last = static_cast<double>(count - 1);
  top = std::ceil(top / step - 1e-9) * step;
  const double x_step = (kWidth - kLeft - kRight) / last, y_scale = (kHeight - kTop - kBottom) / top;
  const int bottom = kHeight - kBottom, right = kWidth - kRight;

  std::string text = TextAt(kLeft, 16, "start", plot.title, " font-weight=\"bold\"");
  double legend = kLeft;
  const auto entry = [&](const std::string& name, const std::string& color, const std::string& sign) {
    text += fmt::format("<g stroke=\"{}\" stroke-width=\"2\" transform=\"translate({:.0f},32)\">{}</g>\n",
                        color, legend, sign);
    text += TextAt(legend + 20, 36, "start", name);
    legend += 32 + 6.2 * static_cast<double>(name.size());
  };
  for (const PlotLine& line : plot.lines) entry(line.name, line.color, "<path d=\"M0 0h15\"/>");
  if (!plot.marks_name.empty()) entry(plot.marks_name, kMarkColor, "<path d=\"M4 -3l6 6m0 -6l-6 6\"/>");

  for (int i = 0; i * step <= top * (1 + 1e-9); ++i) {
    const double y = bottom - y_scale * i * step;
    text += fmt::format("<path stroke=\"#dddddd\" d=\"M{} {:.1f}H{}\"/>\n", kLeft, y, right);
    text += TextAt(kLeft - 5, y + 4, "end", fmt::format("{:.6g}", i * step));
  }
  const double x_tick = std::max(1.0, RoundStep(last, kMostTicks));
  for (int i = 0; i * x_tick <= last; ++i) {
    const double x = kLeft + x_step * i * x_tick;
    text += fmt::format("<path stroke=\"#888888\" d=\"M{:.1f} {}v4\"/>\n", x, bottom);
    text += TextAt(x, bottom + 16, "middle", fmt::format("{:.6g}", i * x_tick));
  }
  text += fmt::format("<path stroke=\"#888888\" fill=\"none\" d=\"M{} {}V{}H{}\"/>\n", kLeft, kTop, bottom,
                      right);
  for (const PlotLine& line : plot.lines) text += Polylines(line, x_step, y_scale);
  std::string crosses;
  for (std::size_t mark : plot.marks)
    crosses +=
        fmt::format("M{:.1f} {}l4 4m0 -4l-4 4", kLeft + x_step * static_cast<double>(mark) - 2, bottom - 2);
  if (!crosses.empty())
    text += fmt::format("<path stroke=\"{}\" fill=\"none\" d=\"{}\"/>\n", kMarkColor, crosses);
  text += TextAt((kLeft + right) / 2.0, kHeight - 6, "middle", plot.x_label);
  text += TextAt(0, 0, "middle", plot.y_label,
                 fmt::format(" transform=\"translate(13,{}) rotate(-90)\"", (kTop + bottom) / 2).c_str());
  return text;
}

}  // namespace

double RoundStep(double top, int most) {
  const double power = std::pow(10.0, std::floor(std::log10(top / most)));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (top <= factor * power * most * (1 + 1e-9)) return factor * power;
  }
  return 10 * power;
}

std::string PlotsAsSvg(const std::vector<LinePlot>& plots, std::size_t columns) {
  const std::size_t rows = (plots.size() + columns - 1) / columns;
  const std::size_t width = std::min(columns, plots.size()) * kWidth, height = rows * kHeight;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"11\" fill=\"#222222\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      width, height);
  for (std::size_t i = 0; i < plots.size(); ++i) {
    svg += fmt::format("<g transform=\"translate({},{})\">\n{}</g>\n", i % columns * kWidth,
                       i / columns * kHeight, OnePlot(plots[i]));
  }
  return svg + "</svg>\n";
}

}  // namespace kpsa::engine
