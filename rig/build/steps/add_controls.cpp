#include "rig/build/steps/add_controls.h"

#include <algorithm>
#include <map>

#include "rig/build/control_plugs.h"
#include "rig/build/plug_keys.h"

namespace kpsa::engine {

void AddControls(const BuildInput& in, std::vector<Control>* controls) {
  std::map<PlugKey, std::string> seen;
  for (const Control& control : *controls) seen.emplace(KeyOf(control.plug), control.name);
  for (const RigControl& from : in.file.controls) {
    if (in.errors->full()) return;
    const Result<PlugRef> plug = in.graph().FindPlug(from.plug.text);
    if (!in.FailPlug(from.plug.where, from.plug.text, plug.status())) continue;
    const AttributeDef& attribute =
        in.graph().def(plug->node).attributes[static_cast<std::size_t>(plug->attribute)];
    const Type type = in.graph().PlugType(*plug);
    const std::string name = in.graph().PlugName(*plug);
    const auto refuse = [&](Status status) { in.Fail(from.plug.where, std::move(status)); };
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
          from.plug.text));
      continue;
    }
    if (const auto [it, added] = seen.emplace(KeyOf(*plug), from.plug.text); !added) {
      refuse(Status::Invalid("\"{}\" and \"{}\" are the same control", from.plug.text, it->second));
      continue;
    }
    const bool by_clip = IsClipPlug(in.rig.scene, in.graph(), *plug);
    if (const Connection* driver = DriverBesidesClips(in.rig.scene, in.graph(), *plug)) {
      refuse(Status::Invalid("{} is driven by {} and cannot be a control", name,
                             in.graph().PlugName(driver->source)));
      continue;
    }
    Control control;
    control.name = from.plug.text;
    control.plug = *plug;
    control.unit = attribute.unit;
    control.by_clip = by_clip;
    control.where = from.plug.where;
    const FileUnits& file_units = in.units(from.plug.source);
    bool good =
        ReadNumber(from.min, control.name + ".min", attribute.unit, file_units, &control.min, in.errors);
    good = ReadNumber(from.max, control.name + ".max", attribute.unit, file_units, &control.max, in.errors) &&
           good;
    if (!good) continue;
    if (control.min > control.max) {
      in.errors->Add(from.min, "control \"{}\": min {} is above max {}", control.name, from.min.scalar,
                     from.max.scalar);
      continue;
    }
    if (control.min < attribute.min || control.max > attribute.max) {
      in.errors->Add(from.min, "control \"{}\": {} only takes {} to {}", control.name, name, attribute.min,
                     attribute.max);
      continue;
    }
    control.value = RestValueOf(in.graph(), *plug);
    controls->push_back(std::move(control));
  }
}

}  // namespace kpsa::engine
