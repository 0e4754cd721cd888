#include "report/vertex_text.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "base/text.h"
#include "files/quantity.h"
#include "report/json_text.h"
#include "report/table.h"

namespace kpsa::engine {

std::string VertexText(const VertexStory& story) {
  const auto place = [](const std::array<double, 3>& p) {
    return fmt::format("[{:.4f}, {:.4f}, {:.4f}]", p[0], p[1], p[2]);
  };
  std::string text =
      fmt::format("{}[{}] (point {} of {}) at {} s\n  rests at {} m, is at {} m, {} away\n", story.mesh,
                  story.vertex, Thousands(story.point), Thousands(story.points), NumberText(story.time),
                  place(story.rest), place(story.position), LengthText(story.moved));
  Table stages({"stage", "type", ">weight", ">envelope", ">moves it by"});
  for (const VertexStory::Stage& s : story.stages)
    stages.Row({s.name, s.type, fmt::format("{:.3g}", s.weight),
                s.envelope.has_value() ? fmt::format("{:.3g}", *s.envelope) : "", LengthText(s.moved)});
  text += "\n" + stages.Text();
  if (!story.joints.empty()) {
    Table joints({"joint", ">weight", ">moves it by"});
    for (const VertexStory::Joint& j : story.joints)
      joints.Row({j.name, fmt::format("{:.3g}", j.weight), LengthText(j.moved)});
    text += "\n" + joints.Text();
  }
  if (!story.morphs.empty()) {
    Table morphs({"morph target", ">at weight 1", ">weight", ">moves it by"});
    for (const VertexStory::Morph& m : story.morphs)
      morphs.Row({m.name, LengthText(m.size), fmt::format("{:.3g}", m.weight),
                  LengthText(std::abs(m.weight) * m.size)});
    text += "\n" + morphs.Text();
  }
  return text;
}

std::string VertexJson(const VertexStory& story) {
  using Json = nlohmann::ordered_json;
  Json stages = Json::array(), joints = Json::array(), morphs = Json::array();
  for (const VertexStory::Stage& s : story.stages) {
    Json stage = {{"stage", s.name},    {"type", s.type},      {"space", s.world ? "world" : "mesh"},
                  {"weight", s.weight}, {"envelope", nullptr}, {"moved_m", s.moved}};
    if (s.envelope.has_value()) stage["envelope"] = *s.envelope;
    stages.push_back(std::move(stage));
  }
  for (const VertexStory::Joint& j : story.joints)
    joints.push_back(Json{{"joint", j.name}, {"weight", j.weight}, {"moved_m", j.moved}});
  for (const VertexStory::Morph& m : story.morphs)
    morphs.push_back(Json{{"target", m.name},
                          {"size_m", m.size},
                          {"weight", m.weight},
                          {"moved_m", std::abs(m.weight) * m.size}});
  const Json document = {{"schema", "kpsa.explain_vertex/1"},
                         {"mesh", story.mesh},
                         {"vertex", story.vertex},
                         {"point", story.point},
                         {"time", story.time},
                         {"rest_m", story.rest},
                         {"position_m", story.position},
                         {"moved_m", story.moved},
                         {"stages", std::move(stages)},
                         {"joints", std::move(joints)},
                         {"morphs", std::move(morphs)}};
  return JsonText(document);
}

}  // namespace kpsa::engine
