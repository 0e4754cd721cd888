#include "cli/number_lists.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "base/text.h"
#include "host/rig_frames.h"

namespace kpsa::engine {
namespace {

std::string_view Trim(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(Trim(text.substr(begin, end == std::string_view::npos ? end : end - begin)));
    if (end == std::string_view::npos) return parts;
    begin = end + 1;
  }
}

bool ParseWhole(std::string_view text, std::int64_t* value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc() && end == text.data() + text.size();
}

// A long argument, cut for messages.
std::string Quote(std::string_view text) {
  return text.size() <= 60 ? std::string(text) : std::string(text.substr(0, 57)) + "...";
}

}  // namespace

Result<double> ParseNumber(std::string_view what, std::string_view text) {
  double value = 0;
  const std::string_view trimmed = Trim(text);
  const auto [end, error] = std::from_chars(trimmed.data(), trimmed.data() + trimmed.size(), value);
  if (trimmed.empty() || error != std::errc() || end != trimmed.data() + trimmed.size() ||
      !std::isfinite(value)) {
    return Status::Usage("{} \"{}\": expected a finite number", what, Quote(text));
  }
  return value;
}

Result<int> ParseCount(std::string_view what, std::string_view text, int low, int high) {
  std::int64_t value = 0;
  if (!ParseWhole(Trim(text), &value) || value < low || value > high) {
    return Status::Usage("{} \"{}\": expected a whole number from {} to {}", what, Quote(text), low, high);
  }
  return static_cast<int>(value);
}

Result<std::vector<std::int64_t>> ParseFrames(std::string_view text) {
  const std::vector<std::string_view> parts = Split(text, ':');
  std::int64_t numbers[3] = {0, 0, 1};
  if (parts.size() > 3)
    return Status::Usage("--frames \"{}\": expected A:B or A:B:S, found {} parts", Quote(text), parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!ParseWhole(parts[i], &numbers[i]) || std::abs(static_cast<double>(numbers[i])) > 1e12) {
      return Status::Usage("--frames \"{}\": expected A:B or A:B:S with whole numbers, found \"{}\"",
                           Quote(text), Quote(parts[i]));
    }
  }
  if (parts.size() == 1) numbers[1] = numbers[0];
  const auto [first, last, step] = numbers;
  if (step < 1)
    return Status::Usage("--frames \"{}\": expected a step of 1 or more, found {}", Quote(text), step);
  if (last < first)
    return Status::Usage("--frames \"{}\": the last frame, {}, is before the first, {}", Quote(text), last,
                         first);
  const std::int64_t count = (last - first) / step + 1;
  if (count > static_cast<std::int64_t>(kMaxSamples)) {
    return Status::Usage("--frames \"{}\": {} frames are more than {}, the most of one evaluation",
                         Quote(text), Thousands(static_cast<std::uint64_t>(count)), Thousands(kMaxSamples));
  }
  std::vector<std::int64_t> frames(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i] = first + static_cast<std::int64_t>(i) * step;
  return frames;
}

Result<std::vector<double>> ParseTimes(std::string_view text) {
  std::vector<double> times;
  for (std::string_view part : Split(text, ',')) {
    const Result<double> time = ParseNumber("--times", part);
    if (!time.ok()) return time.status();
    times.push_back(*time);
    if (times.size() > kMaxSamples)
      return Status::Usage("--times: more than {} times", Thousands(kMaxSamples));
  }
  return times;
}

Result<Double3> ParsePlace(std::string_view what, std::string_view text) {
  const std::vector<std::string_view> parts = Split(text, ',');
  if (parts.size() != 3)
    return Status::Usage("{} \"{}\": expected X,Y,Z in metres, found {} parts", what, Quote(text),
                         parts.size());
  Double3 place;
  for (int k = 0; k < 3; ++k) {
    const Result<double> number = ParseNumber(what, parts[static_cast<std::size_t>(k)]);
    if (!number.ok()) return number.status();
    place[k] = *number;
  }
  return place;
}

Result<std::vector<Index>> ParseIndices(std::string_view what, std::string_view text, Index total) {
  std::vector<Index> indices;
  for (std::string_view part : Split(text, ',')) {
    const std::vector<std::string_view> ends = Split(part, ':');
    std::int64_t low = 0, high = 0;
    if (ends.size() > 2 || !ParseWhole(ends.front(), &low) || !ParseWhole(ends.back(), &high) || low < 0 ||
        high < low) {
      return Status::Usage("{} \"{}\": expected indices and ranges, as in 0:99,120", what, Quote(text));
    }
    if (high >= static_cast<std::int64_t>(total)) {
      return Status::Usage("{} \"{}\": {} is out of range, expected 0 to {}", what, Quote(text), high,
                           static_cast<std::int64_t>(total) - 1);
    }
    for (std::int64_t i = low; i <= high; ++i) indices.push_back(static_cast<Index>(i));
    if (indices.size() > 2 * static_cast<std::size_t>(total))
      return Status::Usage("{} \"{}\": ranges overlap", what, Quote(text));
  }
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  return indices;
}

}  // namespace kpsa::engine
