#include "cli/bench_tables.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/common.h"
#include "cli/table.h"
#include "io/file.h"
#include "io/json_depth.h"
#include "kpsa/kpsa_node.h"

namespace kpsa {
namespace {

using BenchJsonValue = nlohmann::json;

constexpr std::uint64_t kMostBytes = 1u << 28;

// A side that accepts every frame, beside one with the same subspace that does not: their reconstructions are
// the same.
bool IsRepeated(const BenchJsonValue& side, const std::vector<BenchJsonValue>& sides) {
  if (side.at("tolerance").get<double>() < kAnyError) return false;
  const auto subspace = side.at("subspace").get<std::string>();
  return std::any_of(sides.begin(), sides.end(), [&](const BenchJsonValue& other) {
    return other.at("subspace").get<std::string>() == subspace &&
           other.at("tolerance").get<double>() < kAnyError;
  });
}

// Numbers as kpsa bench writes them: null where there is none, and -1 for an error that is not finite.
Status CheckSide(const BenchJsonValue& side) {
  const auto check = [&](const char* pointer, const char* expected, const auto& sound) {
    const BenchJsonValue& value = side.at(BenchJsonValue::json_pointer(pointer));
    if (value.is_null() || (value.is_number() && sound(value.get<double>()))) return Status();
    return Status::Invalid("{} is {}, expected {}", pointer,
                           value.is_number() ? value.dump() : value.type_name(), expected);
  };
  for (const char* count : {"/points", "/cues", "/cue_points", "/modes"}) {
    KPSA_RETURN_IF_ERROR(check(count, "a whole number from 0 on", [](double value) {
      return value >= 0 && value < 1e15 && value == std::floor(value);
    }));
  }
  KPSA_RETURN_IF_ERROR(
      check("/hit_rate", "a share from 0 to 1", [](double value) { return value >= 0 && value <= 1; }));
  std::vector<const char*> numbers = {"/tolerance",
                                      "/speedup_on_hits",
                                      "/speedup",
                                      "/ceiling/speedup",
                                      "/error/bbox_diagonal",
                                      "/full/ms_per_frame",
                                      "/full/ns_per_point",
                                      "/accelerated/ms_per_frame",
                                      "/accelerated/graph",
                                      "/accelerated/cues",
                                      "/accelerated/projection",
                                      "/accelerated/reconstruction",
                                      "/accelerated/downstream",
                                      "/accelerated/misses",
                                      "/storage/bytes_per_point"};
  if (!side.at("frame_errors").is_null()) {
    for (const char* part :
         {"/frame_errors/rms/projection", "/frame_errors/rms/cueing", "/frame_errors/rms/storage",
          "/frame_errors/rms/total", "/frame_errors/rms/soft_cache"})
      numbers.push_back(part);
  }
  for (const char* number : numbers)
    KPSA_RETURN_IF_ERROR(check(number, "a number from 0 on", [](double value) { return value >= 0; }));
  for (const char* error : {"/error/rms", "/error/max"}) {
    KPSA_RETURN_IF_ERROR(
        check(error, "a number from 0 on, or -1", [](double value) { return value >= 0 || value == -1; }));
  }
  return Status();
}

// The sides of a document, the first included.
Result<std::vector<BenchJsonValue>> ReadSides(const std::string& path) {
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kMostBytes);
  if (!bytes.ok()) return bytes.status();
  if (Status status = CheckJsonDepth(*bytes); !status.ok()) return std::move(status).At({path});
  BenchJsonValue document = BenchJsonValue::parse(bytes->begin(), bytes->end(), nullptr, false);
  if (!document.is_object() || document.value("schema", BenchJsonValue()) != "kpsa.bench/1")
    return Status::Invalid("is not what kpsa bench --json prints").At({path});
  std::vector<BenchJsonValue> sides;
  BenchJsonValue beside = BenchJsonValue::array();
  if (document.contains("beside")) beside = std::move(document["beside"]);
  document.erase("beside");
  sides.push_back(std::move(document));
  for (BenchJsonValue& side : beside) sides.push_back(std::move(side));
  try {
    for (const BenchJsonValue& side : sides) {
      if (const Status status = CheckSide(side); !status.ok()) return Status(status).At({path});
    }
  } catch (const BenchJsonValue::exception& error) {
    return Status::Invalid("is no bench of this version: {}", error.what()).At({path});
  }
  return sides;
}

std::string NameOf(const BenchJsonValue& side) {
  return std::filesystem::path(side.at("rig").get<std::string>()).stem().string();
}

std::string ModeOf(const BenchJsonValue& side) {
  const bool paper = side.at("mode") == "paper";
  std::string text = paper ? "paper mode" : "default";
  if (side.at("tolerance").get<double>() >= kAnyError) text += ", all frames accepted";
  return text;
}

std::string MeasuredOf(const BenchJsonValue& side) {
  const auto points = side.at("cue_points").get<std::uint64_t>(), cues = side.at("cues").get<std::uint64_t>();
  std::string text = side.at("mode") == "paper" ? Plural(points, "key point") : Plural(points, "point");
  if (cues > points) text += ", " + Plural(cues - points, "scalar");
  return text;
}

double NumberAt(const BenchJsonValue& side, const char* pointer) {
  const BenchJsonValue& value = side.at(BenchJsonValue::json_pointer(pointer));
  return value.is_number() ? value.get<double>() : NAN;
}

// "0.0123 %" of the diagonal: two significant digits and more.
std::string ShareOf(const BenchJsonValue& side, double length) {
  const double share = length < 0 ? NAN : 100 * length / NumberAt(side, "/error/bbox_diagonal");
  return std::isfinite(share) ? fmt::format("{:.{}f} %", share,
                                            share >= 0.1    ? 2
                                            : share >= 0.01 ? 3
                                                            : 4)
                              : "-";
}

std::string Microseconds(double ms) { return fmt::format("{:.1f}", 1e3 * ms); }

}  // namespace

