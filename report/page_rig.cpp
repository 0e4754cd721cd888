#include "report/page_rig.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/version.h"
#include "report/json_text.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::ordered_json;

std::string Text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string FileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

// -30, and not what degrees become on their way through radians.
Json Number(double value) { return RoundedJson<Json>(value, 12); }

const char* KindOf(Type type) {
  return type == Type::kBool ? "switch" : type == Type::kDouble ? "number" : "integer";
}

Json UnitOf(Unit unit, const FileUnits& units) {
  switch (unit) {
    case Unit::kLength:
      return units.length_name;
    case Unit::kAngle:
      return units.angle_name == "deg" ? "°" : units.angle_name;
    case Unit::kTime:
      return "s";
    case Unit::kNone:
      break;
  }
  return nullptr;
}

// "jaw" and "rotateX"; "face_mesh.weight" and "smile" of face_mesh.weight[smile].
std::pair<std::string, std::string> GroupAndLabel(const Rig& rig, const Control& control) {
  const std::string& name = control.name;
  const std::size_t open = name.rfind('[');
  if (open != std::string::npos && open > 0 && name.ends_with(']'))
    return {name.substr(0, open), name.substr(open + 1, name.size() - open - 2)};
  const std::string& node = rig.graph->name(control.plug.node);
  if (name.size() > node.size() + 1 && name.starts_with(node) && name[node.size()] == '.')
    return {node, name.substr(node.size() + 1)};
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 == name.size()) return {node, name};
  return {name.substr(0, dot), name.substr(dot + 1)};
}

// In 255ths of the largest.
void TellReach(const ControlReach& reach, std::size_t number, Json* told, PageData* page) {
  if (reach.of_vertices.empty()) return;
  std::vector<std::uint8_t> moves;
  for (const float metres : reach.of_vertices)
    moves.push_back(
        static_cast<std::uint8_t>(std::lround(255 * static_cast<double>(metres) / reach.largest)));
  (*told)["moves"] = page->AddBlob("moves." + std::to_string(number), moves);
  (*told)["moves_max"] = reach.largest;
}

}  // namespace

std::string PageText(const std::string& text) { return Text(Json(text)); }

std::size_t StackedVertices(const Rig& rig) {
  std::size_t count = 0;
  for (const std::size_t m : ShownMeshes(rig.scene)) count += rig.scene.meshes[m].vertex_count;
  return count;
}

void PutRigNames(const Rig& rig, PageData* page) {
  const std::string version = VersionText();
  page->Put("title", PageText(std::filesystem::path(rig.path).stem().string()));
  page->Put("rig", PageText(FileName(rig.path)));
  page->Put("character", PageText(FileName(rig.character->path)));
  page->Put("program", PageText(version.substr(0, version.find('\n'))));
}

void PutMeshes(const Rig& rig, std::span<const float> rest, PageData* page) {
  Json meshes = Json::array();
  std::size_t first = 0;
  std::vector<std::uint32_t> triangles;
  for (const std::size_t m : ShownMeshes(rig.scene)) {
    const CharacterMesh& mesh = rig.scene.meshes[m];
    triangles = mesh.mesh().data().triangle_vertices;
    for (std::uint32_t& vertex : triangles) vertex += static_cast<std::uint32_t>(first);
    const std::string blob = page->AddBlob("triangles." + std::to_string(meshes.size()), triangles);
    meshes.push_back(
        {{"name", mesh.name}, {"first", first}, {"count", mesh.vertex_count}, {"triangles", blob}});
    first += mesh.vertex_count;
  }
  page->Put("points", std::to_string(first));
  page->Put("meshes", Text(meshes));
  page->Put("rest", PageText(page->AddBlob("rest", rest)));
}

void PutControls(const Rig& rig, PageData* page, std::span<const ControlReach> reaches) {
  Json controls = Json::array();
  for (const Control& control : rig.controls) {
    const double one = rig.units.FactorOf(control.unit);
    const auto [group, label] = GroupAndLabel(rig, control);
    Json told = {{"name", control.name},
                 {"group", group},
                 {"label", label},
                 {"min", Number(control.min / one)},
                 {"max", Number(control.max / one)},
                 {"value", Number(control.value / one)},
                 {"kind", KindOf(rig.graph->PlugType(control.plug))}};
    if (const Json unit = UnitOf(control.unit, rig.units); !unit.is_null()) told["unit"] = unit;
    if (!reaches.empty()) TellReach(reaches[controls.size()], controls.size(), &told, page);
    controls.push_back(std::move(told));
  }
  if (!controls.empty()) page->Put("controls", Text(controls));
}

}  // namespace kpsa::engine
