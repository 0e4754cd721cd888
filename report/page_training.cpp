#include "report/page_training.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/quantity_text.h"
#include "kpsa/kpsa_node.h"
#include "kpsa/pose_kind.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

std::string Taken(bool taken) { return taken ? "yes" : ""; }

PageTable Tried(const TrainingRecord& record, const std::string& of) {
  PageTable table("What training tried" + of,
                  "misses: of held-out poses; cost: of a frame as expected, misses included",
                  {{"tried"}, {"cues"}, {"rows"}, {"misses", "%"}, {"cost", "% of full"}, {"taken"}});
  for (const TrainingRecord::Tried& tried : record.tried) {
    table.Row({tried.what, CountCell(tried.cues), CountCell(tried.rows), PercentCell(tried.misses),
               PercentCell(tried.cost), Taken(tried.taken)});
  }
  return table;
}

PageTable Rules(const TrainingRecord& record, const std::string& of) {
  PageTable table("How training chose what misses" + of, "cost: of a frame, besides that of measured points",
                  {{"rule"}, {"misses", "%"}, {"cost", "% of full"}, {"taken"}});
  for (const TrainingRecord::Rule& rule : record.rules)
    table.Row({rule.what, PercentCell(rule.misses), PercentCell(rule.cost), Taken(rule.taken)});
  return table;
}

PageTable Kinds(const AppliedSubspace& one, const std::string& of) {
  const Calibration calibration = CalibrationInForce(one);
  PageTable table(
      "Calibration" + of,
      fmt::format("held-out poses at {}; of the poses of a kind, at most {:.3g} % may be accepted beyond it",
                  ErrorText(one.tolerance, one.subspace->of_light()), 100 * calibration.alpha),
      {{"kind of pose"},
       {"poses"},
       {"hits", "%"},
       {"accepted", "%"},
       {"beyond"},
       {"at most, 9 in 10 times", "%"}});
  if (one.tolerance >= kAnyError || one.tolerance <= 0) return table;
  for (const Calibration::Kind& kind : calibration.kinds) {
    table.Row({PoseKindName(static_cast<PoseKind>(kind.kind)), CountCell(kind.poses),
               PercentCell(PartOf(kind.hits, kind.poses)), PercentCell(PartOf(kind.accepted, kind.poses)),
               CountCell(kind.violations), PercentCell(kind.upper_bound)});
  }
  return table;
}

}  // namespace

std::vector<PageTable> TrainingTables(const std::vector<AppliedSubspace>& applied) {
  std::vector<PageTable> tables;
  for (const AppliedSubspace& one : applied) {
    const std::string of = applied.size() > 1 ? " of " + one.name : "";
    const TrainingRecord record = ParseTraining(one.subspace->training);
    for (PageTable table : {Tried(record, of), Rules(record, of), Kinds(one, of)}) {
      if (!table.empty()) tables.push_back(std::move(table));
    }
  }
  return tables;
}

}  // namespace kpsa::engine
