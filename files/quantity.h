// Numbers as authors write them: "12", "0.2mm", "-25 deg", "1%", "0.5s", "10f". Inside the runtime everything
// is metres, radians and seconds (base/types.h); FileUnits says what a bare number of a file means.
#pragma once

#include <string>
#include <string_view>

#include "base/status.h"
#include "base/types.h"

namespace kpsa::engine {

// How bare numbers are read: `units:` of a rig file, and its frames a second.
struct FileUnits {
  std::string length_name = "m";
  std::string angle_name = "deg";
  double length = 1;                            // metres a unit
  double angle = 3.14159265358979323846 / 180;  // radians a unit
  double fps = 24;                              // for the suffix f
  Status SetLength(std::string_view name);      // mm, cm or m
  Status SetAngle(std::string_view name);       // deg or rad

  // Runtime units for one unit of the file.
  double FactorOf(Unit unit) const;
};

// A number of that dimension, in runtime units. A bare number is in the file's unit; Unit::kNone takes a bare
// number or a percentage. Refused, with what was expected: unknown or wrong suffixes, NaN and infinities,
// overflow, leading zeros and 0x (which YAML versions read differently), anything else that is not decimal.
Result<double> ParseQuantity(std::string_view text, Unit unit, const FileUnits& units);

// Whether the text begins as numbers do, so that a message about numbers helps its author.
bool LooksNumeric(std::string_view text);

// The shortest decimal text that reads back as the same double.
std::string NumberText(double value);

}  // namespace kpsa::engine
