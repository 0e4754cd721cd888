// PNG and JPEG files to pixels. The bytes are hostile: sizes are looked at before anything is allocated, and what
// is cut or damaged is an error.
#pragma once

#include <cstdint>
#include <span>

#include "base/status.h"
#include "picture/image.h"

namespace kpsa::engine {

// Eight bits a channel, as they are stored: colour profiles and gamma are not looked at, as glTF wants it, and
// neither is alpha. `most` pixels at most. Errors: neither PNG nor JPEG; larger; damaged; CMYK.
Result<Image> DecodePicture(std::span<const std::uint8_t> bytes, std::uint64_t most);

}  // namespace kpsa::engine
