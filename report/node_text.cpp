#include "report/node_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "base/text.h"
#include "report/json_text.h"

namespace kpsa::engine {

std::string NodeStoryText(const NodeStory& story) {
  std::string text = fmt::format("{} ({})\n", story.name, story.type);
  if (!story.attribute.empty()) text += "  " + story.attribute + "\n";
  if (story.steps.empty()) text += "  is not evaluated: " + story.left_out + "\n";
  for (const NodeStory::Step& step : story.steps) {
    text += fmt::format("  {}: {}, evaluated in {} of {}, {}\n", step.name, step.points_text,
                        Thousands(step.count), Plural(story.frames, "frame"), step.segment);
    text += step.not_evaluated.empty() ? fmt::format("    dirtied by  {}\n", step.dirtied_by)
                                       : fmt::format("    skipped     {}\n", step.not_evaluated);
    text += fmt::format("    needed by   {}\n    points      {}\n", step.needed_by, step.mask);
  }
  return text;
}

std::string NodeStoryJson(const NodeStory& story) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const NodeStory::Step& step : story.steps) {
    rows.push_back({{"step", step.name},
                    {"segment", step.segment},
                    {"count", step.count},
                    {"points", step.points},
                    {"points_total", step.points_total},
                    {"dirtied_by", step.dirtied_by},
                    {"not_evaluated", step.not_evaluated},
                    {"needed_by", step.needed_by},
                    {"mask", step.mask}});
  }
  const nlohmann::ordered_json document{{"schema", "kpsa.explain/1"},
                                        {"node", story.name},
                                        {"type", story.type},
                                        {"attribute", story.attribute},
                                        {"frames", story.frames},
                                        {"left_out", story.left_out},
                                        {"steps", rows}};
  return JsonText(document);
}

}  // namespace kpsa::engine
