#include "base/text.h"

namespace kpsa::engine {

std::string Thousands(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t i = text.size(); i > 3;) text.insert(i -= 3, ",");
  return text;
}

std::size_t LongestBefore(char separator, std::string_view text,
                          const std::function<bool(std::string_view)>& known) {
  std::size_t at = text.rfind(separator);
  while (at != std::string_view::npos && at > 0) {
    if (known(text.substr(0, at))) return at;
    at = text.rfind(separator, at - 1);
  }
  return std::string_view::npos;
}

}  // namespace kpsa::engine
