#include "files/png.h"

#include "files/file.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>

namespace kpsa::engine {
namespace {

constexpr int kLargestSide =
    32768;  // 3 GiB of pixels: stb counts bytes in int, so the product is checked, too

void AppendBytes(void* context, void* data, int size) {
  auto* bytes = static_cast<std::vector<std::uint8_t>*>(context);
  const auto* begin = static_cast<const std::uint8_t*>(data);
  bytes->insert(bytes->end(), begin, begin + size);
}

}  // namespace

Result<std::vector<std::uint8_t>> EncodePng(int width, int height, std::span<const std::uint8_t> rgb) {
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide ||
      static_cast<std::int64_t>(width) * height * 3 > INT32_MAX / 2) {
    return Status::Invalid("a picture of {} x {} pixels cannot be written as PNG", width, height);
  }
  const std::size_t expected = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
  if (rgb.size() != expected) {
    return Status::Invalid("a picture of {} x {} pixels needs {} bytes, there are {}", width, height,
                           expected, rgb.size());
  }
  std::vector<std::uint8_t> bytes;
  if (stbi_write_png_to_func(&AppendBytes, &bytes, width, height, 3, rgb.data(), 3 * width) == 0) {
    return Status::Evaluation("the PNG of {} x {} pixels could not be compressed", width, height);
  }
  return bytes;
}

Status WritePng(const std::string& path, bool force, int width, int height,
                std::span<const std::uint8_t> rgb) {
  Result<std::vector<std::uint8_t>> bytes = EncodePng(width, height, rgb);
  if (!bytes.ok()) return bytes.status();
  return WriteFileAtomically(path, force, *bytes);
}

}  // namespace kpsa::engine
