#include "bench/promise_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/common.h"
#include "kpsa/binomial.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

constexpr double kConfidence = 0.95;
constexpr double kRounding = 1 + 1e-6;  // of floats: forgiven
constexpr double kFar = 3;              // tolerances

double Share(std::size_t k, std::size_t n) {
  return n == 0 ? 0 : static_cast<double>(k) / static_cast<double>(n);
}

// "4.2 % [2.7, 6.1]": a two-sided interval.
std::string ShareText(std::size_t k, std::size_t n) {
  if (n == 0) return "-";
  const double one_sided = 1 - (1 - kConfidence) / 2;
  return fmt::format("{:.1f} % [{:.1f}, {:.1f}]", 100 * Share(k, n),
                     100 * BinomialLowerBound(k, n, one_sided), 100 * BinomialUpperBound(k, n, one_sided));
}

std::string ScaleText(const PromiseCase& of) {
  return fmt::format("{:g} = {}", of.scale, LengthText(of.tolerance));
}

Table RowTable(std::span<const PromiseRow> rows) {
  Table table({"rig", ">tolerance", ">seed", "poses of", ">poses", ">hits", ">blends", ">misses",
               ">violations", ">of hits", ">worst", ">beyond 3", ">promised", ""});
  for (const PromiseRow& row : rows) {
    table.Row({row.of.rig, ScaleText(row.of), fmt::format("{}", row.of.seed), TrialKindName(row.kind),
               fmt::format("{}", row.poses), fmt::format("{}", row.hits), fmt::format("{}", row.blends),
               fmt::format("{}", row.misses), ShareText(row.violations, row.poses),
               ShareText(row.hit_violations, row.hits), fmt::format("{:.2f}", row.worst),
               fmt::format("{:.1f} %", 100 * Share(row.far, row.poses)),
               fmt::format("{:g} %", 100 * row.of.promised), row.broken() ? "BROKEN" : ""});
  }
  return table;
}

Table WalkTable(std::span<const WalkRow> walks) {
  Table table({"rig", ">tolerance", ">seed", ">walks", ">accepted", ">largest jump", "of"});
  for (const WalkRow& row : walks) {
    table.Row({row.of.rig, ScaleText(row.of), fmt::format("{}", row.of.seed), fmt::format("{}", row.walks),
               fmt::format("{}", row.accepted), row.accepted == 0 ? "-" : fmt::format("{:.2f}", row.jump),
               row.control});
  }
  return table;
}

bool SameTolerance(const PromiseCase& a, const PromiseCase& b) {
  return a.rig == b.rig && a.scale == b.scale;
}

// Of one rig at one tolerance: violations by kind, bold where a seed's row is broken; hits of the first kind;
// the worst of all.
Table Summary(std::span<const PromiseRow> rows, std::span<const WalkRow> walks) {
  std::vector<std::string> headers{"rig", ">tolerance", ">promised", ">hits"};
  for (const TrialKind kind : kTrialKinds) headers.push_back(fmt::format(">{}", TrialKindName(kind)));
  headers.insert(headers.end(), {">worst error", ">largest jump", "broken"});
  Table table(headers);
  for (std::size_t first = 0; first < rows.size();) {
    std::size_t end = first;
    while (end < rows.size() && SameTolerance(rows[end].of, rows[first].of)) ++end;
    const std::span<const PromiseRow> mine = rows.subspan(first, end - first);
    first = end;
    std::vector<std::string> cells{mine[0].of.rig, ScaleText(mine[0].of),
                                   fmt::format("{:g} %", 100 * mine[0].of.promised)};
    std::size_t broken = 0, accepted = 0;
    double worst = 0, jump = 0;
    for (const TrialKind kind : kTrialKinds) {
      std::size_t poses = 0, hits = 0, violations = 0;
      bool breaks = false;
      for (const PromiseRow& row : mine) {
        if (row.kind != kind) continue;
        poses += row.poses, hits += row.hits, violations += row.violations;
        breaks = breaks || row.broken();
        broken += row.broken();
        worst = std::max(worst, row.worst);
      }
      if (kind == TrialKind::kSampler) cells.push_back(fmt::format("{:.0f} %", 100 * Share(hits, poses)));
      const std::string share = poses == 0 ? "-" : fmt::format("{:.1f} %", 100 * Share(violations, poses));
      cells.push_back(breaks ? fmt::format("**{}**", share) : share);
    }
    for (const WalkRow& walk : walks) {
      if (!SameTolerance(walk.of, mine[0].of)) continue;
      jump = std::max(jump, walk.jump);
      accepted += walk.accepted;
    }
    cells.insert(cells.end(),
                 {fmt::format("{:.1f}", worst), accepted == 0 ? "-" : fmt::format("{:.1f}", jump),
                  broken == 0 ? "" : fmt::format("{} of {}", broken, mine.size())});
    table.Row(cells);
  }
  return table;
}

}  // namespace

bool PromiseRow::broken() const {
  return BinomialLowerBound(violations, poses, kConfidence) > of.promised ||
         BinomialLowerBound(hit_violations, hits, kConfidence) > kShareOfHits * of.promised;
}

PromiseRow CountOutcomes(const PromiseCase& of, TrialKind kind, std::span<const PromiseOutcome> outcomes) {
  PromiseRow row;
  row.of = of;
  row.kind = kind;
  row.poses = outcomes.size();
  for (const PromiseOutcome& outcome : outcomes) {
    if (outcome.verdict == PromiseVerdict::kMiss) {
      ++row.misses;
      continue;
    }
    const bool hit = outcome.verdict == PromiseVerdict::kHit;
    const double error = outcome.error / of.tolerance;
    hit ? ++row.hits : ++row.blends;
    row.violations += error > kRounding;
    row.hit_violations += hit && error > kRounding;
    row.far += error > kFar;
    row.worst = std::max(row.worst, error);
  }
  return row;
}

std::string PromiseText(std::span<const PromiseRow> rows, std::span<const WalkRow> walks) {
  return RowTable(rows).Text() + "\n" + WalkTable(walks).Text();
}

std::string PromiseMarkdown(std::span<const PromiseRow> rows, std::span<const WalkRow> walks) {
  return Summary(rows, walks).Markdown() + "\n" + RowTable(rows).Markdown() + "\n" +
         WalkTable(walks).Markdown();
}

}  // namespace kpsa::engine
