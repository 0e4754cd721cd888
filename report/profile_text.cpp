#include "report/profile_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "base/text.h"
#include "report/json_text.h"
#include "report/table.h"

namespace kpsa::engine {

std::string ProfileText(const Plan& plan, const Measured& measured, std::vector<NodeTime> nodes,
                        const CriticalPath& path, const std::string& sort, std::size_t top) {
  const auto frames = static_cast<double>(measured.frames.size());
  if (sort == "inclusive")
    std::stable_sort(nodes.begin(), nodes.end(),
                     [](auto& a, auto& b) { return a.inclusive_ns > b.inclusive_ns; });
  if (sort == "count")
    std::stable_sort(nodes.begin(), nodes.end(), [](auto& a, auto& b) { return a.count > b.count; });
  if (sort == "points")
    std::stable_sort(nodes.begin(), nodes.end(), [](auto& a, auto& b) { return a.points > b.points; });
  if (sort == "name")
    std::stable_sort(nodes.begin(), nodes.end(), [](auto& a, auto& b) { return a.name < b.name; });
  Table table({"node", "type", ">self us", ">inclusive us", ">count", ">points", ">ns/point", ">share"});
  for (std::size_t i = 0; i < std::min(top, nodes.size()); ++i) {
    const NodeTime& n = nodes[i];
    const double computed_points = static_cast<double>(n.points) * static_cast<double>(n.count);
    table.Row({n.name, n.type, fmt::format("{:.1f}", n.self_ns / frames / 1e3),
               fmt::format("{:.1f}", n.inclusive_ns / frames / 1e3), Thousands(n.count),
               n.points == 0 ? "" : Thousands(n.points),
               computed_points > 0 ? fmt::format("{:.2f}", n.self_ns / computed_points) : "",
               fmt::format("{:.1f} %", 100 * n.self_ns / measured.wall_ns)});
  }
  std::string text = table.Text();
  if (nodes.size() > top)
    text += fmt::format("... and {} more (--top {} shows all)\n", Plural(nodes.size() - top, "node"),
                        nodes.size());
  text += fmt::format("\nFrame: {:.3f} ms (mean of {}); in nodes {:.3f} ms, between them {:.3f} ms\n",
                      measured.wall_ns / frames / 1e6, Plural(measured.frames.size(), "frame"),
                      measured.node_ns / frames / 1e6, measured.between_ns() / frames / 1e6);
  std::vector<std::string> names;
  for (Index s : path.steps) names.push_back(StepName(plan, s));
  if (names.size() > 12)
    names.erase(names.begin() + 4, names.end() - 7), names.insert(names.begin() + 4, "...");
  text += fmt::format("Critical path: {:.3f} ms: {}\n", path.ns / frames / 1e6, fmt::join(names, " > "));
  text += fmt::format(
      "Speedup ceiling: {:.1f}x: {:.1f} % of the time is spent above the points, and a subspace "
      "skips only what none of its cues reads\n",
      measured.ceiling(), 100 * (measured.above_ns + measured.between_ns()) / measured.wall_ns);
  return text;
}

std::string ProfileJson(const Rig& rig, const Plan& plan, const Measured& measured,
                        const std::vector<NodeTime>& nodes, const CriticalPath& path, int threads) {
  const auto frames = static_cast<double>(measured.frames.size());
  nlohmann::ordered_json rows = nlohmann::ordered_json::array(), chain = rows;
  for (const NodeTime& n : nodes) {
    rows.push_back({{"name", n.name},
                    {"type", n.type},
                    {"segment", n.segment},
                    {"self_ms", n.self_ns / frames / 1e6},
                    {"inclusive_ms", n.inclusive_ns / frames / 1e6},
                    {"count", n.count},
                    {"points", n.points},
                    {"points_total", n.points_total},
                    {"share", n.self_ns / measured.wall_ns}});
  }
  for (Index s : path.steps) chain.push_back(StepName(plan, s));
  const nlohmann::ordered_json document{{"schema", "kpsa.profile/1"},
                                        {"clip", rig.scene.clip.value_or("")},
                                        {"frames", measured.frames.size()},
                                        {"threads", threads},
                                        {"ms_per_frame", measured.wall_ns / frames / 1e6},
                                        {"between_nodes_ms", measured.between_ns() / frames / 1e6},
                                        {"nodes", rows},
                                        {"critical_path", {{"ms", path.ns / frames / 1e6}, {"steps", chain}}},
                                        {"ceiling",
                                         {{"speedup", measured.ceiling()},
                                          {"above_points_ms", measured.above_ns / frames / 1e6},
                                          {"bound_by", "what is evaluated above the points"}}}};
  return JsonText(document);
}

}  // namespace kpsa::engine
