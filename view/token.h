// What only those know who were given it.
#pragma once

#include <string>
#include <string_view>

namespace kpsa::engine {

std::string NewToken();  // 128 random bits of the system, as 32 hexadecimal digits
// In a time that does not tell how much of them is equal.
bool SameToken(std::string_view a, std::string_view b);

}  // namespace kpsa::engine
