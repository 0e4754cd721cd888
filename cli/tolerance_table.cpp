#include "cli/tolerance_table.h"

#include <algorithm>
#include <cmath>

#include "cli/common.h"
#include "files/quantity.h"
#include "kpsa/kpsa_node.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

constexpr double kEnoughHits = 0.95, kFewHits = 0.5;
constexpr double kMuchFaster = 1.5, kNearlyMost = 0.9;

// A decade of round numbers, in tenths.
constexpr int kRound[] = {10, 12, 15, 20, 25, 30, 40, 50, 60, 80};
constexpr int kFine[] = {10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 22, 24, 26, 28, 30, 32, 34,
                         36, 38, 40, 42, 44, 46, 48, 50, 55, 60, 65, 70, 75, 80, 85, 90, 95};
constexpr int kFineSteps = static_cast<int>(std::size(kFine));

// tenths * 10^(decade - 1), rounded once.
double Decimal(int tenths, int decade) {
  return decade >= 1 ? tenths * std::pow(10.0, decade - 1) : tenths / std::pow(10.0, 1 - decade);
}

double Rounded(double value) {
  const int decade = static_cast<int>(std::floor(std::log10(value)));
  double best = Decimal(10, decade + 1);
  for (int tenths : kRound) {
    const double candidate = Decimal(tenths, decade);
    if (std::abs(std::log(candidate / value)) < std::abs(std::log(best / value))) best = candidate;
  }
  return best;
}

double OnGrid(int step) {
  const int decade = static_cast<int>(std::floor(static_cast<double>(step) / kFineSteps));
  return Decimal(kFine[step - decade * kFineSteps], decade);
}

// The first of the grid that is not below a value.
int StepAt(double value) {
  int step = static_cast<int>(std::floor(std::log10(value))) * kFineSteps;
  while (OnGrid(step) < value * (1 - 1e-9)) ++step;
  return step;
}

ReachedSpeedup Reach(double wanted, double in_force, double largest, const ToleranceModel& model) {
  constexpr double kSmallest = 1e-3;  // of the tolerance in force
  int low = StepAt(kSmallest * in_force), high = std::max(low, StepAt(std::max(largest, in_force)));
  ReachedSpeedup result{wanted, false, model(OnGrid(high))};
  result.reached = result.row.speedup >= wanted;
  if (std::isnan(result.row.speedup)) return result;
  const double least = result.reached ? wanted : result.row.speedup;
  if (const ToleranceRow row = model(OnGrid(low)); row.speedup >= least) {
    result.reached = row.speedup >= wanted, result.row = row;
    return result;
  }
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (const ToleranceRow row = model(OnGrid(middle)); row.speedup >= least) {
      high = middle, result.row = row;
    } else {
      low = middle + 1;
    }
  }
  return result;
}

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

std::vector<double> TolerancesAround(double tolerance) {
  if (!(tolerance > 0) || tolerance >= kAnyError) return {};
  std::vector<double> tolerances{tolerance};
  for (const double factor : {0.25, 0.5, 1.5, 2.0, 4.0, 8.0}) {
    const double rounded = Rounded(factor * tolerance);
    if (std::none_of(tolerances.begin(), tolerances.end(),
                     [&](double other) { return std::abs(other - rounded) < 0.01 * rounded; }))
      tolerances.push_back(rounded);
  }
  std::sort(tolerances.begin(), tolerances.end());
  return tolerances;
}

ToleranceTable MakeToleranceTable(double in_force, double largest, double wanted_speedup,
                                  const ToleranceModel& model) {
  ToleranceTable table;
  for (const double tolerance : TolerancesAround(in_force)) {
    if (tolerance == in_force) table.in_force = table.rows.size();
    table.rows.push_back(model(tolerance));
  }
  if (wanted_speedup > 0 && !table.rows.empty())
    table.reached = Reach(wanted_speedup, in_force, largest, model);
  return table;
}

double SpeedupWithMisses(double full_ms, double accelerated_ms, double hits, bool ever_hits, double miss) {
  if (!(full_ms > 0 && accelerated_ms > 0)) return std::numeric_limits<double>::quiet_NaN();
  return ever_hits ? full_ms / (accelerated_ms + (1 - hits) * miss * full_ms) : 1;
}

double LargestError(std::span<const CalibrationPair> pairs) {
  double largest = 0;
  for (const CalibrationPair& pair : pairs) {
    if (std::isfinite(pair.error)) largest = std::max(largest, pair.error);
  }
  return largest;
}

Result<double> ParseSpeedup(const std::string& text) {
  const Result<double> value = ParseQuantity(text, Unit::kNone, FileUnits());
  if (!value.ok() || !(*value > 0))
    return Status::Usage("--speedup \"{}\": expected a number above 0, as in 10", text);
  return value;
}

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
