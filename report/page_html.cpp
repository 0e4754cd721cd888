#include "report/page_html.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>

#include "base/check.h"
#include "base/quantity_text.h"
#include "report/viewer_page.h"

namespace kpsa::engine {

std::string Base64(std::string_view bytes) {
  constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kAlphabet[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string Deflated(std::string_view bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string packed(size, '\0');
  const int code =
      compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                static_cast<uLong>(bytes.size()), Z_BEST_COMPRESSION);
  KPSA_CHECK_EQ(code, Z_OK);  // the buffer is large enough, and only memory can be short
  packed.resize(size);
  return packed;
}

std::string JsonInHtml(std::string_view json) {
  std::string text;
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

std::string HeavyNote(const PageHtml& html, std::size_t most) {
  constexpr std::size_t kNamed = 4;
  if (html.text.size() <= most) return "";
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < std::min(kNamed, html.parts.size()); ++i)
    parts.push_back(fmt::format("{} {}", html.parts[i].name, ByteText(html.parts[i].bytes)));
  return fmt::format("the page has {}: {}, ...; fewer clips (--clip) make it smaller",
                     ByteText(html.text.size()), fmt::join(parts, ", "));
}

Result<PageHtml> MakePageHtml(std::string_view viewer, const PageData& data) {
  const std::string line = fmt::format("\n{}\n", kPagePlaceholder);
  const std::size_t at = viewer.find(line);
  if (at == std::string_view::npos ||
      viewer.find(kPagePlaceholder, at + line.size()) != std::string_view::npos ||
      viewer.find(kPagePlaceholder) != at + 1)
    return Status::Invalid("the viewer's page has not one line {}", kPagePlaceholder);
  PageHtml html;
  html.text = viewer.substr(0, at + 1);
  const auto add = [&](const std::string& name, const std::string& element) {
    html.text += element;
    html.parts.push_back({name, element.size()});
  };
  add("meta", fmt::format("<script type=\"application/json\" id=\"kpsa-meta\">{}</script>\n",
                          JsonInHtml(data.Meta(true))));
  for (const PageBlob& blob : data.blobs()) {
    add(blob.name, fmt::format("<script type=\"application/octet-stream\" id=\"kpsa-blob-{}\">{}</script>\n",
                               blob.name, Base64(Deflated(blob.bytes))));
  }
  html.text += viewer.substr(at + line.size());
  html.parts.push_back({"viewer", viewer.size() - kPagePlaceholder.size() - 1});
  std::stable_sort(html.parts.begin(), html.parts.end(),
                   [](const auto& a, const auto& b) { return a.bytes > b.bytes; });
  return html;
}

}  // namespace kpsa::engine
