#include "host/bench/tolerance_table.h"

#include <algorithm>
#include <cmath>

#include "kpsa/kpsa_node.h"

namespace kpsa::engine {
namespace {

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

}  // namespace kpsa::engine
