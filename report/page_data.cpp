#include "report/page_data.h"

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

#include "base/check.h"

namespace kpsa::engine {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename T>
std::string Add(std::string_view name, const char* type, std::span<const T> values,
                std::vector<PageBlob>* to) {
  KPSA_CHECK(std::ranges::find(*to, name, &PageBlob::name) == to->end());
  to->push_back({std::string(name), type, values.size(),
                 std::string(reinterpret_cast<const char*>(values.data()), values.size_bytes())});
  return to->back().name;
}

}  // namespace

void PageData::Put(std::string_view key, std::string json) { keys_.emplace_back(key, std::move(json)); }

std::string PageData::AddBlob(std::string_view name, std::span<const float> values) {
  return Add(name, "f32", values, &blobs_);
}
std::string PageData::AddBlob(std::string_view name, std::span<const std::uint32_t> values) {
  return Add(name, "u32", values, &blobs_);
}
std::string PageData::AddBlob(std::string_view name, std::span<const std::int16_t> values) {
  return Add(name, "i16", values, &blobs_);
}
std::string PageData::AddBlob(std::string_view name, std::span<const std::int8_t> values) {
  return Add(name, "i8", values, &blobs_);
}
std::string PageData::AddBlob(std::string_view name, std::span<const std::uint8_t> values) {
  return Add(name, "u8", values, &blobs_);
}

const PageBlob* PageData::Find(std::string_view name) const {
  const auto it = std::ranges::find(blobs_, name, &PageBlob::name);
  return it == blobs_.end() ? nullptr : &*it;
}

std::string PageData::Meta(bool deflated) const {
  std::string meta = "{\"format\":1";
  for (const auto& [key, json] : keys_) meta += "," + nlohmann::json(key).dump() + ":" + json;
  nlohmann::ordered_json blobs = nlohmann::ordered_json::object();
  for (const PageBlob& blob : blobs_) {
    blobs[blob.name] = {{"type", blob.type}, {"count", blob.count}};
    if (deflated) blobs[blob.name]["deflate"] = true;
  }
  return meta + ",\"blobs\":" + blobs.dump() + "}";
}

}  // namespace kpsa::engine
