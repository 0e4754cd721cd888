#include "files/quantity.h"

#include <array>
#include <charconv>
#include <cmath>

#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

struct Suffix {
  std::string_view name;
  Unit unit;
  double factor;  // runtime units; frames are divided by fps instead
};
constexpr std::array<Suffix, 8> kSuffixes = {{{"mm", Unit::kLength, 0.001},
                                              {"cm", Unit::kLength, 0.01},
                                              {"m", Unit::kLength, 1},
                                              {"deg", Unit::kAngle, kPi / 180},
                                              {"rad", Unit::kAngle, 1},
                                              {"s", Unit::kTime, 1},
                                              {"f", Unit::kTime, 1},
                                              {"%", Unit::kNone, 0.01}}};

const char* Dimension(Unit unit) {
  switch (unit) {
    case Unit::kLength:
      return "a length (mm, cm, m)";
    case Unit::kAngle:
      return "an angle (deg, rad)";
    case Unit::kTime:
      return "a time (s, f)";
    case Unit::kNone:
      break;
  }
  return "a number without a unit";
}

const Suffix* FindSuffix(std::string_view name) {
  for (const Suffix& suffix : kSuffixes) {
    if (suffix.name == name) return &suffix;
  }
  return nullptr;
}

std::string SuffixNames() {
  std::string names;
  for (const Suffix& suffix : kSuffixes) names += (names.empty() ? "" : ", ") + std::string(suffix.name);
  return names;
}

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

std::string_view Trim(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

}  // namespace

Status FileUnits::SetLength(std::string_view name) {
  const Suffix* suffix = FindSuffix(name);
  if (suffix == nullptr || suffix->unit != Unit::kLength) {
    return Status::Invalid("unknown unit of length \"{}\": expected mm, cm or m", name);
  }
  length_name = name;
  length = suffix->factor;
  return Status();
}

Status FileUnits::SetAngle(std::string_view name) {
  const Suffix* suffix = FindSuffix(name);
  if (suffix == nullptr || suffix->unit != Unit::kAngle) {
    return Status::Invalid("unknown unit of angle \"{}\": expected deg or rad", name);
  }
  angle_name = name;
  angle = suffix->factor;
  return Status();
}

double FileUnits::FactorOf(Unit unit) const {
  return unit == Unit::kLength ? length : unit == Unit::kAngle ? angle : 1.0;
}

bool LooksNumeric(std::string_view text) {
  text = Trim(text);
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  if (text.empty()) return false;
  if (IsDigit(text[0])) return true;
  if (text[0] != '.' || text.size() < 2) return false;
  return IsDigit(text[1]) || text == ".nan" || text == ".NaN" || text == ".NAN" || text == ".inf" ||
         text == ".Inf" || text == ".INF";
}

Result<double> ParseQuantity(std::string_view text, Unit unit, const FileUnits& units) {
  const std::string_view whole = Trim(text);
  std::string_view rest = whole;
  const bool negative = !rest.empty() && rest[0] == '-';
  if (!rest.empty() && (rest[0] == '-' || rest[0] == '+')) rest.remove_prefix(1);
  const bool decimal =
      !rest.empty() && (IsDigit(rest[0]) || (rest.size() > 1 && rest[0] == '.' && IsDigit(rest[1])));
  if (!decimal) {
    if (LooksNumeric(whole))
      return Status::Invalid("\"{}\" is not finite: expected {}", whole, Dimension(unit));
    return Status::Invalid("\"{}\" is no number: expected {}", whole, Dimension(unit));
  }
  if (rest[0] == '0' && rest.size() > 1 &&
      (IsDigit(rest[1]) || rest[1] == 'x' || rest[1] == 'o' || rest[1] == 'b')) {
    return Status::Invalid(
        "\"{}\": write numbers in decimal and without leading zeros (YAML versions disagree about "
        "them)",
        whole);
  }
  double number = 0;
  auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error == std::errc::result_out_of_range &&
      std::string_view(rest.data(), static_cast<std::size_t>(end - rest.data())).find("e-") !=
          std::string_view::npos) {
    number = 0, error = std::errc();  // too small to tell from 0
  }
  if (error == std::errc::result_out_of_range || !std::isfinite(number)) {
    return Status::Invalid("\"{}\" is outside of the range of numbers", whole);
  }
  if (error != std::errc())
    return Status::Invalid("\"{}\" is no number: expected {}", whole, Dimension(unit));
  if (negative) number = -number;
  const std::string_view name = Trim(rest.substr(static_cast<std::size_t>(end - rest.data())));
  if (name.empty()) return number * units.FactorOf(unit);

  const Suffix* suffix = FindSuffix(name);
  if (suffix == nullptr) {
    return Status::Invalid("\"{}\": unknown unit \"{}\"; the units are {}", whole, name, SuffixNames());
  }
  if (suffix->unit != unit) {
    return Status::Invalid("\"{}\": expected {}{}", whole, Dimension(unit),
                           unit == Unit::kNone ? "" : " or a bare number in the file's unit");
  }
  number = name == "f" ? number / units.fps : number * suffix->factor;
  if (!std::isfinite(number)) return Status::Invalid("\"{}\" is outside of the range of numbers", whole);
  return number;
}

std::string NumberText(double value) {
  if (value == 0) return "0";  // no "-0"
  char buffer[40];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return error == std::errc() ? std::string(buffer, end) : "0";
}

}  // namespace kpsa::engine
