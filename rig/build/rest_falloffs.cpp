#include "rig/build/rest_falloffs.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/falloff_shapes.h"
#include "base/triangle_tree.h"
#include "rig/file/values.h"

namespace kpsa::engine {
namespace {

constexpr const char* kFalloffKinds =
    "{at: PLACE, radius: 5}, {sphere: ...}, {capsule: ...}, {plane: ...}, {proximity: ...}, {weights: ...}, "
    "{combine: multiply, of: [...]} or a list of them";

}  // namespace

bool RestFalloffs::Multiply(const RigAttribute& attribute, const MadeNode& made, const DeformedGeometry& of,
                            std::vector<float>* weights) const {
  Falloff falloff;
  if (!Read(attribute.value, attribute.source, made, of, &falloff)) return false;
  for (std::size_t p = 0; falloff.has_value() && p < weights->size(); ++p)
    (*weights)[p] *= static_cast<float>((*falloff)[p]);
  return true;
}

bool RestFalloffs::Read(const YamlNode& node, int source, const MadeNode& made, const DeformedGeometry& of,
                        Falloff* falloff) const {
  if (node.is_sequence()) return Combine(node, "multiply", source, made, of, falloff);
  if (!node.is_map() || node.keys.empty())
    return in_.errors->Add(node, "falloff: expected {}", kFalloffKinds);
  std::string kind = "sphere";
  const YamlNode* shape = &node;
  if (node.Find("of") != nullptr || node.Find("combine") != nullptr) {
    YamlMap map(node, "falloff", in_.errors);
    const YamlNode* combine = map.Find("combine");
    const YamlNode* list = map.Required("of");
    map.RejectUnread();
    std::string how = "multiply";
    if (list == nullptr || (combine != nullptr && !ReadString(*combine, "combine", &how, in_.errors)))
      return false;
    if (how != "multiply" && how != "max" && how != "add")
      return in_.errors->Add(*combine, "combine: expected multiply, max or add, found \"{}\"", how);
    return Combine(*list, how, source, made, of, falloff);
  }
  if (node.Find("at") == nullptr && node.Find("radius") == nullptr) {
    YamlMap map(node, "falloff", in_.errors);
    const YamlNode* found[5];
    const char* kinds[] = {"sphere", "capsule", "plane", "proximity", "weights"};
    int count = 0;
    for (std::size_t k = 0; k < 5; ++k) {
      found[k] = map.Find(kinds[k]);
      if (found[k] == nullptr) continue;
      ++count;
      kind = kinds[k];
      shape = found[k];
    }
    map.RejectUnread();
    if (count != 1) return in_.errors->Add(node, "falloff: expected one of {}", kFalloffKinds);
  }
  if (kind == "weights") {
    const WeightFile* file = nullptr;
    const NamedWeights* values = nullptr;
    const DeformedGeometry* owner = nullptr;
    if (!maps_->FindMap(*shape, "weights", source, made, &file, &values, &owner)) return false;
    if (owner->name != of.name) return true;
    const std::vector<float> by_point = maps_->ByPoint(*file, *values, of);
    falloff->emplace(by_point.begin(), by_point.end());
    return true;
  }
  if (!of.mesh.has_value()) return in_.errors->Add(node, "falloff: {} is no mesh", of.name);
  std::function<double(Double3)> weight_at;
  if (!ReadShape(kind, *shape, source, of, &weight_at)) return false;
  falloff->emplace();
  for (const Double3& p : rest_->WorldPoints(*of.mesh)) (*falloff)->push_back(weight_at(p));
  return true;
}

bool RestFalloffs::Combine(const YamlNode& list, const std::string& how, int source, const MadeNode& made,
                           const DeformedGeometry& of, Falloff* falloff) const {
  if (!list.is_sequence() || list.items.empty())
    return in_.errors->Add(list, "of: expected a list of falloffs, found {}",
                           list.is_sequence() ? "an empty one" : list.kind_name());
  bool good = true;
  for (const YamlNode& item : list.items) {
    Falloff one;
    good = Read(item, source, made, of, &one) && good;
    if (!good || !one.has_value()) continue;
    if (!falloff->has_value()) {
      *falloff = std::move(one);
      continue;
    }
    for (std::size_t p = 0; p < one->size(); ++p) {
      double& sum = (**falloff)[p];
      const double next = (*one)[p];
      sum = how == "multiply" ? sum * next : how == "max" ? std::max(sum, next) : std::min(sum + next, 1.0);
    }
  }
  return good;
}

// The lengths, places and the curve of one falloff, as a function of a place in the world at rest.
bool RestFalloffs::ReadShape(const std::string& kind, const YamlNode& node, int source,
                             const DeformedGeometry& of, std::function<double(Double3)>* weight_at) const {
  YamlMap map(node, kind == "sphere" ? "falloff" : kind, in_.errors);
  bool good = true;
  const auto place = [&](const char* key) {
    const YamlNode* value = map.Required(key);
    Double3 at;
    good = value != nullptr && places_->Read(*value, source, &at) && good;
    return at;
  };
  const auto length = [&](const char* key, bool above_zero) {
    const YamlNode* value = map.Required(key);
    double number = 0;
    good = value != nullptr &&
           ReadNumber(*value, key, Unit::kLength, in_.units(source), &number, in_.errors) && good;
    if (good && above_zero && !(number > 0))
      good = in_.errors->Add(*value, "{}: expected a length above 0, found {}", key, value->scalar);
    return number;
  };
  FalloffFade fade = FalloffFade::kSmooth;
  if (const YamlNode* curve = map.Find("curve"); curve != nullptr) {
    std::string name;
    good = ReadString(*curve, "curve", &name, in_.errors);
    if (good && name != "smooth" && name != "linear")
      good = in_.errors->Add(*curve, "curve: expected smooth or linear, found \"{}\"", name);
    if (name == "linear") fade = FalloffFade::kLinear;
  }
  if (kind == "sphere") {
    const Double3 center = place("at");
    const double radius = length("radius", true);
    *weight_at = [=](Double3 p) { return DistanceFalloff(Length(p - center), radius, fade); };
  } else if (kind == "capsule") {
    const Double3 from = place("from"), to = place("to");
    const double radius = length("radius", true);
    *weight_at = [=](Double3 p) { return CapsuleFalloff(p, from, to, radius, fade); };
  } else if (kind == "plane") {
    const Double3 at = place("at");
    const YamlNode* direction = map.Required("normal");
    std::vector<double> numbers;
    good = direction != nullptr &&
           ReadNumbers(*direction, "normal", Unit::kNone, in_.units(source), 3, &numbers, in_.errors) && good;
    const double from = length("from", false), to = length("to", false);
    Double3 normal;
    if (good) normal = {numbers[0], numbers[1], numbers[2]};
    const double size = Length(normal);
    if (good && !(size > 0 && std::isfinite(size)))
      good = in_.errors->Add(*direction, "normal: expected a direction, not of length {}", size);
    if (good && from == to)
      good = in_.errors->Add(node, "plane: from and to are both {}, expected two heights", from);
    if (good) normal = normal * (1 / size);
    *weight_at = [=](Double3 p) { return PlaneFalloff(p, at, normal, from, to, fade); };
  } else {
    const YamlNode* mesh = map.Required("mesh");
    const double radius = length("radius", true);
    std::string name;
    good = mesh != nullptr && ReadString(*mesh, "mesh", &name, in_.errors) && good;
    const std::optional<std::size_t> index = good ? in_.names.FindMesh(name, mesh->where()) : std::nullopt;
    if (index.has_value() && index == of.mesh)
      good = in_.errors->Add(*mesh, "proximity: every point of {} is on it: name another mesh", of.name);
    if (index.has_value() && in_.rig.scene.meshes[*index].mesh().data().triangles.empty())
      good = in_.errors->Add(*mesh, "proximity: \"{}\" has no faces", name);
    good = good && index.has_value();
    if (good) {
      const PointBuffer rest = PointBuffer::FromPlaces(rest_->WorldPoints(*index));
      const auto surface =
          std::make_shared<TriangleTree>(rest.view(), in_.rig.scene.meshes[*index].mesh().data().triangles);
      *weight_at = [=](Double3 p) {
        const SurfacePoint near = surface->Closest(p);
        return near.triangle == kNoIndex ? 0 : DistanceFalloff(std::sqrt(near.squared), radius, fade);
      };
    }
  }
  map.RejectUnread();
  return good;
}

}  // namespace kpsa::engine
