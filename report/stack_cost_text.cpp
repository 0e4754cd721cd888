#include "report/stack_cost_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "report/json_text.h"

namespace kpsa::engine {
namespace {

std::string MicrosecondsText(double ns) { return fmt::format("{:.{}f} us", ns / 1e3, ns < 9950 ? 1 : 0); }

nlohmann::ordered_json CostJson(const FrameCost& cost) {
  return {{"frame_ms", cost.frame / 1e6},
          {"stack_ms", cost.stack / 1e6},
          {"least_ms", cost.least / 1e6},
          {"saving_ms", cost.saving() / 1e6},
          {"speedup_at_most", cost.bound()}};
}

}  // namespace

std::string NotWorthItText(const StackCost& cost, const std::string& rig) {
  constexpr std::size_t kNamed = 4;
  const FrameCost& timed = cost.timed;
  std::string text =
      fmt::format("{}: a frame of this stack costs {}, {} could be saved: not worth it\nof which ", rig,
                  MicrosecondsText(timed.frame), MicrosecondsText(timed.saving()));
  double named = 0;
  for (std::size_t d = 0; d < std::min(kNamed, cost.deformers.size()); ++d) {
    text += fmt::format("{} {}, ", cost.deformers[d].first, MicrosecondsText(cost.deformers[d].second));
    named += cost.deformers[d].second;
  }
  if (cost.deformers.size() > kNamed)
    text += fmt::format("other deformers {}, ", MicrosecondsText(timed.stack - named));
  return text + fmt::format(
                    "graph {}; to measure cues and reconstruct {} takes {} at least\n"
                    "nothing was trained; --force trains it all the same\n",
                    MicrosecondsText(timed.frame - timed.stack), Plural(cost.points, "point"),
                    MicrosecondsText(timed.least));
}

std::string NotWorthItJson(const StackCost& cost) {
  nlohmann::ordered_json deformers = nlohmann::ordered_json::array();
  for (const auto& [name, ns] : cost.deformers)
    deformers.push_back({{"name", name}, {"ms_per_frame", ns / 1e6}});
  const nlohmann::ordered_json document = {{"schema", "kpsa.train/1"},
                                           {"subspace", nullptr},
                                           {"not_worth_it",
                                            {{"points", cost.points},
                                             {"timed", CostJson(cost.timed)},
                                             {"stated", CostJson(cost.stated)},
                                             {"deformers", std::move(deformers)}}}};
  return JsonText(document);
}

}  // namespace kpsa::engine
