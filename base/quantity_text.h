// Quantities in sentences and tables.
#pragma once

#include <cstdint>
#include <string>

namespace kpsa::engine {

std::string ByteText(std::uint64_t bytes);                         // 3.1 MB
std::string LengthText(double metres);                             // 0.213 mm
std::string RatioText(double ratio, int digits = 1);               // 12.3x; - where it is not finite
std::string ErrorText(double error, bool light);                   // of points a length, of light a number
std::string Plural(std::uint64_t count, const std::string& noun);  // "1 mesh", "12 vertices"

}  // namespace kpsa::engine
