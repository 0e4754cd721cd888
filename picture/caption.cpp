#include "picture/caption.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace kpsa::engine {
namespace {

constexpr Rgb kDark = {32, 34, 40}, kLight = {246, 247, 249}, kPanel = {236, 237, 240};
constexpr int kLetterHeight = 8;

// Letters that stand out from what is under them, with a rim of the other colour.
void DrawReadable(Image& image, int x, int y, int scale, std::string_view text) {
  const int width = TextWidth(text, scale), height = kLetterHeight * scale;
  int sum = 0, count = 0;
  for (int row = std::max(y, 0); row < std::min(y + height, image.height); ++row) {
    for (int column = std::max(x, 0); column < std::min(x + width, image.width); ++column) {
      const Rgb c = image.At(column, row);
      sum += (2 * c[0] + 5 * c[1] + c[2]) / 8, ++count;
    }
  }
  const bool on_light = count == 0 || sum / count > 118;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx != 0 || dy != 0) DrawText(image, x + dx, y + dy, scale, on_light ? kLight : kDark, text);
    }
  }
  DrawText(image, x, y, scale, on_light ? kDark : kLight, text);
}

// Of letters that are read where pictures in a row are shrunk to a page.
int LetterScale(const Image& image) { return std::max(1, image.height / 200); }

std::string NumberOf(double value, bool metres) {
  if (!metres) return fmt::format("{:.3g}", value);
  std::string number = Millimetres(value);
  number.resize(number.size() - 3);  // the unit stands above
  return number;
}

}  // namespace

std::string Millimetres(double metres) {
  const double mm = metres * 1e3;
  const int digits = mm >= 100 ? 0 : mm >= 10 ? 1 : mm >= 1 ? 2 : mm >= 1e-3 || mm == 0 ? 3 : 6;
  return fmt::format("{:.{}f} mm", mm, digits);
}

void DrawTitle(Image& image, std::string_view title) {
  int scale = LetterScale(image);
  while (scale > 1 && TextWidth(title, scale) + 8 * scale > image.width) --scale;
  DrawReadable(image, (image.width - TextWidth(title, scale)) / 2, 6 * scale, scale, title);
}

void DrawCaption(Image& image, std::span<const std::string> texts) {
  for (const std::string& text : texts) {
    for (int scale = LetterScale(image); scale > 0; --scale) {
      if (TextWidth(text, scale) + 8 * scale > image.width) continue;
      DrawReadable(image, 4 * scale, image.height - (kLetterHeight + 5) * scale, scale, text);
      return;
    }
  }
}

Image LegendPanel(int height, const Legend& legend) {
  const int scale = std::max(1, height / 300);
  const std::string unit = legend.metres ? "error, mm" : "error";
  const std::array<std::string, 2> foot = {
      "> tolerance", "  " + (legend.metres ? Millimetres(legend.mark) : NumberOf(legend.mark, false))};
  int width = TextWidth(unit, scale);
  for (int tick = 0; tick <= 4; ++tick) {
    const std::string number = NumberOf(legend.max * tick / 4, legend.metres);
    width = std::max(width, 26 * scale + TextWidth(number, scale));
  }
  for (const std::string& line : foot) width = std::max(width, TextWidth(line, scale));
  Image panel(width + 8 * scale, height, kPanel);
  const int bar_height = height * 6 / 10, top = (height - bar_height) / 2, left = 12 * scale,
            right = left + 10 * scale;
  for (int y = 0; y < bar_height; ++y)
    panel.Fill(left, top + y, right - left, 1, TurboColor(1.0 - (y + 0.5) / bar_height));
  for (int tick = 0; tick <= 4; ++tick) {
    const int y = top + bar_height - tick * bar_height / 4;
    panel.Fill(right, y, 3 * scale, scale, kDark);
    DrawText(panel, right + 6 * scale, y - 4 * scale, scale, kDark,
             NumberOf(legend.max * tick / 4, legend.metres));
  }
  DrawText(panel, 4 * scale, top - 18 * scale, scale, kDark, unit);
  if (legend.mark > 0) {
    const double share = std::min(legend.mark / legend.max, 1.0);
    const int y = top + bar_height - static_cast<int>(share * bar_height);
    for (int i = 0; i < 6 * scale; ++i)  // an arrow to the bar, and a line over it
      panel.Fill(left - 2 - i, y - i / 2, 1, i / 2 * 2 + 1, kDark);
    if (legend.mark <= legend.max) panel.Fill(left, y, right - left, scale, kLight);
    for (int line = 0; line < 2; ++line)
      DrawText(panel, 4 * scale, top + bar_height + (14 + 12 * line) * scale, scale, kDark,
               foot[static_cast<std::size_t>(line)]);
  }
  return panel;
}

}  // namespace kpsa::engine
