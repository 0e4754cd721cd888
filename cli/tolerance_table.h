// What other tolerances would give: how many poses or frames hit, and how fast that is.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "kpsa/calibration.h"

namespace kpsa::engine {

// What is expected at a tolerance, in scene units (of light a number).
struct ToleranceRow {
  double tolerance = 0;
  double hits = 0;                                            // share
  double speedup = std::numeric_limits<double>::quiet_NaN();  // misses included; NaN: nothing was timed
  double worst = std::numeric_limits<double>::quiet_NaN();    // error that is accepted, in tolerances; NaN:
                                                              // not known
};
// Hits must not fall as the tolerance grows, nor must speedup, but for the 1 of tolerances that allow no hit.
using ToleranceModel = std::function<ToleranceRow(double tolerance)>;

// The smallest tolerance of a fine grid (two digits, steps of at most 10 %) that reaches a speedup.
struct ReachedSpeedup {
  double wanted = 0;
  bool reached = false;
  ToleranceRow row;  // that one; or the smallest with the largest speedup
};

struct ToleranceTable {
  std::vector<ToleranceRow> rows;  // ascending; none where the tolerance in force is 0 or any
  std::size_t in_force = 0;
  std::optional<ReachedSpeedup> reached;  // where a speedup is wanted
};

// Round numbers from a quarter of a tolerance to eight times it, and itself; none for 0 or for any.
std::vector<double> TolerancesAround(double tolerance);
// wanted_speedup 0: none. largest: from there on nothing changes.
ToleranceTable MakeToleranceTable(double in_force, double largest, double wanted_speedup,
                                  const ToleranceModel& model);

// Of pairs that a tolerance can accept; 0 of none.
double LargestError(std::span<const CalibrationPair> pairs);

// "--speedup 10" as a number. Errors: none above 0.
Result<double> ParseSpeedup(const std::string& text);

struct ToleranceWords {
  std::string of = "poses";  // what hits
  std::string where_few;     // what helps where fewer than half hit at any tolerance
  bool light = false;
};
// The table, what to change, and what --speedup asked for; "" of an empty one.
std::string ToleranceText(const ToleranceTable& table, const ToleranceWords& words);
// What to change: a sentence, or "" where nothing in the table is much better.
std::string ToleranceAdvice(const ToleranceTable& table, const ToleranceWords& words);

// JSON objects of any type that is made as nlohmann's are; what is not known is null, or left out.
template <typename Json>
Json ToleranceRowJson(const ToleranceRow& row) {
  Json json = {{"tolerance", row.tolerance}, {"hit_rate", row.hits}, {"speedup", Json()}};
  if (std::isfinite(row.speedup)) json["speedup"] = row.speedup;
  if (std::isfinite(row.worst)) json["worst_accepted"] = row.worst;
  return json;
}
template <typename Json>
Json ToleranceJson(const ToleranceTable& table, const ToleranceWords& words) {
  Json rows = Json::array(), wanted;
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    rows.push_back(ToleranceRowJson<Json>(table.rows[r]));
    rows.back()["in_force"] = r == table.in_force;
  }
  if (table.reached.has_value()) {
    wanted = ToleranceRowJson<Json>(table.reached->row);
    wanted["wanted"] = table.reached->wanted;
    wanted["reached"] = table.reached->reached;
  }
  return {{"rows", std::move(rows)},
          {"advice", ToleranceAdvice(table, words)},
          {"wanted_speedup", std::move(wanted)}};
}

// full / (accelerated + the share of misses * what one adds, of a full evaluation): a miss costs both, or a
// part where parts miss by themselves; NaN where it is not known. 1 where nothing is ever a hit: then nothing
// is measured.
double SpeedupWithMisses(double full_ms, double accelerated_ms, double hits, bool ever_hits = true,
                         double miss = 1);

}  // namespace kpsa::engine
