#include "report/page_graph.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "report/json_text.h"
#include "report/page_fields.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::ordered_json;

// A length or a time.
Json SixDigits(double value) { return RoundedJson<Json>(value, 6); }

std::map<std::string, double> MicrosecondsOf(const std::vector<BenchNode>& nodes) {
  std::map<std::string, double> times;
  for (const BenchNode& node : nodes) times[node.name] = node.ms_per_frame * 1e3;
  return times;
}

}  // namespace

void PutNodes(const std::vector<OutlinedNode>& nodes, bool accelerated,
              const std::vector<BenchNode>& full_times, const std::vector<BenchNode>& accelerated_times,
              PageData* page) {
  const std::map<std::string, double> full = MicrosecondsOf(full_times),
                                      fast = MicrosecondsOf(accelerated_times);
  Json told = Json::array();
  for (const OutlinedNode& node : nodes) {
    Json one = {{"name", node.name}, {"type", node.type}};
    if (accelerated) one["state"] = StateName(node.state);
    if (const auto it = full.find(node.name); it != full.end()) one["full_us"] = SixDigits(it->second);
    if (const auto it = fast.find(node.name); it != fast.end()) one["accelerated_us"] = SixDigits(it->second);
    if (node.points > 0) one["points"] = node.points;
    one["inputs"] = node.inputs;
    if (!node.reason.empty()) one["reason"] = node.reason;
    told.push_back(std::move(one));
  }
  if (!told.empty()) page->Put("nodes", CompactJson(told));
}

void PutCues(const std::vector<CueMark>& cues, const std::vector<std::vector<double>>& cue_us,
             PageData* page) {
  Json told = Json::array();
  for (const CueMark& cue : cues) {
    Json one = {{"name", cue.name}, {"kind", KindName(cue.kind)}};
    if (!cue.stage.empty()) one["stage"] = cue.stage;
    if (cue.vertex.has_value()) one["vertex"] = *cue.vertex;
    if (cue.position.has_value()) {
      one["position"] = Json::array();
      for (const double x : *cue.position) one["position"].push_back(SixDigits(x));
    }
    if (!cue_us.empty()) {
      double cost = 0;
      for (const CueMark::Cue& part : cue.cues) cost += cue_us[part.subspace][part.cue];
      one["cost_us"] = RoundedJson<Json>(cost, 4);
    }
    if (!cue.sees.empty()) one["sees"] = cue.sees;
    told.push_back(std::move(one));
  }
  if (!told.empty()) page->Put("cues", CompactJson(told));
}

bool PutFieldBlobs(const Rig& rig, PageData* page) {
  const std::vector<PageField> fields = FieldsOf(rig);
  if (fields.size() > kMostFieldBlobs) return false;
  Json told = Json::array();
  for (const PageField& field : fields) {
    const std::optional<std::vector<float>> weights = FieldWeights(rig, field.name);
    if (!weights.has_value()) continue;
    std::vector<std::uint8_t> bytes;
    for (const float weight : *weights) bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * weight)));
    const std::string blob = page->AddBlob("field." + std::to_string(told.size()), bytes);
    told.push_back({{"name", field.name}, {"group", field.group}, {"label", field.label}, {"blob", blob}});
  }
  if (!told.empty()) page->Put("fields", CompactJson(told));
  return true;
}

}  // namespace kpsa::engine
