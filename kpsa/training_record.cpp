#include "kpsa/training_record.h"

#include <nlohmann/json.hpp>

namespace kpsa::engine {

using nlohmann::json;

namespace {

constexpr char kControlsMember[] = "controls", kSignatureMember[] = "signature";

std::vector<std::string> NamesIn(const json& object, const char* name) {
  std::vector<std::string> list;
  if (!object.contains(name) || !object[name].is_array()) return list;
  for (const json& entry : object[name]) {
    if (entry.is_string()) list.push_back(entry.get<std::string>());
  }
  return list;
}

json SignatureJson(const Signature& signature) {
  json nodes = json::object();
  for (const auto& [name, node] : signature)
    nodes[name] = {{"node", node.node}, {"attributes", node.attributes}};
  return nodes;
}

Signature ParseSignature(const json& nodes) {
  Signature signature;
  if (!nodes.is_object()) return signature;
  for (const auto& [name, from] : nodes.items()) {
    if (!from.is_object()) continue;
    NodeSignature& node = signature[name];
    if (const auto it = from.find("node"); it != from.end() && it->is_string())
      node.node = it->get<std::string>();
    const auto attributes = from.find("attributes");
    if (attributes == from.end() || !attributes->is_object()) continue;
    for (const auto& [attribute, digest] : attributes->items()) {
      if (digest.is_string()) node.attributes[attribute] = digest.get<std::string>();
    }
  }
  return signature;
}

}  // namespace

std::string TrainingJson(const TrainingRecord& r) {
  json tried = json::array();
  for (const TrainingRecord::Tried& one : r.tried) {
    tried.push_back({{"cues", one.what},
                     {"count", one.cues},
                     {"rows", one.rows},
                     {"misses", one.misses},
                     {"cost", one.cost},
                     {"taken", one.taken}});
  }
  json rules = json::array();
  for (const TrainingRecord::Rule& one : r.rules)
    rules.push_back({{"rule", one.what}, {"misses", one.misses}, {"cost", one.cost}, {"taken", one.taken}});
  json object = {{"tried", tried},
                 {"rules", rules},
                 {"separation",
                  {{"poses", r.separation.poses},
                   {"beyond", r.separation.beyond},
                   {"likeness", r.separation.likeness},
                   {"doubts", r.separation.doubts}}},
                 {"clips", r.clips},
                 {"asked",
                  {{"samples", r.asked.samples},
                   {"calibration", r.asked.calibration},
                   {"rows", r.asked.rows},
                   {"modes", r.asked.modes},
                   {"points", r.asked.points},
                   {"by_tile", r.asked.by_tile}}},
                 {"clip_poses", r.clip_poses},
                 {"sampled_poses", r.sampled_poses},
                 {"calibration_poses", r.calibration_poses},
                 {"seed", r.seed},
                 {"motion_rms", r.motion_rms},
                 {"diagonal", r.diagonal},
                 {"held_out", {{"rms", r.held_out_rms}, {"max", r.held_out_max}}},
                 {"tile_rms", r.tile_rms},
                 {"mode", r.mode},
                 {"warning", r.warning},
                 {"worst",
                  {{"kind", r.worst.kind},
                   {"clip", r.worst.clip},
                   {"time", r.worst.time},
                   {"controls", r.worst.controls},
                   {"error", r.worst.error}}}};
  if (!r.limited.empty()) object["limited"] = r.limited;
  if (!r.at_rest.empty()) object["at_rest"] = r.at_rest;
  if (!r.by_clips_alone.empty()) object["by_clips_alone"] = r.by_clips_alone;
  for (const auto& [clip, times] : r.learnt) object["learnt"].push_back({{"clip", clip}, {"times", times}});
  for (const Miss& pose : r.learnt_poses)
    object["learnt_poses"].push_back({{"clip", pose.clip}, {"time", pose.time}, {"controls", pose.controls}});
  return object.dump();
}

TrainingRecord ParseTraining(const std::string& text) {
  TrainingRecord r;
  const json object = json::parse(text, nullptr, false);
  if (!object.is_object()) return r;
  const auto number = [&](const json& from, const char* name) {
    return from.contains(name) && from[name].is_number() ? from[name].get<double>() : 0.0;
  };
  const auto count_in = [&](const json& from, const char* name) {
    const double v = number(from, name);
    return v > 0 && v < 1e15 ? static_cast<std::size_t>(v) : std::size_t{0};
  };
  const auto count = [&](const char* name) { return count_in(object, name); };
  const auto words_in = [](const json& from, const char* name) {
    return from.contains(name) && from[name].is_string() ? from[name].get<std::string>() : std::string();
  };
  const auto is_true_in = [](const json& from, const char* name) {
    return from.contains(name) && from[name].is_boolean() && from[name].get<bool>();
  };
  const auto words = [&](const char* name) { return words_in(object, name); };
  r.clips = NamesIn(object, "clips");
  r.clip_poses = count("clip_poses");
  r.sampled_poses = count("sampled_poses");
  r.calibration_poses = count("calibration_poses");
  r.seed = count("seed");
  r.motion_rms = number(object, "motion_rms");
  r.diagonal = number(object, "diagonal");
  if (object.contains("held_out") && object["held_out"].is_object()) {
    r.held_out_rms = number(object["held_out"], "rms");
    r.held_out_max = number(object["held_out"], "max");
  }
  if (object.contains("separation") && object["separation"].is_object()) {
    const json& told = object["separation"];
    r.separation = {count_in(told, "poses"), count_in(told, "beyond"), number(told, "likeness"),
                    number(told, "doubts")};
  }
  r.tile_rms = number(object, "tile_rms");
  r.mode = words("mode");
  r.warning = words("warning");
  r.limited = words("limited");
  r.at_rest = NamesIn(object, "at_rest");
  r.by_clips_alone = NamesIn(object, "by_clips_alone");
  if (object.contains("asked") && object["asked"].is_object()) {
    const json& asked = object["asked"];
    r.asked = {count_in(asked, "samples"), count_in(asked, "calibration"),
               count_in(asked, "rows"),    count_in(asked, "modes"),
               count_in(asked, "points"),  !asked.contains("by_tile") || asked["by_tile"] != false};
  }
  if (object.contains("learnt") && object["learnt"].is_array()) {
    for (const json& from : object["learnt"]) {
      if (!from.is_object() || !from.contains("clip") || !from["clip"].is_string()) continue;
      auto& [clip, times] = r.learnt.emplace_back(from["clip"].get<std::string>(), std::vector<double>());
      for (const json& time : from.value("times", json::array())) {
        if (time.is_number()) times.push_back(time.get<double>());
      }
    }
  }
  const auto controls = [](const json& from) {
    std::vector<std::pair<std::string, double>> values;
    if (!from.contains("controls") || !from["controls"].is_array()) return values;
    for (const json& control : from["controls"]) {
      if (control.is_array() && control.size() == 2 && control[0].is_string() && control[1].is_number())
        values.emplace_back(control[0].get<std::string>(), control[1].get<double>());
    }
    return values;
  };
  if (object.contains("learnt_poses") && object["learnt_poses"].is_array()) {
    for (const json& from : object["learnt_poses"]) {
      if (!from.is_object() || !from.contains("clip") || !from["clip"].is_string()) continue;
      r.learnt_poses.push_back({from["clip"].get<std::string>(), number(from, "time"), controls(from)});
    }
  }
  if (object.contains("worst") && object["worst"].is_object()) {
    const json& worst = object["worst"];
    r.worst.kind = words_in(worst, "kind"), r.worst.clip = words_in(worst, "clip");
    r.worst.time = number(worst, "time"), r.worst.error = number(worst, "error");
    r.worst.controls = controls(worst);
  }
  const auto each_of = [&](const char* list, const auto& take) {
    if (!object.contains(list) || !object[list].is_array()) return;
    for (const json& one : object[list]) {
      if (one.is_object()) take(one);
    }
  };
  each_of("tried", [&](const json& one) {
    r.tried.push_back({words_in(one, "cues"), count_in(one, "count"), count_in(one, "rows"),
                       number(one, "misses"), number(one, "cost"), is_true_in(one, "taken")});
  });
  each_of("rules", [&](const json& one) {
    r.rules.push_back(
        {words_in(one, "rule"), number(one, "misses"), number(one, "cost"), is_true_in(one, "taken")});
  });
  return r;
}

TrainedRig TakeTrainedRig(std::string* text) {
  TrainedRig rig;
  json object = json::parse(*text, nullptr, false);
  if (!object.is_object()) return rig;
  rig.controls = NamesIn(object, kControlsMember);
  if (object.contains(kSignatureMember)) rig.signature = ParseSignature(object[kSignatureMember]);
  object.erase(kControlsMember);
  object.erase(kSignatureMember);
  *text = object.dump();
  return rig;
}

std::string TrainingText(const Subspace& s) {
  json object = json::parse(s.training, nullptr, false);
  if (!object.is_object()) return s.training;
  object[kControlsMember] = s.rig.controls;
  object[kSignatureMember] = SignatureJson(s.rig.signature);
  return object.dump();
}

}  // namespace kpsa::engine
