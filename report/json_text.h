// JSON as every command prints it.
#pragma once

#include <string>

namespace kpsa::engine {

// Indented, with a line's end; what is no UTF-8 is replaced.
template <typename Json>
std::string JsonText(const Json& document) {
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace kpsa::engine
