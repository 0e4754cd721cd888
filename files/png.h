// PNG pictures, 8 bits a channel.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"

namespace kpsa::engine {

// The bytes of a PNG file (colour type 2, RGB). rgb: width * height * 3 values, rows from the top, sRGB.
// Errors: a size below 1 or above 32768; rgb of another length.
Result<std::vector<std::uint8_t>> EncodePng(int width, int height, std::span<const std::uint8_t> rgb);

// Writes EncodePng's bytes to `path`, whole or not at all (files/file.h). Errors also: those of
// WriteFileAtomically; the file exists and `force` is false.
Status WritePng(const std::string& path, bool force, int width, int height,
                std::span<const std::uint8_t> rgb);

}  // namespace kpsa::engine
