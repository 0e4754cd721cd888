// JSON as every command prints it.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <string>

namespace kpsa::engine {

// Indented, with a line's end; what is no UTF-8 is replaced.
template <typename Json>
std::string JsonText(const Json& document) {
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// In one line, as pages carry it; what is no UTF-8 is replaced.
template <typename Json>
std::string CompactJson(const Json& document) {
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}
// A number to so many digits; null where it is not finite.
template <typename Json>
Json RoundedJson(double value, int digits) {
  if (!std::isfinite(value)) return nullptr;
  return std::strtod(fmt::format("{:.{}g}", value, digits).c_str(),
                     nullptr);  // stod throws at the smallest numbers
}

}  // namespace kpsa::engine
