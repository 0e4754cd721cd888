// PNG files chunk by chunk, of any kind and with any damage.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <vector>

namespace kpsa::engine {

using PngBytes = std::vector<std::uint8_t>;

inline void PutU32(std::uint32_t value, PngBytes* to) {
  for (int shift = 24; shift >= 0; shift -= 8) to->push_back(static_cast<std::uint8_t>(value >> shift));
}

inline void PutChunk(const std::string& type, const PngBytes& data, PngBytes* to) {
  PutU32(static_cast<std::uint32_t>(data.size()), to);
  PngBytes checked(type.begin(), type.end());
  checked.insert(checked.end(), data.begin(), data.end());
  to->insert(to->end(), checked.begin(), checked.end());
  PutU32(static_cast<std::uint32_t>(crc32(0, checked.data(), static_cast<uInt>(checked.size()))), to);
}

// color_type: 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA. rows: all of them, without their filter bytes.
// `more`: chunks before the pixels.
inline PngBytes MakePng(std::uint32_t width, std::uint32_t height, int bits, int color_type,
                        const PngBytes& rows, const PngBytes& more = {}) {
  PngBytes png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, head;
  PutU32(width, &head);
  PutU32(height, &head);
  for (const int value : {bits, color_type, 0, 0, 0}) head.push_back(static_cast<std::uint8_t>(value));
  PutChunk("IHDR", head, &png);
  png.insert(png.end(), more.begin(), more.end());
  PngBytes filtered;
  for (std::size_t y = 0; y < height && !rows.empty(); ++y) {
    const std::size_t stride = rows.size() / height;
    filtered.push_back(0);
    filtered.insert(filtered.end(), rows.begin() + static_cast<std::ptrdiff_t>(y * stride),
                    rows.begin() + static_cast<std::ptrdiff_t>((y + 1) * stride));
  }
  uLongf size = compressBound(filtered.size());
  PngBytes packed(size);
  compress(packed.data(), &size, filtered.data(), filtered.size());
  packed.resize(size);
  PutChunk("IDAT", packed, &png);
  PutChunk("IEND", {}, &png);
  return png;
}

}  // namespace kpsa::engine
