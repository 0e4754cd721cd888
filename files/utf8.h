// Whether text is UTF-8.
#pragma once

#include <cstddef>
#include <string_view>

namespace kpsa::engine {

// The first byte that is not well-formed UTF-8 (Unicode 15, table 3-7); npos if there is none.
std::size_t FindNotUtf8(std::string_view text);

}  // namespace kpsa::engine
