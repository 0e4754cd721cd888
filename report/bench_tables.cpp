#include "report/bench_tables.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "base/text.h"
#include "files/file.h"
#include "files/json_depth.h"
#include "kpsa/kpsa_node.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

using BenchJsonValue = nlohmann::json;

constexpr std::uint64_t kMostBytes = 1u << 28;
constexpr double kLeastShare = 0.02;  // of the full evaluation, of a node type that is named

// What kpsa bench does not write; caught where a document is read.
struct Refusal {
  Status status;
};

// A value as kpsa bench writes it: a number that is sound, or null where there is none. Throws Refusal.
template <typename Sound>
const BenchJsonValue& ValueAt(const BenchJsonValue& side, const char* pointer, const char* expected,
                              const Sound& sound) {
  const BenchJsonValue& value = side.at(BenchJsonValue::json_pointer(pointer));
  if (value.is_null() || (value.is_number() && sound(value.get<double>()))) return value;
  throw Refusal{Status::Invalid("{} is {}, expected {}", pointer,
                                value.is_number() ? value.dump() : value.type_name(), expected)};
}

double NumberOrNan(const BenchJsonValue& value) { return value.is_null() ? NAN : value.get<double>(); }

double NumberAt(const BenchJsonValue& side, const char* pointer) {
  return NumberOrNan(ValueAt(side, pointer, "a number from 0 on", [](double value) { return value >= 0; }));
}

double ShareAt(const BenchJsonValue& side, const char* pointer) {
  return NumberOrNan(
      ValueAt(side, pointer, "a share from 0 to 1", [](double value) { return value >= 0 && value <= 1; }));
}

// -1: of what is not finite.
double ErrorAt(const BenchJsonValue& side, const char* pointer) {
  return NumberOrNan(ValueAt(side, pointer, "a number from 0 on, or -1",
                             [](double value) { return value >= 0 || value == -1; }));
}

// These two are never null.
std::uint64_t CountAt(const BenchJsonValue& side, const char* pointer) {
  const auto whole = [](double value) { return value >= 0 && value < 1e15 && value == std::floor(value); };
  return ValueAt(side, pointer, "a whole number from 0 on", whole).get<std::uint64_t>();
}

double ToleranceOf(const BenchJsonValue& side) {
  return ValueAt(side, "/tolerance", "a number from 0 on", [](double value) { return value >= 0; })
      .get<double>();
}

// A side that accepts every frame, beside one with the same subspace that does not: their reconstructions are
// the same.
bool IsRepeated(const BenchJsonValue& side, const std::vector<BenchJsonValue>& sides) {
  if (ToleranceOf(side) < kAnyError) return false;
  const auto subspace = side.at("subspace").get<std::string>();
  return std::any_of(sides.begin(), sides.end(), [&](const BenchJsonValue& other) {
    return other.at("subspace").get<std::string>() == subspace && ToleranceOf(other) < kAnyError;
  });
}

// A cell of a table of commas (RFC 4180).
std::string CsvText(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}
std::string CsvNumber(double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; }

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
  return sides;
}

std::string NameOf(const BenchJsonValue& side) {
  return std::filesystem::path(side.at("rig").get<std::string>()).stem().string();
}

std::string ModeOf(const BenchJsonValue& side) {
  const bool paper = side.at("mode") == "paper";
  std::string text = paper ? "paper mode" : "default";
  if (ToleranceOf(side) >= kAnyError) text += ", all frames accepted";
  return text;
}

// The mode and the tolerance that tells sides of the same mode apart.
std::string SideOf(const BenchJsonValue& side) {
  const double tolerance = ToleranceOf(side);
  return ModeOf(side) + (tolerance >= kAnyError ? "" : ", " + LengthText(tolerance));
}

