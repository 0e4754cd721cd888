#include "picture/decode.h"

#include <png.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>

// After cstdio, whose names it uses
#include <jerror.h>
#include <jpeglib.h>

namespace kpsa::engine {
namespace {

constexpr std::uint32_t kLongestSide = 32768;

// What a library has said went wrong, and where its jumps lead. Nothing with a destructor lives between.
struct Failure {
  std::jmp_buf back;
  char message[200] = "";
  void Say(const char* text) {
    std::strncpy(message, text, sizeof(message) - 1);
    for (char* c = message; *c != 0; ++c) {
      if (*c < 32 || *c > 126) *c = '?';
    }
  }
};

Status CheckSize(std::uint64_t width, std::uint64_t height, std::uint64_t most) {
  if (width == 0 || height == 0 || width > kLongestSide || height > kLongestSide || width * height > most) {
    return Status::Invalid("has {} x {} pixels; {} are left, and a side has {} at most", width, height, most,
                           kLongestSide);
  }
  return {};
}

// --- PNG

struct PngFile {
  std::span<const std::uint8_t> rest;
  Failure failure;
  png_structp png = nullptr;
  png_infop info = nullptr;
  Image image;
  std::vector<png_bytep> rows;
  ~PngFile() { png_destroy_read_struct(&png, &info, nullptr); }
};

void PngRead(png_structp png, png_bytep to, std::size_t size) {
  auto* file = static_cast<PngFile*>(png_get_io_ptr(png));
  if (size > file->rest.size()) png_error(png, "it is cut");
  std::memcpy(to, file->rest.data(), size);
  file->rest = file->rest.subspan(size);
}
void PngFail(png_structp png, png_const_charp text) {
  auto* failure = static_cast<Failure*>(png_get_error_ptr(png));
  failure->Say(text);
  std::longjmp(failure->back, 1);
}
void PngWarn(png_structp, png_const_charp) {}

bool PngHeader(PngFile* file) {
  if (setjmp(file->failure.back) != 0) return false;
  png_set_user_limits(file->png, kLongestSide, kLongestSide);
  png_set_chunk_cache_max(file->png, 64);
  png_set_chunk_malloc_max(file->png, 1 << 20);
  png_set_read_fn(file->png, file, &PngRead);
  png_read_info(file->png, file->info);
  return true;
}

bool PngPixels(PngFile* file) {
  if (setjmp(file->failure.back) != 0) return false;
  png_set_scale_16(file->png);
  png_set_expand(file->png);
  png_set_gray_to_rgb(file->png);
  png_set_strip_alpha(file->png);
  png_set_interlace_handling(file->png);
  png_read_update_info(file->png, file->info);
  if (png_get_rowbytes(file->png, file->info) != std::size_t{3} * static_cast<std::size_t>(file->image.width))
    png_error(file->png, "its rows have an unknown form");
  png_read_image(file->png, file->rows.data());
  png_read_end(file->png, nullptr);
  return true;
}

Result<Image> DecodePng(std::span<const std::uint8_t> bytes, std::uint64_t most) {
  const auto file = std::make_unique<PngFile>();
  file->rest = bytes;
  file->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &file->failure, &PngFail, &PngWarn);
  if (file->png != nullptr) file->info = png_create_info_struct(file->png);
  if (file->info == nullptr) return Status::Invalid("cannot be read as PNG: no memory");
  if (!PngHeader(file.get())) return Status::Invalid("is a damaged PNG: {}", file->failure.message);
  const std::uint32_t width = png_get_image_width(file->png, file->info),
                      height = png_get_image_height(file->png, file->info);
  KPSA_RETURN_IF_ERROR(CheckSize(width, height, most));
  file->image = Image(static_cast<int>(width), static_cast<int>(height), {0, 0, 0});
  for (std::uint32_t y = 0; y < height; ++y)
    file->rows.push_back(file->image.rgb.data() + std::size_t{3} * width * y);
  if (!PngPixels(file.get())) return Status::Invalid("is a damaged PNG: {}", file->failure.message);
  return std::move(file->image);
}

// --- JPEG

struct JpegFile {
  jpeg_decompress_struct jpeg = {};
  jpeg_error_mgr errors = {};
  jpeg_progress_mgr progress = {};
  Failure failure;
  Image image;
  ~JpegFile() { jpeg_destroy_decompress(&jpeg); }
};

JpegFile& FileOf(j_common_ptr jpeg) { return *static_cast<JpegFile*>(jpeg->client_data); }

[[noreturn]] void JpegFail(j_common_ptr jpeg) {
  char text[JMSG_LENGTH_MAX];
  (*jpeg->err->format_message)(jpeg, text);
  FileOf(jpeg).failure.Say(text);
  std::longjmp(FileOf(jpeg).failure.back, 1);
}
// Warnings are harmless, but for those of data that end too soon or are damaged.
void JpegSay(j_common_ptr jpeg, int level) {
  if (level >= 0) return;
  const int code = jpeg->err->msg_code;
  if (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE ||
      code == JWRN_MUST_RESYNC)
    JpegFail(jpeg);
}
// A small file may hold very many scans of a large picture.
void JpegWatch(j_common_ptr jpeg) {
  constexpr int kMostScans = 100;
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= kMostScans) return;
  FileOf(jpeg).failure.Say("it has too many scans");
  std::longjmp(FileOf(jpeg).failure.back, 1);
}

