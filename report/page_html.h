// A report as one file: the viewer's page with its data in it (docs/viewer-data.md).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "report/page_data.h"

namespace kpsa::engine {

// The standard alphabet, with padding.
std::string Base64(std::string_view bytes);
// zlib's format (RFC 1950), at its best compression: the same bytes every time.
std::string Deflated(std::string_view bytes);
// JSON that an HTML parser takes for no tag: every '<' is \u003c.
std::string JsonInHtml(std::string_view json);

struct PageHtml {
  struct Part {
    std::string name;  // "viewer", "meta", or a blob's
    std::size_t bytes = 0;
  };
  std::string text;
  std::vector<Part> parts;  // the largest first; they sum to the text
};
// Of a page of more than `most` bytes: its size, and its largest parts; else "".
std::string HeavyNote(const PageHtml& html, std::size_t most);
// Errors: `viewer` has not one placeholder alone on its line.
Result<PageHtml> MakePageHtml(std::string_view viewer, const PageData& data);

}  // namespace kpsa::engine
