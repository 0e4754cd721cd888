#include "picture/image.h"

#include <stb/stb_easy_font.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace kpsa::engine {
namespace {

constexpr Rgb kGround = {236, 237, 240};
constexpr int kLongestText = 200;

// Printable ASCII only: the font has nothing else, and names from files may hold anything.
std::string Printable(std::string_view text) {
  std::string out(text.substr(0, kLongestText));
  for (char& c : out) {
    if (c < 32 || c > 126) c = '?';
  }
  return out;
}

}  // namespace

Image::Image(int w, int h, Rgb fill) : width(w), height(h) {
  rgb.resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3);
  Fill(0, 0, w, h, fill);
}

Rgb Image::At(int x, int y) const {
  const std::size_t i =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  return {rgb[i], rgb[i + 1], rgb[i + 2]};
}

void Image::Set(int x, int y, Rgb color) {
  if (x < 0 || y < 0 || x >= width || y >= height) return;
  const std::size_t i =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  std::copy(color.begin(), color.end(), rgb.begin() + static_cast<std::ptrdiff_t>(i));
}

void Image::Fill(int x, int y, int w, int h, Rgb color) {
  for (int row = std::max(y, 0); row < std::min(y + h, height); ++row) {
    for (int column = std::max(x, 0); column < std::min(x + w, width); ++column) Set(column, row, color);
  }
}

void DrawText(Image& image, int x, int y, int scale, Rgb color, std::string_view text) {
  std::string line = Printable(text);
  // The font comes as axis-aligned rectangles: four corners of 16 bytes (x, y, z floats, colour) each
  std::vector<char> quads(line.size() * 400 + 400);
  const int count =
      stb_easy_font_print(0, 0, line.data(), nullptr, quads.data(), static_cast<int>(quads.size()));
  for (int q = 0; q < count; ++q) {
    float low[2], high[2];
    std::memcpy(low, quads.data() + q * 64, sizeof(low));
    std::memcpy(high, quads.data() + q * 64 + 32, sizeof(high));
    const int left = static_cast<int>(low[0]), top = static_cast<int>(low[1]);
    const int right = static_cast<int>(high[0]), bottom = static_cast<int>(high[1]);
    image.Fill(x + left * scale, y + top * scale, (right - left) * scale, (bottom - top) * scale, color);
  }
}

int TextWidth(std::string_view text, int scale) {
  std::string line = Printable(text);
  return stb_easy_font_width(line.data()) * scale;
}

Rgb TurboColor(double t) {
  if (std::isnan(t)) return {128, 128, 128};
  t = std::clamp(t, 0.0, 1.0);
  const double t2 = t * t, t3 = t2 * t, t4 = t2 * t2, t5 = t4 * t;
  const double r = 0.13572138 + 4.61539260 * t - 42.66032258 * t2 + 132.13108234 * t3 - 152.94239396 * t4 +
                   59.28637943 * t5;
  const double g =
      0.09140261 + 2.19418839 * t + 4.84296658 * t2 - 14.18503333 * t3 + 4.27729857 * t4 + 2.82956604 * t5;
  const double b = 0.10667330 + 12.64194608 * t - 60.58204836 * t2 + 110.36276771 * t3 - 89.90310912 * t4 +
                   27.34824973 * t5;
  const auto byte = [](double v) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0, 1.0)));
  };
  return {byte(r), byte(g), byte(b)};
}

Image SideBySide(std::span<const Image> images, int gap) {
  int width = 0, height = 0;
  for (const Image& image : images) {
    width += image.width + (width > 0 ? gap : 0);
    height = std::max(height, image.height);
  }
  Image out(width, height, kGround);
  int x = 0;
  for (const Image& image : images) {
    for (int row = 0; row < image.height; ++row) {
      for (int column = 0; column < image.width; ++column) out.Set(x + column, row, image.At(column, row));
    }
    x += image.width + gap;
  }
  return out;
}

Image StackRows(const std::vector<Image>& rows) {
  if (rows.size() == 1) return rows.front();
  constexpr int kGap = 4;
  int width = 0, height = -kGap;
  for (const Image& row : rows) width = std::max(width, row.width), height += row.height + kGap;
  Image all(width, height, {255, 255, 255});
  int y = 0;
  for (const Image& row : rows) {
    for (int i = 0; i < row.height; ++i)
      std::copy_n(row.rgb.begin() + std::ptrdiff_t{3} * i * row.width,
                  std::size_t{3} * static_cast<std::size_t>(row.width),
                  all.rgb.begin() + std::ptrdiff_t{3} * (y + i) * width);
    y += row.height + kGap;
  }
  return all;
}

std::vector<Image> InRows(const std::vector<Image>& images) {
  std::vector<Image> rows;
  constexpr std::size_t kMost = 6;
  for (std::size_t i = 0; i < images.size(); i += kMost)
    rows.push_back(SideBySide(std::span(images).subspan(i, std::min(kMost, images.size() - i))));
  return rows;
}

Image Shrunk(const Image& image, int times) {
  Image out(image.width / times, image.height / times, kGround);
  const int count = times * times;
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      std::array<int, 3> sum = {};
      for (int i = 0; i < count; ++i) {
        const Rgb from = image.At(times * x + i % times, times * y + i / times);
        for (std::size_t k = 0; k < 3; ++k) sum[k] += from[k];
      }
      Rgb mean;
      for (std::size_t k = 0; k < 3; ++k) mean[k] = static_cast<std::uint8_t>((sum[k] + count / 2) / count);
      out.Set(x, y, mean);
    }
  }
  return out;
}

}  // namespace kpsa::engine
