#include "report/learn_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "report/json_text.h"
#include "report/verdict_text.h"

namespace kpsa::engine {

std::string LearnJson(const LearnResult& result, const std::string& path, double seconds) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  const auto counts = [](const ClipTrial& trial) {
    return nlohmann::ordered_json{{"hits", trial.hits}, {"blends", trial.blends}, {"misses", trial.misses}};
  };
  for (const LearnResult::Clip& one : result.clips)
    list.push_back({{"clip", one.name}, {"before", counts(one.before)}, {"after", counts(one.after)}});
  nlohmann::ordered_json document = {{"schema", "kpsa.learn/1"},
                                     {"subspace", path},
                                     {"learnt", result.frames},
                                     {"clips", list},
                                     {"seconds", seconds}};
  if (result.tiles.all > 0) document["tiles"] = {{"all", result.tiles.all}, {"kept", result.tiles.kept}};
  return JsonText(document);
}

std::string LearnText(const LearnResult& result, const std::string& path, double seconds) {
  std::string text = result.frames == 0 ? fmt::format("{}: there is nothing new to learn\n", path)
                                        : fmt::format("{}: {} learnt, trained again in {:.1f} s\n", path,
                                                      Plural(result.frames, "frame"), seconds);
  if (result.tiles.all > 0)
    text += fmt::format("{} of {} had nothing to learn, and are as they were\n", result.tiles.kept,
                        Plural(result.tiles.all, "tile"));
  for (const LearnResult::Clip& one : result.clips) {
    const auto counts = [](const ClipTrial& t) { return CountsText(t.hits, t.blends, t.misses); };
    text += fmt::format("{}: {}", one.name, counts(one.before));
    if (result.frames > 0) text += "; now " + counts(one.after);
    text += "\n";
    if (!one.after.reason.empty()) text += one.after.reason + "\n";
  }
  return text;
}

}  // namespace kpsa::engine
