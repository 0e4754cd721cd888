#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdint>
#include <map>

#include "base/quantity_text.h"
#include "files/quantity.h"
#include "host/acceleration.h"
#include "report/character_facts.h"

namespace kpsa::engine {
namespace {

FactTable::Cell CountOf(std::size_t count) { return static_cast<std::uint64_t>(count); }

}  // namespace

FileFacts RigFacts(const Rig& rig) {
  FileFacts facts;
  facts.kind = "rig";
  facts.facts = {{"character", rig.character->path},
                 {"fps", rig.fps},
                 {"length", rig.units.length_name},
                 {"angle", rig.units.angle_name},
                 {"nodes", CountOf(rig.graph->Nodes().size())}};
  FactTable meshes{"meshes", {"mesh", ">vertices", ">points", "stack"}, {}};
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    std::vector<std::string> stages;
    for (const Stage& stage : mesh.stages) stages.push_back(stage.name);
    meshes.rows.push_back({mesh.name, CountOf(mesh.vertex_count), CountOf(mesh.mesh().point_count()),
                           fmt::format("{}", fmt::join(stages, " > "))});
  }
  FactTable types{"node types", {"type", ">nodes"}, {}};
  std::map<std::string, std::size_t> counts;
  for (NodeId node : rig.graph->Nodes()) ++counts[rig.graph->def(node).name];
  for (const auto& [type, count] : counts) types.rows.push_back({type, CountOf(count)});
  FactTable clips{"clips", {"clip", ">seconds", ">frames"}, {}};
  for (const CharacterClip& clip : rig.scene.clips)
    clips.rows.push_back({clip.id, clip.duration, FrameCount(clip.duration, rig.fps)});
  FactTable controls{"controls", {"control", ">min", ">max", ">rest"}, {}};
  for (const Control& control : rig.controls) {
    const double factor = 1 / rig.units.FactorOf(control.unit);
    controls.rows.push_back(
        {control.name, control.min * factor, control.max * factor, control.value * factor});
  }
  FactTable accelerate{
      "accelerate", {"name", "points", "subspace", ">tolerance", "train clips", "test clips"}, {}};
  for (const AccelerateEntry& a : rig.accelerate) {
    const bool colors = !a.points.empty() && a.points[0].colors;
    std::vector<std::string> points = PointNames(rig, a);
    if (a.reference >= 0) {
      for (std::string& name : points)
        name.insert(0, rig.references[static_cast<std::size_t>(a.reference)].name_space);
    }
    accelerate.rows.push_back({a.name, fmt::format("{}", fmt::join(points, ", ")), a.subspace,
                               colors ? NumberText(a.tolerance) : LengthText(a.tolerance),
                               fmt::format("{}", fmt::join(a.train_clips, ", ")),
                               fmt::format("{}", fmt::join(a.test_clips, ", "))});
  }
  FactTable files{"files", {"file"}, {}};
  for (const std::string& file : rig.files) files.rows.push_back({file});
  facts.tables = {TreeFacts(*rig.character), std::move(meshes),     MorphFacts(*rig.character),
                  std::move(types),          std::move(clips),      MaterialFacts(*rig.character),
                  std::move(controls),       std::move(accelerate), std::move(files)};
  facts.notes = rig.notes;
  return facts;
}

}  // namespace kpsa::engine
