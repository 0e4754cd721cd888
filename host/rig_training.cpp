#include "host/rig_training.h"

#include <algorithm>
#include <set>

#include "host/clip_controls.h"
#include "host/rig_frames.h"
#include "rig/build/starter_training.h"

namespace kpsa::engine {

std::vector<PlugRef> VaryingPlugs(const Rig& rig) {
  std::vector<PlugRef> plugs{rig.scene.time};
  for (const Control& control : rig.controls) {
    PlugRef whole = control.plug;
    whole.component = -1;
    if (rig.graph->FindConnection(control.plug) != nullptr || rig.graph->FindConnection(whole) != nullptr)
      continue;
    plugs.push_back(control.plug);
  }
  return plugs;
}

namespace {

// Where the value of a control can be read that would give what a clip does: a clip drives morph weights
// themselves, and moves joints underneath their rotate and translate.
std::optional<PlugRef> ShownByClip(const Graph& graph, const PlugRef& plug, bool by_clip) {
  if (by_clip) return plug;
  const NodeDef& def = graph.def(plug.node);
  const std::string& attribute = def.attributes[static_cast<std::size_t>(plug.attribute)].name;
  PlugRef shown = plug;
  shown.attribute = def.FindAttribute(attribute == "rotate"      ? "poseRotate"
                                      : attribute == "translate" ? "poseTranslate"
                                      : attribute == "scale"     ? "poseScale"
                                                                 : "");
  if (shown.attribute < 0) return std::nullopt;
  return shown;
}

// Of a transform's angles.
std::optional<RotateOrder> OrderOf(const Graph& graph, const PlugRef& plug) {
  const NodeDef& def = graph.def(plug.node);
  const int order = def.FindAttribute("rotateOrder");
  if (order < 0 || def.attributes[static_cast<std::size_t>(plug.attribute)].name != "rotate")
    return std::nullopt;
  const Value* set = graph.FindValue({plug.node, order, -1, -1});
  const Value& value = set != nullptr ? *set : def.attributes[static_cast<std::size_t>(order)].default_value;
  return static_cast<RotateOrder>(value.AsInt());
}

// Where light is measured by fewer paths than pictures have: keySamples of its node.
std::optional<PlugRef> KeyLight(const Graph& graph, PlugRef light) {
  const NodeDef& def = graph.def(light.node);
  const std::string& name = def.attributes[static_cast<std::size_t>(light.attribute)].name;
  const int samples = def.FindAttribute("keySamples");
  light.attribute = def.FindAttribute(name == "irradiance"        ? "keyIrradiance"
                                      : name == "pointIrradiance" ? "keyPointIrradiance"
                                                                  : "");
  if (samples < 0 || light.attribute < 0) return std::nullopt;
  const Value* set = graph.FindValue({light.node, samples, -1, -1});
  const Value& value =
      set != nullptr ? *set : def.attributes[static_cast<std::size_t>(samples)].default_value;
  return value.AsInt() > 0 ? std::optional(light) : std::nullopt;
}

}  // namespace

AccelerationTarget MakeTarget(const Rig& rig, const AccelerateEntry& entry) {
  AccelerationTarget target;
  if (entry.reference >= 0) {
    const Reference& reference = rig.references[static_cast<std::size_t>(entry.reference)];
    target.within = {reference.name_space, reference.root};
  }
  for (const AcceleratedPoints& points : entry.points) {
    AccelerationTarget::MeshPoints out;
    if (points.colors) {
      out.name = target.within.Inner(rig.graph->PlugName(points.points));
      if (const std::optional<PlugRef> key = KeyLight(*rig.graph, points.points))
        out.stages.push_back({"key", *key, false});
      out.stages.push_back({"colors", points.points, false});
      target.meshes.push_back(std::move(out));
      target.colors = true;
      continue;
    }
    const CharacterMesh& mesh = rig.scene.meshes[points.mesh];
    for (std::size_t s = 0; s <= points.stage; ++s) {
      const Stage& stage = mesh.stages[s];
      out.stages.push_back({stage.name, stage.points, stage.world});
    }
    out.name = target.within.Inner(mesh.name + "@" + mesh.stages[points.stage].name);
    target.meshes.push_back(std::move(out));
  }
  for (const CharacterMesh& mesh : rig.scene.meshes) {
    for (const Stage& stage : mesh.stages)
      target.all_stages.push_back({stage.name, stage.points, stage.world});
  }
  if (entry.space) {
    const NodeDef& def = rig.graph->def(*entry.space);
    target.space.push_back({*entry.space, def.FindAttribute("worldMatrix"), -1, -1});
    target.space_name = target.within.Inner(rig.graph->name(*entry.space));
  } else if (entry.reference >= 0) {
    const NodeId root = target.within.root;
    target.space.push_back({root, rig.graph->def(root).FindAttribute("worldMatrix"), -1, -1});
  }
  target.varying = VaryingPlugs(rig);
  for (const Control& control : rig.controls) target.controls.push_back(control.plug);
  return target;
}

TrainingRig MakeTrainingRig(Rig* rig, const AccelerateEntry& entry) {
  TrainingRig training;
  training.graph = rig->graph.get();
  training.time = rig->scene.time;
  training.target = MakeTarget(*rig, entry);
  // The transforms from the space up to the root
  std::set<Index> carriers;
  for (NodeId node = entry.space.value_or(NodeId());
       rig->graph->IsAlive(node) && carriers.insert(node.index).second;) {
    const Connection* parent =
        rig->graph->FindConnection({node, rig->graph->def(node).FindAttribute("parentMatrix"), -1, -1});
    if (parent == nullptr) break;
    node = parent->source.node;
  }
  for (const Control& control : rig->controls) {
    const NodeDef& def = rig->graph->def(control.plug.node);
    if (def.attributes[static_cast<std::size_t>(control.plug.attribute)].diagnostic) continue;
    training.controls.push_back({control.plug, control.min, control.max, control.value, control.by_clip,
                                 carriers.count(control.plug.node.index) != 0,
                                 ShownByClip(*rig->graph, control.plug, control.by_clip)});
    training.controls.back().turns = OrderOf(*rig->graph, control.plug);
    // The attribute's own limits; what counts or chooses has no values in between
    const AttributeDef& attribute = def.attributes[static_cast<std::size_t>(control.plug.attribute)];
    const Type type = rig->graph->PlugType(control.plug);
    const bool whole = type == Type::kInt || type == Type::kBool || type == Type::kEnum;
    training.controls.back().lowest = whole ? control.min : attribute.min;
    training.controls.back().highest = whole ? control.max : attribute.max;
  }
  training.by_clips = ControlsOfClips(*rig);
  for (ControlRange& control : training.by_clips) {
    control.often = carriers.contains(control.plug.node.index);
    control.shown = ShownByClip(*rig->graph, control.plug, control.by_clip);
    control.turns = OrderOf(*rig->graph, control.plug);
  }
  training.set_clip = [rig](std::optional<std::string_view> clip) { return SetClip(rig, clip); };
  return training;
}

namespace {

std::size_t ChosenSamples(const Rig& rig, const AccelerateEntry& entry) {
  const bool light = std::ranges::any_of(entry.points, &AcceleratedPoints::colors);
  const std::size_t controls = rig.controls.size() + ControlsOfClips(rig).size();
  if (light || controls == 0) return 0;
  std::size_t frames = 0;
  if (const auto clips = ClipFrames(rig, entry.train_clips); clips.ok()) {
    for (const TrainingClip& clip : *clips) frames += clip.times.size();
  }
  return static_cast<std::size_t>(StarterSamples(controls, static_cast<std::int64_t>(frames)));
}

}  // namespace

TrainOptions TrainOptionsOf(const Rig& rig, const AccelerateEntry& entry) {
  TrainOptions options;
  options.samples = entry.train_samples.has_value() ? static_cast<std::size_t>(*entry.train_samples)
                                                    : ChosenSamples(rig, entry);
  options.calibration_poses = static_cast<std::size_t>(entry.calibration_poses);
  if (entry.key_points > 0)
    options.key_points = options.min_points = static_cast<std::size_t>(entry.key_points);
  options.tolerance = entry.tolerance;
  options.violation_rate = entry.violation_rate;
  return options;
}

Result<std::vector<TrainingClip>> ClipFrames(const Rig& rig, const std::vector<std::string>& clips) {
  std::vector<TrainingClip> frames;
  for (const std::string& name : clips) {
    const CharacterClip* found = nullptr;
    for (const CharacterClip& clip : rig.scene.clips) {
      if (clip.id == name) found = &clip;
    }
    if (found == nullptr) return NoSuchClip(rig.scene, name);
    Result<std::vector<double>> times = FramesBetween(name, found->begin, found->duration, rig.fps);
    if (!times.ok()) return times.status();
    frames.push_back({name, std::move(*times)});
  }
  return frames;
}

std::vector<std::string> TestClips(const Rig& rig) {
  std::vector<std::string> clips;
  for (const AccelerateEntry& entry : rig.accelerate) {
    for (const std::string& clip : entry.test_clips) {
      if (std::ranges::find(clips, clip) == clips.end()) clips.push_back(clip);
    }
  }
  return clips;
}

Result<AccelerateEntry> ChooseEntry(const Rig& rig, const std::optional<std::string>& name) {
  if (rig.accelerate.empty())
    return Status::Invalid(
               "has no accelerate section, so nothing to train; kpsa init writes a rig that has one")
        .At({rig.path});
  std::vector<std::string> names;
  for (const AccelerateEntry& entry : rig.accelerate) names.push_back(entry.name);
  if (!name.has_value() && names.size() > 1)
    return Status::Usage("the rig accelerates {}: expected the name of one of them", fmt::join(names, ", "));
  const auto found = name.has_value() ? std::find(names.begin(), names.end(), *name) : names.begin();
  if (found == names.end())
    return Status::Usage("\"{}\": the rig accelerates {}{}", *name, fmt::join(names, ", "),
                         DidYouMean(*name, names));
  const AccelerateEntry& entry = rig.accelerate[static_cast<std::size_t>(found - names.begin())];
  if (entry.reference >= 0) {
    return Status::Usage(
        "accelerate: \"{}\" is an entry of {}: train that rig; its subspace serves here, too", entry.name,
        rig.references[static_cast<std::size_t>(entry.reference)].file);
  }
  return entry;
}

}  // namespace kpsa::engine
