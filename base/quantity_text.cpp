#include "base/quantity_text.h"

#include <fmt/format.h>

#include <cmath>

#include "base/text.h"

namespace kpsa::engine {

std::string ByteText(std::uint64_t bytes) {
  const char* const kUnits[] = {"B", "KB", "MB", "GB", "TB"};
  double value = static_cast<double>(bytes);
  int unit = 0;
  for (; value >= 999.5 && unit < 4; ++unit) value /= 1000;
  return unit == 0 ? fmt::format("{} B", bytes) : fmt::format("{:.3g} {}", value, kUnits[unit]);
}

std::string ErrorText(double error, bool light) {
  return light ? fmt::format("{:.3g}", error) : LengthText(error);
}

std::string LengthText(double metres) {
  if (!std::isfinite(metres)) return "not finite";
  return metres < 0.1 ? fmt::format("{:.3g} mm", metres * 1000) : fmt::format("{:.4g} m", metres);
}

std::string RatioText(double ratio, int digits) {
  return std::isfinite(ratio) ? fmt::format("{:.{}f}x", ratio, digits) : "-";
}

std::string Plural(std::uint64_t count, const std::string& noun) {
  if (count == 1) return "1 " + noun;
  if (noun.ends_with("vertex")) return Thousands(count) + " " + noun.substr(0, noun.size() - 2) + "ices";
  return Thousands(count) + " " + noun + (noun.ends_with("sh") || noun.ends_with("ss") ? "es" : "s");
}

}  // namespace kpsa::engine
