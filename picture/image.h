// Small pictures: pixels, text, colour scale, montage. Plain data; no file format (files/png.h writes them).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kpsa::engine {

using Rgb = std::array<std::uint8_t, 3>;  // sRGB

// Rows from the top, 3 bytes a pixel.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;

  Image() = default;
  Image(int width, int height, Rgb fill);
  Rgb At(int x, int y) const;                        // within the picture
  void Set(int x, int y, Rgb color);                 // outside: ignored
  void Fill(int x, int y, int w, int h, Rgb color);  // clipped
};

// Text of printable ASCII in a small bitmap font; a letter of scale 1 is about 6 wide and 8 high.
// x, y: the upper left corner. Clipped to the picture.
void DrawText(Image& image, int x, int y, int scale, Rgb color, std::string_view text);
int TextWidth(std::string_view text, int scale);  // pixels

// A rainbow of rising brightness order (polynomial fit of Google's Turbo, Apache 2.0, A. Mikhailov 2019),
// from dark blue at 0 over green to dark red at 1; t is clamped, a NaN is grey. Linear-light output is up to
// the caller.
Rgb TurboColor(double t);

// The pictures in one row on a common ground, `gap` pixels apart, tops aligned.
Image SideBySide(std::span<const Image> images, int gap = 4);

// The picture `times` smaller: each pixel is the mean of times x times; what is left over at the right and
// the bottom is cut off.
Image Shrunk(const Image& image, int times);

// Pictures below each other, and the same in rows of six.
Image StackRows(const std::vector<Image>& rows);
std::vector<Image> InRows(const std::vector<Image>& images);

}  // namespace kpsa::engine
