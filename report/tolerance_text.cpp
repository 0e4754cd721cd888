#include "report/tolerance_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/quantity_text.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

constexpr double kEnoughHits = 0.95, kFewHits = 0.5;
constexpr double kMuchFaster = 1.5, kNearlyMost = 0.9;

std::string Percent(double share) { return fmt::format("{:.1f} %", 100 * share); }

std::string SpeedupText(const ReachedSpeedup& r, const ToleranceWords& words) {
  std::string text = fmt::format("--speedup {:g}: ", r.wanted);
  const std::string tolerance = ErrorText(r.row.tolerance, words.light);
  if (std::isnan(r.row.speedup)) return text + "nothing was timed, so nothing is known of it\n";
  if (!r.reached)
    return text + fmt::format("no tolerance reaches it; the most is {}, from {} on\n",
                              RatioText(r.row.speedup), tolerance);
  return text + fmt::format("{}, where {} of {} hit ({}); set `tolerance: {}` and train, or --tolerance\n",
                            tolerance, Percent(r.row.hits), words.of, RatioText(r.row.speedup), tolerance);
}

}  // namespace

std::string ToleranceAdvice(const ToleranceTable& table, const ToleranceWords& words) {
  if (table.rows.empty()) return "";
  const ToleranceRow& now = table.rows[table.in_force];
  if (now.hits >= kEnoughHits) return "";
  if (table.rows.back().hits < kFewHits)
    return fmt::format("fewer than half of the {} hit at any tolerance here: {}", words.of, words.where_few);
  double most = 0;
  for (const ToleranceRow& row : table.rows) most = std::max(most, row.speedup);
  for (std::size_t r = table.in_force + 1; r < table.rows.size(); ++r) {
    const ToleranceRow& row = table.rows[r];
    if (!(row.speedup > 1 && row.speedup >= kMuchFaster * now.speedup && row.speedup >= kNearlyMost * most))
      continue;
    return fmt::format("at {} (accelerate: tolerance) {:.0f} % of {} would hit: {} instead of {}",
                       ErrorText(row.tolerance, words.light), 100 * row.hits, words.of,
                       RatioText(row.speedup), RatioText(now.speedup));
  }
  return "";
}

std::string ToleranceText(const ToleranceTable& table, const ToleranceWords& words) {
  if (table.rows.empty()) return "";
  const bool errors = std::any_of(table.rows.begin(), table.rows.end(),
                                  [](const ToleranceRow& row) { return std::isfinite(row.worst); });
  std::vector<std::string> headers{">tolerance", ">" + words.of + " that hit", ">speedup with misses"};
  if (errors) headers.emplace_back(">worst accepted, of it");
  headers.emplace_back("");
  Table shown(headers);
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const ToleranceRow& row = table.rows[r];
    std::vector<std::string> cells{ErrorText(row.tolerance, words.light), Percent(row.hits),
                                   RatioText(row.speedup)};
    if (errors) cells.push_back(std::isfinite(row.worst) ? fmt::format("{:.2f}", row.worst) : "-");
    if (r == table.in_force) cells.emplace_back("in force");
    shown.Row(std::move(cells));
  }
  std::string text = shown.Text();
  if (const std::string advice = ToleranceAdvice(table, words); !advice.empty()) text += advice + "\n";
  if (table.reached.has_value()) text += SpeedupText(*table.reached, words);
  return text;
}

}  // namespace kpsa::engine