// What the full evaluation spends its time on, by node type: "61 % proximityWrap (3), 14 % bend (2), others".
std::string FullSpentOf(const BenchJsonValue& side) {
  std::map<std::string, std::pair<double, int>> of_type;  // ms, nodes
  double all = 0;
  for (const BenchJsonValue& node : side.at("full").at("nodes")) {
    auto& [ms, nodes] = of_type[node.at("type").get<std::string>()];
    const double own = NumberAt(node, "/ms_per_frame");
    ms += own, ++nodes;
    all += own;
  }
  if (!(all > 0 && std::isfinite(all))) return "-";
  std::vector<std::pair<double, std::string>> spent;  // sorted by time, then name
  for (const auto& [type, times] : of_type) {
    if (times.first >= kLeastShare * all)
      spent.emplace_back(-times.first,
                         fmt::format("{:.0f} % {} ({})", 100 * times.first / all, type, times.second));
  }
  std::sort(spent.begin(), spent.end());
  std::string text;
  for (const auto& [ms, words] : spent) text += (text.empty() ? "" : ", ") + words;
  return text + (spent.size() < of_type.size() ? ", others" : "");
}

std::string MeasuredOf(const BenchJsonValue& side) {
  const std::uint64_t points = CountAt(side, "/cue_points"), cues = CountAt(side, "/cues");
  std::string text = side.at("mode") == "paper" ? Plural(points, "key point") : Plural(points, "point");
  if (cues > points) text += ", " + Plural(cues - points, "scalar");
  return text;
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

// Misses reconstruct nothing, so it is known where all frames hit.
std::string CeilingWithReconstruction(const BenchJsonValue& side) {
  if (ShareAt(side, "/hit_rate") < 1) return "";
  const double ms = NumberAt(side, "/ceiling/ms_per_frame") + NumberAt(side, "/accelerated/reconstruction");
  return RatioText(ms > 0 ? NumberAt(side, "/full/ms_per_frame") / ms : NAN);
}

// Of the full cost, in deformers that are off together within the tolerance; "" where it was not measured.
bool HasIdle(const BenchJsonValue& side) { return side.contains("idle") && !side.at("idle").is_null(); }

std::string IdleShareOf(const BenchJsonValue& side) {
  return HasIdle(side) ? fmt::format("{:.0f} %", 100 * ShareAt(side, "/idle/share")) : "";
}

// The first side that measured them: "hoodTop:mod, tail:mod and 3 more within 0.4 mm".
std::string IdleNamesOf(const std::vector<BenchJsonValue>& sides) {
  constexpr std::size_t kNamed = 6;
  const auto side = std::find_if(sides.begin(), sides.end(), HasIdle);
  if (side == sides.end()) return "-";
  std::string text;
  std::size_t off = 0;
  for (const BenchJsonValue& deformer : side->at("idle").at("deformers")) {
    if (!deformer.at("off").get<bool>() || ++off > kNamed) continue;
    text += (text.empty() ? "" : ", ") + deformer.at("name").get<std::string>();
  }
  if (off == 0) return "none";
  if (off > kNamed) text += fmt::format(" and {} more", off - kNamed);
  return fmt::format("{} ({} together)", text, LengthText(NumberAt(*side, "/idle/difference")));
}

std::string Microseconds(double ms) { return fmt::format("{:.1f}", 1e3 * ms); }

}  // namespace

