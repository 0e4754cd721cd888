#include "report/decision_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "kpsa/kpsa_node.h"
#include "kpsa/signals.h"
#include "report/json_text.h"
#include "report/verdict_text.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMostOutside = 5;  // guards that the text lists

std::string ThresholdText(const SoftCacheThreshold& threshold) {
  if (std::isinf(threshold.tau)) return "every finite score is a hit";
  if (!(threshold.tau > 0)) return "no score is a hit";
  return fmt::format("a hit up to {:.3g}, a blend up to {:.3g}", threshold.tau_lo(), threshold.tau);
}

}  // namespace

std::string DecisionText(const DecisionStory& story) {
  std::string text = fmt::format("frame {}{}\n", story.frame,
                                 story.clip.empty() ? ", no clip" : fmt::format(" of {}", story.clip));
  for (const DecisionStory::Entry& entry : story.entries) {
    const FrameDecision& d = entry.decision;
    text += fmt::format("{} ({}): {}\n", d.entry, entry.path, VerdictName(d.verdict()));
    text += fmt::format(
        "  points      {}\n",
        d.hit() ? "reconstructed" : fmt::format("{:.3g} % from the full evaluation", 100 * d.full_weight));
    if (!d.hit()) text += fmt::format("  reason      {}\n", d.reason);
    for (std::size_t i = 0; i < std::min(kMostOutside, entry.outside.size()); ++i) {
      const DecisionStory::Outside& o = entry.outside[i];
      text += "  outside     " + OutsideMessage({o.plug, o.lo, o.hi}, o.value) + "\n";
    }
    if (entry.outside.size() > kMostOutside)
      text += fmt::format("  outside     {} more\n", entry.outside.size() - kMostOutside);
    text += fmt::format("  score       {}; {}\n",
                        std::isfinite(d.score) ? fmt::format("{:.3g}", d.score) : "none was measured",
                        ThresholdText(entry.calibration.threshold));
    if (entry.tolerance < kAnyError)
      text += fmt::format("  tolerance   {}{}, exceeded in {:.3g} % of frames at most\n",
                          entry.units == kLightUnits ? "an RMS of " : "",
                          ErrorText(entry.tolerance, entry.units == kLightUnits),
                          100 * entry.calibration.attainable_alpha);
  }
  return text;
}

std::string DecisionStoryJson(const DecisionStory& story) {
  nlohmann::ordered_json entries = nlohmann::ordered_json::array();
  for (const DecisionStory::Entry& entry : story.entries) {
    nlohmann::ordered_json outside = nlohmann::ordered_json::array(),
                           row = DecisionJson<nlohmann::ordered_json>(entry.decision);
    for (const DecisionStory::Outside& o : entry.outside)
      outside.push_back({{"plug", o.plug}, {"value", o.value}, {"trained", {o.lo, o.hi}}});
    row.update({{"file", entry.path},
                {"outside", outside},
                {"hit_up_to", entry.calibration.threshold.tau_lo()},
                {"blend_up_to", entry.calibration.threshold.tau},
                {"tolerance", entry.tolerance},
                {"violation_limit", entry.calibration.attainable_alpha}});
    entries.push_back(std::move(row));
  }
  const nlohmann::ordered_json document = {{"schema", "kpsa.explain/1"},
                                           {"frame", story.frame},
                                           {"clip", story.clip},
                                           {"decisions", std::move(entries)}};
  return JsonText(document);
}

}  // namespace kpsa::engine
