#include "rig/build/starter_text.h"

#include <algorithm>
#include <cmath>

#include "files/quantity.h"

namespace kpsa::engine {

MotionRange RoundedOut(MotionRange range, double step) {
  return {std::floor(range.min / step + 1e-6) * step, std::ceil(range.max / step - 1e-6) * step};
}

std::string Rounded(double value) { return NumberText(std::round(value * 1e9) / 1e9); }

std::string Quoted(const std::string& text, bool in_flow) {
  const auto safe = [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '.' || c == '-' || c == '@' || (!in_flow && (c == '[' || c == ']'));
  };
  const bool letter_first = !text.empty() && ((text[0] >= 'a' && text[0] <= 'z') ||
                                              (text[0] >= 'A' && text[0] <= 'Z') || text[0] == '_');
  if (letter_first && std::all_of(text.begin(), text.end(), safe)) return text;
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string QuotedList(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + Quoted(name, true);
  return "[" + text + "]";
}

std::string InComment(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  }
  return text;
}

}  // namespace kpsa::engine
