// Tolerance tables as text and as JSON, and what they advise.
#pragma once

#include <cmath>
#include <string>
#include <utility>

#include "host/bench/tolerance_table.h"

namespace kpsa::engine {

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

}  // namespace kpsa::engine
