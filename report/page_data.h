// What the viewer's page reads (docs/viewer-data.md): the keys of the meta, each a JSON text, and the blobs that
// they name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kpsa::engine {

// An array without a header, little-endian.
struct PageBlob {
  std::string name;
  std::string type;       // f32 u32 i16 i8 u8
  std::size_t count = 0;  // of elements
  std::string bytes;
};

class PageData {
 public:
  // `json` is a JSON value as text. A key is put once; keys stay in that order.
  void Put(std::string_view key, std::string json);
  // Names are made of A-Z a-z 0-9 _ . - and are added once. Gives the name back.
  std::string AddBlob(std::string_view name, std::span<const float> values);
  std::string AddBlob(std::string_view name, std::span<const std::uint32_t> values);
  std::string AddBlob(std::string_view name, std::span<const std::int16_t> values);
  std::string AddBlob(std::string_view name, std::span<const std::int8_t> values);
  std::string AddBlob(std::string_view name, std::span<const std::uint8_t> values);

  const std::vector<PageBlob>& blobs() const { return blobs_; }
  const PageBlob* Find(std::string_view name) const;  // null if there is none
  // All keys, with `format` before them and `blobs` behind; `deflated`: so is each blob that a report carries.
  std::string Meta(bool deflated = false) const;

 private:
  std::vector<std::pair<std::string, std::string>> keys_;
  std::vector<PageBlob> blobs_;
};

}  // namespace kpsa::engine
