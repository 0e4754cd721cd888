// What is typed on a command line: frame ranges, lists of times and indices, numbers with units.
#include <cmath>

#include "cli/number_lists.h"
#include "files/quantity.h"
#include "host/rig_frames.h"
#include "tests/fuzz/fuzzer.h"

namespace kpsa::engine {

KPSA_FUZZER(frames) {
  const std::string text = AsText(bytes);
  if (const auto frames = ParseFrames(text); frames.ok()) {
    Reached("frames");
    Require(!frames->empty() && frames->size() <= kMaxSamples, "a number of frames that nobody may ask for");
    for (std::size_t i = 1; i < frames->size(); ++i)
      Require(
          (*frames)[i] - (*frames)[i - 1] == (*frames)[1] - (*frames)[0] && (*frames)[i] > (*frames)[i - 1],
          "frames that are not evenly spaced");
  } else {
    RequireRefusal(frames.status());
  }
  if (const auto times = ParseTimes(text); times.ok()) {
    Reached("times");
    for (double time : *times) Require(std::isfinite(time), "a time that is not finite");
  } else {
    RequireRefusal(times.status());
  }
  constexpr Index kTotal = 500;
  if (const auto indices = ParseIndices("--vertices", text, kTotal); indices.ok()) {
    Reached("indices");
    for (std::size_t i = 0; i < indices->size(); ++i)
      Require((*indices)[i] < kTotal && (i == 0 || (*indices)[i] > (*indices)[i - 1]),
              "indices out of order");
  } else {
    RequireRefusal(indices.status());
  }
  if (const auto count = ParseCount("--threads", text, 1, 64); count.ok())
    Require(*count >= 1 && *count <= 64, "a count out of range");
  if (const auto place = ParsePlace("--at", text); place.ok()) {
    Reached("place");
    Require(std::isfinite(place->x) && std::isfinite(place->y) && std::isfinite(place->z), "a place nowhere");
  }
  FileUnits units;
  for (const double fps : {24.0, 0.01}) {
    units.fps = fps;
    for (const Unit unit : {Unit::kNone, Unit::kLength, Unit::kAngle, Unit::kTime}) {
      const Result<double> number = ParseQuantity(text, unit, units);
      if (!number.ok()) {
        RequireRefusal(number.status());
        continue;
      }
      Reached("quantity");
      Require(std::isfinite(*number), "a quantity that is not finite");
      const double in_file = *number / units.FactorOf(unit);
      if (!std::isfinite(in_file)) continue;
      const Result<double> again = ParseQuantity(NumberText(in_file), unit, units);
      Require(again.ok() && std::abs(*again - *number) <= 1e-12 * std::abs(*number) + 1e-300,
              "a quantity that does not read back");
    }
  }
}

}  // namespace kpsa::engine
