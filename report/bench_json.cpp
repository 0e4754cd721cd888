#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/bench_report.h"
#include "report/json_text.h"
#include "report/tolerance_text.h"
#include "report/verdict_text.h"

namespace kpsa::engine {
namespace {

using OrderedJson = nlohmann::ordered_json;

double Finite(double value) { return std::isfinite(value) ? value : -1; }

// The error of every frame, and what it consists of; null where no modes are kept.
OrderedJson FrameErrorsJson(const FrameErrors& e) {
  if (e.empty()) return {};
  OrderedJson hits = OrderedJson::array(), misses = OrderedJson::array();
  for (char hit : e.hit) hits.push_back(hit != 0);
  for (char miss : e.miss) misses.push_back(miss != 0);
  return {{"rms",
           {{"projection", OverFrames(e.projection)},
            {"cueing", OverFrames(e.cueing)},
            {"storage", OverFrames(e.storage)},
            {"total", OverFrames(e.total)},
            {"soft_cache", OverFrames(e.soft_cache)}}},
          {"times", e.times},
          {"projection", e.projection},
          {"cueing", e.cueing},
          {"storage", e.storage},
          {"total", e.total},
          {"soft_cache", e.soft_cache},
          {"hit", hits},
          {"miss", misses}};
}

// Null where it was not asked for.
OrderedJson IdleJson(const IdleDeformers& idle) {
  if (!idle.measured()) return {};
  OrderedJson deformers = OrderedJson::array();
  for (const IdleDeformers::Deformer& each : idle.deformers) {
    deformers.push_back({{"name", each.name},
                         {"type", each.type},
                         {"difference", Finite(each.difference)},
                         {"off", each.off}});
  }
  return {{"share", idle.share},
          {"ms_per_frame", idle.ms_per_frame},
          {"difference", idle.difference},
          {"frames", idle.frames},
          {"deformers", std::move(deformers)}};
}

OrderedJson RangeJson(const BenchResult::Range& range) { return {range.least, range.most}; }

OrderedJson PromiseJson(const Promise& p) {
  if (!p.promised()) return {};
  OrderedJson worst;
  if (!p.worst_clip.empty()) {
    worst = {{"clip", p.worst_clip},
             {"frame", p.worst_frame},
             {"error", Finite(p.worst_error)},
             {"tolerances", p.worst_error / p.tolerance}};
  }
  const auto share = [](std::size_t part, std::size_t all) {
    return static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(1, all));
  };
  return {{"kept", p.kept()},
          {"rate", share(p.beyond, p.frames)},
          {"promised", p.rate},
          {"rate_of_hits", share(p.hits_beyond, p.hits)},
          {"promised_of_hits", p.hit_rate()},
          {"worst_accepted", std::move(worst)}};
}

OrderedJson ReferenceJson(const ReferenceTable& table) {
  if (table.rows.empty()) return {};
  OrderedJson rows = OrderedJson::array();
  for (const FromReference& row : table.rows) {
    OrderedJson rms = OrderedJson::array();
    for (const double error : row.rms) rms.push_back(Finite(error));
    rows.push_back({{"name", row.name}, {"rms", rms}, {"ms_per_frame", row.ms}, {"frames", row.frames}});
  }
  return {{"variant", table.variant},
          {"outputs", table.outputs},
          {"points", table.points},
          {"of_points", table.of_points},
          {"rows", rows}};
}

OrderedJson SideJson(const BenchResult& r, const BenchContext& context) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
  for (const BenchNode& n : r.full_nodes) {
    nodes.push_back({{"name", n.name},
                     {"type", n.type},
                     {"ms_per_frame", n.ms_per_frame},
                     {"points", n.points},
                     {"ns_per_point", n.points == 0 ? 0 : n.ms_per_frame * 1e6 / n.points}});
  }
  const double frames = static_cast<double>(std::max<std::size_t>(1, r.frames));
  const std::string bound =
      fmt::format("the graph that the subspace reads ({:.4f} ms){}", r.bound_graph_ms,
                  r.bound_points_ms > 0
                      ? fmt::format(" and points that are not accelerated ({:.4f} ms)", r.bound_points_ms)
                      : "");
  OrderedJson per_frame = OrderedJson::array();
  for (const BenchResult::Frame& f : r.per_frame) {
    OrderedJson row = {{"clip", f.clip}, {"frame", f.number}};
    row.update(DecisionJson<OrderedJson>(f.decision));
    row.update({{"rms", Finite(f.rms)},
                {"max", Finite(f.max)},
                {"full_ms", f.full_ms},
                {"accelerated_ms", f.accelerated_ms}});
    per_frame.push_back(std::move(row));
  }
  return {
      {"schema", "kpsa.bench/1"},
      {"rig", context.rig},
      {"subspace", r.subspace},
      {"mode", r.mode},
      {"clip", fmt::format("{}", fmt::join(r.clips, ", "))},
      {"clips", r.clips},
      {"trained_on", r.trained_on},
      {"points", r.points},
      {"output_points", r.output_points},
      {"cues", r.cues},
      {"cue_points", r.cue_points},
      {"cue_stages", r.cue_stages},
      {"modes", r.modes},
      {"storage", {{"bytes_per_point", r.bytes_per_point}, {"mean_rank", r.mean_rank}}},
      {"frames", r.frames},
      {"threads", context.options.threads},
      {"runs", context.options.runs},
      {"units", r.light ? "light" : "m"},
      {"tolerance", r.promise.tolerance},
      {"clock", r.cpu_times ? "cpu" : "wall"},
      {"wall_over_cpu", r.wall_over_cpu},
      {"full",
       {{"ms_per_frame", r.full_ms},
        {"ms_range", RangeJson(r.full_range)},
        {"ns_per_point", r.output_points == 0 ? 0 : r.full_ms * 1e6 / static_cast<double>(r.output_points)},
        {"nodes", nodes}}},
      {"accelerated",
       {{"ms_per_frame", r.accelerated_ms},
        {"ms_range", RangeJson(r.accelerated_range)},
        {"parts_recorded", r.parts_ms},
        {"graph", r.graph_ms},
        {"cues", r.cues_ms},
        {"projection", r.projection_ms},
        {"reconstruction", r.reconstruction_ms},
        {"downstream", r.downstream_ms},
        {"misses", r.misses_ms}}},
      {"speedup", r.speedup()},
      {"speedup_range", RangeJson(r.speedup_range)},
      {"speedup_on_hits",
       r.hits == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(r.speedup_on_hits())},
      {"ceiling", {{"speedup", r.ceiling()}, {"ms_per_frame", r.bound_ms}, {"bound_by", bound}}},
      {"hit_rate", static_cast<double>(r.hits) / frames},
      {"blend_rate", static_cast<double>(r.blends) / frames},
      {"most_frequent_reason", r.most_frequent_reason},
      {"violation_rate", static_cast<double>(r.promise.beyond) / frames},
      {"violation_limit", r.promise.rate},
      {"promise", PromiseJson(r.promise)},
      {"error",
       {{"rms", Finite(r.error_rms)},
        {"max", Finite(r.error_max)},
        {"p99", Finite(r.error_p99)},
        {"bbox_diagonal", r.diagonal},
        {"worst_clip", r.worst_clip},
        {"worst_frame", r.worst_clip.empty() ? OrderedJson() : OrderedJson(r.worst_frame)}}},
      {"frame_errors", FrameErrorsJson(r.frame_errors)},
      {"reference", ReferenceJson(r.reference)},
      {"idle", IdleJson(r.idle)},
      {"motion", {{"rms", r.motion_rms}}},
      {"nodes", {{"total", r.nodes_total}, {"never_evaluated", r.never_evaluated}}},
      {"points_evaluated_per_frame", {{"full", r.points_full}, {"accelerated", r.points_accelerated}}},
      {"tolerances", ToleranceJson<OrderedJson>(r.tolerances, BenchWords(r))},
      {"per_frame", per_frame},
      {"notes", r.notes}};
}

}  // namespace

std::string BenchJson(const std::vector<BenchResult>& results, const BenchContext& context) {
  OrderedJson document = SideJson(results.front(), context), beside = OrderedJson::array();
  for (std::size_t i = 1; i < results.size(); ++i) beside.push_back(SideJson(results[i], context));
  document["beside"] = std::move(beside);
  return JsonText(document);
}

}  // namespace kpsa::engine
