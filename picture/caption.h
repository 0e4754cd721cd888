// What is written on pictures and beside them, readable on light and dark ones.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "picture/image.h"

namespace kpsa::engine {

// A title at the top of the picture, in letters that fit.
void DrawTitle(Image& image, std::string_view title);
// A line at its lower left: the first of the texts that fits, from the longest to the shortest; in smaller letters
// rather than a shorter one.
void DrawCaption(Image& image, std::span<const std::string> texts);

// The scale of a heat map, to stand beside it.
struct Legend {
  double max = 1e-3;   // at the top of the colours
  double mark = 0;     // the tolerance, pointed at; 0: none
  bool metres = true;  // shown as mm; else plain numbers
};
// A panel of its own, as high as the picture beside it.
Image LegendPanel(int height, const Legend& legend);

// "0.213 mm": three significant digits.
std::string Millimetres(double metres);

}  // namespace kpsa::engine
