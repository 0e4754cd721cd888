// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

namespace kpsa {

std::string Thousands(std::uint64_t number);  // 17,121

}  // namespace kpsa
