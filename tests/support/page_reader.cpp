#include "tests/support/page_reader.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>

namespace kpsa::engine {
namespace {

std::string Inflated(const std::string& packed, std::size_t bytes) {
  std::string plain(bytes + 1, '\0');  // one more, so that too much is seen
  uLongf size = static_cast<uLong>(plain.size());
  const int code =
      uncompress(reinterpret_cast<Bytef*>(plain.data()), &size, reinterpret_cast<const Bytef*>(packed.data()),
                 static_cast<uLong>(packed.size()));
  if (code != Z_OK) return "";
  plain.resize(size);
  return plain;
}

std::size_t SizeOf(const std::string& type) {
  return type == "f32" || type == "u32" ? 4 : type == "i16" ? 2 : 1;
}

template <typename To, typename From>
void Convert(const std::string& bytes, std::vector<To>* values) {
  for (std::size_t i = 0; i + sizeof(From) <= bytes.size(); i += sizeof(From)) {
    From value;
    std::memcpy(&value, bytes.data() + i, sizeof(From));
    values->push_back(static_cast<To>(value));
  }
}

}  // namespace

std::string FromBase64(const std::string& text) {
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::size_t digit = alphabet.find(c);
    if (digit == std::string::npos) continue;
    bits = bits << 6 | static_cast<std::uint32_t>(digit), count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  return bytes;
}

ReadPage ParsePage(const std::string& html) {
  ReadPage page;
  const auto element = [&](const std::string& id) -> std::string {
    const std::string mark = "id=\"" + id + "\">";
    const std::size_t at = html.find(mark), begin = at + mark.size();
    if (at == std::string::npos) return page.error = "no element " + id, "";
    return html.substr(begin, html.find("</script", begin) - begin);
  };
  page.meta = nlohmann::json::parse(element("kpsa-meta"), nullptr, false);
  if (page.meta.is_discarded()) return page.error = "the meta is no JSON", page;
  for (const auto& [name, info] : page.meta["blobs"].items()) {
    const std::size_t bytes = info["count"].get<std::size_t>() * SizeOf(info["type"]);
    std::string blob = FromBase64(element("kpsa-blob-" + name));
    if (info.value("deflate", false)) blob = Inflated(blob, bytes);
    if (blob.size() != bytes) page.error = "blob " + name + " has not the size that the meta says";
    page.blobs[name] = blob;
  }
  return page;
}

std::vector<float> ReadPage::Floats(const std::string& name) const {
  std::vector<float> values;
  EXPECT_EQ(meta["blobs"][name]["type"], "f32");
  Convert<float, float>(blobs.at(name), &values);
  return values;
}

std::vector<int> ReadPage::Wholes(const std::string& name) const {
  std::vector<int> values;
  const std::string type = meta["blobs"][name]["type"];
  if (type == "i8") Convert<int, std::int8_t>(blobs.at(name), &values);
  if (type == "u8") Convert<int, std::uint8_t>(blobs.at(name), &values);
  if (type == "i16") Convert<int, std::int16_t>(blobs.at(name), &values);
  if (type == "u32") Convert<int, std::uint32_t>(blobs.at(name), &values);
  return values;
}

std::vector<double> ReadPage::Positions(std::size_t row) const {
  const nlohmann::json& shape = meta["shape"];
  const std::size_t modes = shape["modes"];
  const std::vector<float> rest = Floats(meta["rest"]), scale = Floats(shape["scale"]),
                           rows = Floats(shape["rows"]);
  const std::vector<int> basis = Wholes(shape["basis"]);
  const double largest = meta["blobs"][shape["basis"].get<std::string>()]["type"] == "i8" ? 127 : 32767;
  std::vector<double> points(rest.begin(), rest.end());
  for (std::size_t k = 0; k < modes; ++k) {
    const double factor =
        static_cast<double>(rows[row * modes + k]) * static_cast<double>(scale[k]) / largest;
    for (std::size_t i = 0; i < points.size(); ++i) points[i] += factor * basis[k * points.size() + i];
  }
  return points;
}

}  // namespace kpsa::engine
