#include "report/page_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "base/text.h"
#include "report/json_text.h"
#include "report/page_bench.h"
#include "report/page_table.h"
#include "report/page_training.h"
#include "report/promise_text.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::ordered_json;

Json Figure(const std::string& label, const std::string& value, const std::string& note = "") {
  Json figure = {{"label", label}, {"value", value}};
  if (!note.empty()) figure["note"] = note;
  return figure;
}

Json SummaryOf(const PageTables& of) {
  Json summary = Json::array();
  if (of.bench == nullptr) {
    const double ms = of.full.MeanMs();
    if (ms > 0)
      summary.push_back(
          Figure("ms a frame", fmt::format("{:.3g}", ms), TimesNote(of.full.cpu_times, of.runs, of.threads)));
    summary.push_back(Figure("vertices", Thousands(of.points)));
    return summary;
  }
  const BenchResult& r = *of.bench;
  if (std::isfinite(r.speedup()))
    summary.push_back(Figure(
        "times as fast", fmt::format("{:.1f}", r.speedup()),
        fmt::format("{:.3f} ms a frame instead of {:.3f}, misses included", r.accelerated_ms, r.full_ms)));
  summary.push_back(
      Figure("hits", fmt::format("{:.1f} %", 100 * PartOf(r.hits, r.frames)), r.most_frequent_reason));
  summary.push_back(
      Figure("largest error", LengthText(r.error_max),
             r.worst_clip.empty() ? "" : fmt::format("frame {} of {}", r.worst_frame, r.worst_clip)));
  if (r.promise.promised()) {
    const std::string text = PromiseText(r.promise, "");
    summary.push_back(Figure("tolerance", LengthText(r.promise.tolerance)));
    summary.push_back(
        Figure("promise", r.promise.kept() ? "kept" : "broken", text.substr(0, text.find('\n'))));
  }
  return summary;
}

Json TolerancesOf(const ToleranceTable& table) {
  Json rows = Json::array();
  for (const ToleranceRow& row : table.rows)
    rows.push_back({{"tolerance", row.tolerance},
                    {"hit_rate", row.hits},
                    {"speedup", std::isfinite(row.speedup) ? Json(row.speedup) : Json()}});
  return rows;
}

}  // namespace

void PutTables(const PageTables& of, PageData* page) {
  page->Put("summary", CompactJson(SummaryOf(of)));
  std::vector<PageTable> tables;
  std::vector<std::string> notes = of.notes;
  if (of.bench != nullptr) {
    const BenchResult& r = *of.bench;
    if (!r.tolerances.rows.empty()) page->Put("tolerances", CompactJson(TolerancesOf(r.tolerances)));
    tables = BenchPageTables(r, of.runs, of.threads);
    tables.push_back(ProfileTable(r.full_nodes, r.accelerated_nodes, r.full_ms));
    for (PageTable& table : TrainingTables(of.applied)) tables.push_back(std::move(table));
    notes.insert(notes.end(), r.notes.begin(), r.notes.end());
  } else {
    tables.push_back(ProfileTable(of.full.nodes, {}, of.full.MeanMs()));
  }
  PageTable noted("Notes", "", {{"note"}});
  for (const std::string& note : notes) noted.Row({note});
  tables.push_back(std::move(noted));
  std::string json;
  for (const PageTable& table : tables) {
    if (!table.empty()) json += (json.empty() ? "[" : ",") + table.Json();
  }
  if (!json.empty()) page->Put("tables", json + "]");
}

}  // namespace kpsa::engine
