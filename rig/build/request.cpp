// What may vary and what is to be accelerated: controls and accelerate.
#include <algorithm>

#include "rig/build/rig_build.h"

namespace kpsa::engine {

void RigBuild::AddControls() {
  std::map<std::tuple<Index, int, int, int>, std::string> seen;
  for (const Control& control : rig_->controls)
    seen.emplace(std::make_tuple(control.plug.node.index, control.plug.attribute, control.plug.element,
                                 control.plug.component),
                 control.name);
  for (const RigControl& from : file_->controls) {
    if (errors_->full()) return;
    const Result<PlugRef> plug = graph().FindPlug(from.plug.text);
    if (!Fail(from.plug.where, plug.status())) continue;
    const AttributeDef& attribute =
        graph().def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
    const Type type = graph().PlugType(*plug);
    const std::string name = graph().PlugName(*plug);
    const auto refuse = [&](Status status) { Fail(from.plug.where, std::move(status)); };
    if (attribute.output || attribute.structural) {
      refuse(Status::Invalid("{} is {} and cannot be a control", name,
                             attribute.output ? "an output" : "structural (fixed when a plan is made)"));
      continue;
    }
    if (type != Type::kDouble && type != Type::kInt && type != Type::kBool && type != Type::kEnum) {
      refuse(Status::Invalid("{} is a {}; a control is one number{}", name, TypeName(type),
                             type == Type::kDouble3 ? ", as in " + name + ".x" : ""));
      continue;
    }
    if (attribute.type == Type::kPoints) {
      refuse(Status::Invalid(
          "{} is a part of points and cannot be a control: connect a transform's translate to "
          "the point and make that the control",
          name));
      continue;
    }
    const auto key = std::make_tuple(plug->node.index, plug->attribute, plug->element, plug->component);
    if (const auto [it, added] = seen.emplace(key, from.plug.text); !added) {
      refuse(Status::Invalid("\"{}\" and \"{}\" are the same control", from.plug.text, it->second));
      continue;
    }
    PlugRef whole = *plug;
    whole.component = -1;
    const bool by_clip = IsClipPlug(rig_->scene, graph(), *plug);
    const Connection* driver = graph().FindConnection(*plug);
    if (driver == nullptr) driver = graph().FindConnection(whole);
    const std::vector<NodeId>& clip_nodes = rig_->scene.clip_nodes;
    if (driver != nullptr &&
        std::find(clip_nodes.begin(), clip_nodes.end(), driver->source.node) == clip_nodes.end()) {
      refuse(Status::Invalid("{} is driven by {} and cannot be a control", name,
                             graph().PlugName(driver->source)));
      continue;
    }
    Control control;
    control.name = from.plug.text;
    control.plug = *plug;
    control.unit = attribute.unit;
    control.by_clip = by_clip;
    control.where = from.plug.where;
    const FileUnits& file_units = units(from.plug.source);
    bool good =
        ReadNumber(from.min, control.name + ".min", attribute.unit, file_units, &control.min, errors_);
    good = ReadNumber(from.max, control.name + ".max", attribute.unit, file_units, &control.max, errors_) &&
           good;
    if (!good) continue;
    if (control.min > control.max) {
      errors_->Add(from.min, "control \"{}\": min {} is above max {}", control.name, from.min.scalar,
                   from.max.scalar);
      continue;
    }
    if (control.min < attribute.min || control.max > attribute.max) {
      errors_->Add(from.min, "control \"{}\": {} only takes {} to {}", control.name, name, attribute.min,
                   attribute.max);
      continue;
    }
    if (const Value* value = graph().FindValue(*plug)) {
      control.value = value->AsDouble();
    } else {
      const Value* set = graph().FindValue(whole);
      const Value& base = set != nullptr ? *set : attribute.default_value;
      const Double3* triple = base.get_if<Double3>();
      control.value =
          triple != nullptr && plug->component >= 0 ? (*triple)[plug->component] : base.AsDouble();
    }
    rig_->controls.push_back(std::move(control));
  }
}

void RigBuild::AddAccelerations() {
  std::vector<std::string> clips;
  for (const CharacterClip& clip : rig_->scene.clips) clips.push_back(clip.id);
  const auto read_clips = [&](const std::vector<RigString>& names, std::vector<std::string>* to) {
    for (const RigString& name : names) {
      if (std::find(clips.begin(), clips.end(), name.text) == clips.end()) {
        Fail(name.where,
             Status::Invalid("the character has no clip \"{}\"{}", name.text, DidYouMean(name.text, clips)));
      }
      to->push_back(name.text);
    }
  };
  std::map<std::size_t, SourceLocation> by_mesh;
  for (const Acceleration& entry : rig_->accelerate) {
    for (const AcceleratedPoints& points : entry.points) {
      if (!points.colors) by_mesh.emplace(points.mesh, entry.where);
    }
  }
  for (const RigAccelerate& from : file_->accelerate) {
    Acceleration to;
    to.name = from.name;
    to.where = from.where;
    to.subspace = from.subspace;
    to.tolerance = from.tolerance.value_or(from.colors.empty() ? rig_->rest_diagonal / 2000 : 0.05);
    to.violation_rate = from.violation_rate;
    to.train_samples = from.train_samples;
    to.key_points = from.key_points;
    to.held_out = from.held_out;
    read_clips(from.train_clips, &to.train_clips);
    read_clips(from.test_clips, &to.test_clips);
    if (from.space.has_value()) to.space = FindTransform(from.space->text, from.space->where);
    for (RigAccelerate::Points points : from.points) {
      SplitStage(points.mesh + "@" + points.stage, &points.mesh, &points.stage);
      const std::optional<std::size_t> mesh_index = FindMesh(points.mesh, points.where);
      if (!mesh_index.has_value()) continue;
      const CharacterMesh& mesh = rig_->scene.meshes[*mesh_index];
      const Stage* stage = FindStage(mesh, points.stage, points.where);
      if (stage == nullptr) continue;
      if (const auto [it, added] = by_mesh.emplace(*mesh_index, points.where); !added) {
        Fail(points.where, Status::Invalid("points of \"{}\" are accelerated already, at {}", mesh.name,
                                           it->second.ToString()));
        continue;
      }
      to.points.push_back({*mesh_index, static_cast<std::size_t>(stage - mesh.stages.data()), stage->points});
      rig_->scene.meshes[*mesh_index].visible = true;  // what is accelerated is wanted
    }
    for (const RigString& name : from.colors) {
      const Result<PlugRef> plug = graph().FindPlug(name.text);
      if (!Fail(name.where, plug.status())) continue;
      const AttributeDef& attribute =
          graph().def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
      if (attribute.type != Type::kColors || !attribute.output || plug->component >= 0) {
        Fail(name.where, Status::Invalid("{} is a {}, no output of colours", name.text,
                                         TypeName(graph().PlugType(*plug))));
        continue;
      }
      to.points.push_back({0, 0, *plug, true});
    }
    if (to.train_samples > 0 && rig_->controls.empty()) {
      Fail(from.where,
           Status::Invalid(
               "accelerate \"{}\": train.samples draws poses from the controls, and the rig declares none",
               from.name));
    }
    rig_->accelerate.push_back(std::move(to));
  }
}

}  // namespace kpsa::engine