bool JpegHeader(JpegFile* file, std::span<const std::uint8_t> bytes) {
  if (setjmp(file->failure.back) != 0) return false;
  jpeg_create_decompress(&file->jpeg);
  file->jpeg.client_data = file;
  file->jpeg.progress = &file->progress;
  jpeg_mem_src(&file->jpeg, bytes.data(), bytes.size());
  jpeg_read_header(&file->jpeg, TRUE);
  return true;
}

bool JpegPixels(JpegFile* file) {
  if (setjmp(file->failure.back) != 0) return false;
  file->jpeg.out_color_space = JCS_RGB;
  file->jpeg.dct_method = JDCT_ISLOW;
  jpeg_start_decompress(&file->jpeg);
  while (file->jpeg.output_scanline < file->jpeg.output_height) {
    JSAMPROW row = file->image.rgb.data() +
                   std::size_t{3} * static_cast<std::size_t>(file->image.width) * file->jpeg.output_scanline;
    jpeg_read_scanlines(&file->jpeg, &row, 1);
  }
  jpeg_finish_decompress(&file->jpeg);
  return true;
}

Result<Image> DecodeJpeg(std::span<const std::uint8_t> bytes, std::uint64_t most) {
  const auto file = std::make_unique<JpegFile>();
  file->jpeg.err = jpeg_std_error(&file->errors);
  file->jpeg.client_data = file.get();
  file->errors.error_exit = &JpegFail;
  file->errors.emit_message = &JpegSay;
  file->progress.progress_monitor = &JpegWatch;
  if (!JpegHeader(file.get(), bytes)) return Status::Invalid("is a damaged JPEG: {}", file->failure.message);
  const jpeg_decompress_struct& jpeg = file->jpeg;
  KPSA_RETURN_IF_ERROR(CheckSize(jpeg.image_width, jpeg.image_height, most));
  if (jpeg.jpeg_color_space != JCS_GRAYSCALE && jpeg.jpeg_color_space != JCS_YCbCr &&
      jpeg.jpeg_color_space != JCS_RGB)
    return Status::Invalid("is a JPEG of {} channels that are neither grey nor red, green and blue",
                           jpeg.num_components);
  file->image = Image(static_cast<int>(jpeg.image_width), static_cast<int>(jpeg.image_height), {0, 0, 0});
  if (!JpegPixels(file.get())) return Status::Invalid("is a damaged JPEG: {}", file->failure.message);
  return std::move(file->image);
}

bool StartsWith(std::span<const std::uint8_t> bytes, std::initializer_list<std::uint8_t> start) {
  return bytes.size() >= start.size() && std::equal(start.begin(), start.end(), bytes.begin());
}

}  // namespace

Result<Image> DecodePicture(std::span<const std::uint8_t> bytes, std::uint64_t most) {
  if (StartsWith(bytes, {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'})) return DecodePng(bytes, most);
  if (StartsWith(bytes, {0xff, 0xd8, 0xff})) return DecodeJpeg(bytes, most);
  return Status::Invalid("is neither PNG nor JPEG");
}

}  // namespace kpsa::engine