Result<std::string> BenchTables(const std::vector<BenchDocument>& documents) {
  Table reached({"character", ">points", "mode", "measured", ">modes", ">hits", ">speedup of hits",
                 ">of all frames", ">the reference", ">ceiling", ">RMS", ">max", ">tolerance"});
  Table costs({"character", "mode", ">full, ns a point", ">full, us", ">accelerated, us", ">graph", ">cues",
               ">projection", ">reconstruction", ">later stages", ">misses", ">bytes a point"});
  Table split(
      {"character", "mode", ">projection", ">cueing", ">storage", ">total", ">with SoftCache", ">misses"});
  for (const BenchDocument& document : documents) {
    const Result<std::vector<BenchJsonValue>> sides = ReadSides(document.path);
    if (!sides.ok()) return sides.status();
    try {
      for (const BenchJsonValue& side : *sides) {
        const bool paper = side.at("mode") == "paper";
        const double tolerance = NumberAt(side, "/tolerance");
        reached.Row({NameOf(side), Thousands(side.at("points").get<std::uint64_t>()), ModeOf(side),
                     MeasuredOf(side), std::to_string(side.at("modes").get<std::uint64_t>()),
                     fmt::format("{:.1f} %", 100 * NumberAt(side, "/hit_rate")),
                     RatioText(NumberAt(side, "/speedup_on_hits")), RatioText(NumberAt(side, "/speedup")),
                     paper ? document.reference : "", RatioText(NumberAt(side, "/ceiling/speedup")),
                     ShareOf(side, NumberAt(side, "/error/rms")), ShareOf(side, NumberAt(side, "/error/max")),
                     tolerance >= kAnyError ? "any" : LengthText(tolerance)});
        const double accelerated = NumberAt(side, "/accelerated/ms_per_frame");
        std::vector<std::string> row = {
            NameOf(side), ModeOf(side), fmt::format("{:.1f}", NumberAt(side, "/full/ns_per_point")),
            Microseconds(NumberAt(side, "/full/ms_per_frame")), Microseconds(accelerated)};
        for (const char* part : {"graph", "cues", "projection", "reconstruction", "downstream", "misses"})
          row.push_back(Microseconds(NumberAt(side, (std::string("/accelerated/") + part).c_str())));
        row.push_back(fmt::format("{:.0f}", NumberAt(side, "/storage/bytes_per_point")));
        costs.Row(std::move(row));
        if (side.at("frame_errors").is_null() || IsRepeated(side, *sides)) continue;
        row = {NameOf(side), ModeOf(side)};
        for (const char* part : {"projection", "cueing", "storage", "total", "soft_cache"})
          row.push_back(ShareOf(side, NumberAt(side, (std::string("/frame_errors/rms/") + part).c_str())));
        row.push_back(fmt::format("{:.1f} %", 100 - 100 * NumberAt(side, "/hit_rate")));
        split.Row(std::move(row));
      }
    } catch (const BenchJsonValue::exception& error) {
      return Status::Invalid("is no bench of this version: {}", error.what()).At({document.path});
    }
  }
  std::string text = reached.Markdown() + "\n" + costs.Markdown();
  if (!split.empty()) text += "\n" + split.Markdown();
  return text;
}

Result<std::vector<LinePlot>> BenchPlots(const std::string& path) {
  const Result<std::vector<BenchJsonValue>> sides = ReadSides(path);
  if (!sides.ok()) return sides.status();
  std::vector<LinePlot> plots;
  try {
    for (const BenchJsonValue& side : *sides) {
      const BenchJsonValue& errors = side.at("frame_errors");
      if (errors.is_null() || IsRepeated(side, *sides)) continue;
      const double percent = 100 / NumberAt(side, "/error/bbox_diagonal");
      const auto line = [&](const char* name, const char* key, const char* color) {
        PlotLine one{name, color, {}};
        for (const BenchJsonValue& value : errors.at(key))
          one.y.push_back(value.is_number() ? percent * value.get<double>() : NAN);
        return one;
      };
      const std::string title =
          fmt::format("{}, {}, {}", NameOf(side), side.at("mode") == "paper" ? "paper mode" : "default",
                      MeasuredOf(side));
      LinePlot parts{title + ": KPSA", "frame", "RMS error, % of the diagonal", {}, "", {}};
      parts.lines = {line("projection", "projection", "#2f7fd0"), line("cueing", "cueing", "#e09020"),
                     line("total", "total", "#303030")};
      LinePlot cached{title + ": SoftCache", "frame", "RMS error, % of the diagonal", {}, "", {}};
      cached.lines = {line("error with SoftCache", "soft_cache", "#208050")};
      cached.marks_name = "misses";
      for (std::size_t f = 0; f < errors.at("hit").size(); ++f) {
        if (!errors.at("hit")[f].get<bool>()) cached.marks.push_back(f);
      }
      plots.push_back(std::move(parts));
      plots.push_back(std::move(cached));
    }
  } catch (const BenchJsonValue::exception& error) {
    return Status::Invalid("is no bench of this version: {}", error.what()).At({path});
  }
  if (plots.empty())
    return Status::Invalid("has no errors by frame: kpsa train --keep-modes keeps what they need").At({path});
  return plots;
}

}  // namespace kpsa
