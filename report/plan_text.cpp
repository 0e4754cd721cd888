#include "report/plan_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/quantity_text.h"
#include "base/text.h"
#include "graph/plan_report.h"
#include "report/json_text.h"
#include "report/table.h"

namespace kpsa::engine {
namespace {

// The steps of one node in one segment, as one row.
struct PlanRow {
  std::string name, type, segment, needed_by;
  Index points = 0, points_total = 0, steps = 0;
};

std::vector<PlanRow> RowsOf(const Plan& plan, bool each_step) {
  std::vector<PlanRow> rows;
  std::map<std::pair<std::string, Index>, std::size_t> by_name;
  for (Index s = 0; s < plan.steps().size(); ++s) {
    const Plan::StepInfo& info = plan.infos()[s];
    const std::string name = each_step ? StepName(plan, s) + fmt::format(" #{}", s) : plan.step_name(s);
    const auto [it, added] = by_name.emplace(std::make_pair(name, info.segment), rows.size());
    if (added)
      rows.push_back({each_step ? StepName(plan, s) : name, plan.step_type(s),
                      SegmentName(plan, info.segment), "", 0, 0, 0});
    PlanRow& row = rows[it->second];
    ++row.steps;
    if (info.points > row.points || row.points_total == 0)
      row.points = info.points, row.points_total = info.points_total;
    const std::string needed = NeededBy(plan, s);
    if (row.needed_by.empty() || needed.starts_with("the request")) row.needed_by = needed;
  }
  return rows;
}

// Of points and scratch.
std::size_t BytesOf(const Plan& plan) {
  return (plan.buffer_floats() + plan.workspace_floats()) * sizeof(float);
}

}  // namespace

std::string PlanJson(const Plan& plan, bool each_step) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array(), excluded = nodes, varying = nodes,
                         outputs = nodes;
  for (const PlanRow& row : RowsOf(plan, each_step)) {
    nodes.push_back({{"name", row.name},
                     {"type", row.type},
                     {"segment", row.segment},
                     {"points", row.points},
                     {"points_total", row.points_total},
                     {"steps", row.steps},
                     {"needed_by", row.needed_by}});
  }
  for (const Plan::Excluded& e : plan.excluded())
    excluded.push_back({{"name", e.node_name}, {"reason", e.reason}});
  for (const Plan::Varying& v : plan.varying()) varying.push_back(v.name);
  for (const Plan::Output& o : plan.outputs())
    outputs.push_back({{"name", o.name}, {"points", o.points.size()}, {"points_total", o.points.total()}});
  const nlohmann::ordered_json document{{"schema", "kpsa.compile/1"},
                                        {"steps", plan.steps().size()},
                                        {"segments", plan.segments().size()},
                                        {"buffer_bytes", BytesOf(plan)},
                                        {"outputs", outputs},
                                        {"varying", varying},
                                        {"nodes", nodes},
                                        {"excluded", excluded}};
  return JsonText(document);
}

std::string PlanText(const Plan& plan, bool each_step) {
  Table kept({"node", "type", ">points", ">of", "evaluated", "needed by"});
  for (const PlanRow& row : RowsOf(plan, each_step)) {
    kept.Row({row.name, row.type, row.points_total == 0 ? "" : Thousands(row.points),
              row.points_total == 0 ? "" : Thousands(row.points_total), row.segment, row.needed_by});
  }
  std::string text =
      fmt::format("Kept: {} in {}; {} of points and scratch\n\n", Plural(plan.steps().size(), "step"),
                  Plural(plan.segments().size(), "segment"), ByteText(BytesOf(plan)));
  text += kept.Text();
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const Plan::Excluded& e : plan.excluded()) by_reason[e.reason].push_back(e.node_name);
  for (const auto& [reason, names] : by_reason)
    text += fmt::format("\nLeft out, {} ({}):\n  {}\n", reason, Plural(names.size(), "node"),
                        fmt::join(names, ", "));
  return text;
}

}  // namespace kpsa::engine
