#include "rig/build/steps/add_accelerate_entries.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

namespace kpsa::engine {

void AddAccelerateEntries(const BuildInput& in, CharacterGraph* scene, std::vector<AccelerateEntry>* entries,
                          std::vector<std::string>* notes) {
  std::vector<std::string> clips;
  for (const CharacterClip& clip : in.rig.scene.clips) clips.push_back(clip.id);
  const auto read_clips = [&](const std::vector<RigString>& names, std::vector<std::string>* to) {
    for (const RigString& name : names) {
      if (std::find(clips.begin(), clips.end(), name.text) == clips.end()) {
        in.Fail(name.where, Status::Invalid("the character has no clip \"{}\"{}", name.text,
                                            DidYouMean(name.text, clips)));
      }
      to->push_back(name.text);
    }
  };
  std::map<std::size_t, SourceLocation> by_mesh;
  for (const AccelerateEntry& entry : *entries) {
    for (const AcceleratedPoints& points : entry.points) {
      if (!points.colors) by_mesh.emplace(points.mesh, entry.where);
    }
  }
  // Of this rig alone: two heroes of one reference share theirs
  std::map<std::string, std::string> by_file;
  for (const RigAccelerateEntry& from : in.file.accelerate) {
    AccelerateEntry to;
    to.name = from.name;
    to.where = from.where;
    to.subspace = from.subspace;
    if (const auto [it, added] =
            by_file.emplace(std::filesystem::path(to.subspace).lexically_normal().string(), from.name);
        !added && !to.subspace.empty()) {
      notes->push_back(fmt::format(
          "{}: accelerate \"{}\" and \"{}\" have one subspace file: to train one overwrites the other; "
          "give each its own",
          from.where.ToString(), it->second, from.name));
    }
    to.tolerance = from.tolerance.value_or(from.colors.empty() ? in.rig.rest_diagonal / 2000 : 0.05);
    to.violation_rate = from.violation_rate;
    to.train_samples = from.train_samples;
    to.key_points = from.key_points;
    to.calibration_poses = from.calibration_poses;
    read_clips(from.train_clips, &to.train_clips);
    read_clips(from.test_clips, &to.test_clips);
    if (from.space.has_value()) to.space = in.names.FindTransform(from.space->text, from.space->where);
    for (RigAccelerateEntry::Points points : from.points) {
      in.names.SplitStage(points.mesh + "@" + points.stage, &points.mesh, &points.stage);
      const std::optional<std::size_t> mesh_index = in.names.FindMesh(points.mesh, points.where);
      if (!mesh_index.has_value()) continue;
      const CharacterMesh& mesh = in.rig.scene.meshes[*mesh_index];
      const Stage* stage = in.names.FindStage(mesh, points.stage, points.where);
      if (stage == nullptr) continue;
      if (stage == &mesh.at_rest) {
        in.Fail(points.where,
                Status::Invalid("\"{}\" rests there: there is nothing to accelerate", mesh.name));
        continue;
      }
      if (const auto [it, added] = by_mesh.emplace(*mesh_index, points.where); !added) {
        in.Fail(points.where, Status::Invalid("points of \"{}\" are accelerated already, at {}", mesh.name,
                                              it->second.ToString()));
        continue;
      }
      to.points.push_back({*mesh_index, static_cast<std::size_t>(stage - mesh.stages.data()), stage->points});
      scene->meshes[*mesh_index].visible = true;  // what is accelerated is wanted
    }
    for (const RigString& name : from.colors) {
      const Result<PlugRef> plug = in.graph().FindPlug(name.text);
      if (!in.Fail(name.where, plug.status())) continue;
      const AttributeDef& attribute =
          in.graph().def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
      if (attribute.type != Type::kColors || !attribute.output || plug->component >= 0) {
        in.Fail(name.where, Status::Invalid("{} is a {}, no output of colours", name.text,
                                            TypeName(in.graph().PlugType(*plug))));
        continue;
      }
      to.points.push_back({0, 0, *plug, true});
    }
    if (to.train_samples.value_or(0) > 0 && in.rig.controls.empty()) {
      in.Fail(from.where,
              Status::Invalid(
                  "accelerate \"{}\": train.samples draws poses from the controls, and the rig declares none",
                  from.name));
    }
    entries->push_back(std::move(to));
  }
}

}  // namespace kpsa::engine