Result<std::string> BenchTables(const std::vector<BenchDocument>& documents, bool with_any) {
  Table reached({"character", ">points", "mode", "measured", ">modes", ">hits", ">speedup of hits",
                 ">of all frames", ">the reference", ">ceiling", ">with reconstruction", ">RMS", ">max",
                 ">tolerance", ">full cost within it"});
  Table costs({"character", "mode", ">full, ns a point", ">full, us", ">accelerated, us", ">graph", ">cues",
               ">projection", ">reconstruction", ">later stages", ">misses", ">bytes a point"});
  Table spent({"character", ">full, us", "of which", "deformers within the tolerance"});
  Table split({"character", "mode", ">projection", ">cueing", ">storage", ">total", ">with SoftCache",
               ">blends", ">misses"});
  for (const BenchDocument& document : documents) {
    const Result<std::vector<BenchJsonValue>> sides = ReadSides(document.path);
    if (!sides.ok()) return sides.status();
    try {
      spent.Row({NameOf(sides->front()), Microseconds(NumberAt(sides->front(), "/full/ms_per_frame")),
                 FullSpentOf(sides->front()), IdleNamesOf(*sides)});
      for (const BenchJsonValue& side : *sides) {
        const bool paper = side.at("mode") == "paper";
        const double tolerance = ToleranceOf(side);
        if (!with_any && tolerance >= kAnyError) continue;
        reached.Row({NameOf(side), Thousands(CountAt(side, "/points")), ModeOf(side), MeasuredOf(side),
                     std::to_string(CountAt(side, "/modes")),
                     fmt::format("{:.1f} %", 100 * ShareAt(side, "/hit_rate")),
                     RatioText(NumberAt(side, "/speedup_on_hits")), RatioText(NumberAt(side, "/speedup")),
                     paper ? document.reference : "", RatioText(NumberAt(side, "/ceiling/speedup")),
                     CeilingWithReconstruction(side), ShareOf(side, ErrorAt(side, "/error/rms")),
                     ShareOf(side, ErrorAt(side, "/error/max")),
                     tolerance >= kAnyError ? "any" : LengthText(tolerance), IdleShareOf(side)});
        const double accelerated = NumberAt(side, "/accelerated/ms_per_frame");
        std::vector<std::string> row = {
            NameOf(side), SideOf(side), fmt::format("{:.1f}", NumberAt(side, "/full/ns_per_point")),
            Microseconds(NumberAt(side, "/full/ms_per_frame")), Microseconds(accelerated)};
        for (const char* part : {"graph", "cues", "projection", "reconstruction", "downstream", "misses"})
          row.push_back(Microseconds(NumberAt(side, (std::string("/accelerated/") + part).c_str())));
        row.push_back(fmt::format("{:.0f}", NumberAt(side, "/storage/bytes_per_point")));
        costs.Row(std::move(row));
        if (side.at("frame_errors").is_null()) continue;
        row = {NameOf(side), SideOf(side)};
        for (const char* part : {"projection", "cueing", "storage", "total", "soft_cache"})
          row.push_back(ShareOf(side, NumberAt(side, (std::string("/frame_errors/rms/") + part).c_str())));
        const double blends = ShareAt(side, "/blend_rate");
        row.push_back(fmt::format("{:.1f} %", 100 * blends));
        row.push_back(fmt::format("{:.1f} %", 100 * std::max(0.0, 1 - ShareAt(side, "/hit_rate") - blends)));
        if (!IsRepeated(side, *sides)) split.Row(std::move(row));
      }
    } catch (const Refusal& refusal) {
      return Status(refusal.status).At({document.path});
    } catch (const BenchJsonValue::exception& error) {
      return Status::Invalid("is no bench of this version: {}", error.what()).At({document.path});
    }
  }
  std::string text = reached.Markdown() + "\n" + costs.Markdown() + "\n" + spent.Markdown();
  if (!split.empty()) text += "\n" + split.Markdown();
  return text;
}

Result<std::string> BenchFrames(const std::vector<std::string>& paths) {
  std::string text =
      "rig,mode,measured,tolerance,clip,frame,verdict,full_weight,score,rms,max,full_ms,accelerated_ms,"
      "projection,cueing,storage,total\n";
  for (const std::string& path : paths) {
    const Result<std::vector<BenchJsonValue>> sides = ReadSides(path);
    if (!sides.ok()) return sides.status();
    try {
      for (const BenchJsonValue& side : *sides) {
        const double tolerance = ToleranceOf(side);
        const std::string start =
            fmt::format("{},{},{},{},", CsvText(NameOf(side)), CsvText(ModeOf(side)),
                        CsvText(MeasuredOf(side)), tolerance >= kAnyError ? "any" : CsvNumber(tolerance));
        const BenchJsonValue &frames = side.at("per_frame"), &errors = side.at("frame_errors");
        for (std::size_t f = 0; f < frames.size(); ++f) {
          text += start + CsvText(frames[f].at("clip").get<std::string>());
          text += fmt::format(",{},{}", CountAt(frames[f], "/frame"),
                              CsvText(frames[f].at("verdict").get<std::string>()));
          for (const char* key : {"full_weight", "score", "rms", "max", "full_ms", "accelerated_ms"})
            text += "," + CsvNumber(NumberOrNan(frames[f].at(key)));
          for (const char* key : {"projection", "cueing", "storage", "total"})
            text += "," + (errors.is_null() ? "" : CsvNumber(NumberOrNan(errors.at(key).at(f))));
          text += '\n';
        }
      }
    } catch (const Refusal& refusal) {
      return Status(refusal.status).At({path});
    } catch (const BenchJsonValue::exception& error) {
      return Status::Invalid("is no bench of this version: {}", error.what()).At({path});
    }
  }
  return text;
}

}  // namespace kpsa::engine
