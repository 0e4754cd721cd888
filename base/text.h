// Numbers as people read them, and names within texts.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace kpsa::engine {

std::string Thousands(std::uint64_t number);  // 17,121

// Where the longest known name at the beginning of "name.rest" ends, with '.' or another separator after it;
// npos where none is known. Names may hold the separator themselves.
std::size_t LongestBefore(char separator, std::string_view text,
                          const std::function<bool(std::string_view)>& known);

}  // namespace kpsa::engine
