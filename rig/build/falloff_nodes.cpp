// Falloffs that vary: `falloff: NAME` of deformers. A falloff node measures the points as they come to the
// deformer, one element for each geometry of each deformer that names it.
#include <algorithm>
#include <set>

#include "rig/build/rig_build.h"

namespace kpsa::engine {
namespace {

constexpr int kMaxFalloffDepth = 64, kMaxFalloffUses = 1024;

}  // namespace

void RigBuild::ConnectFalloffs() {
  for (std::size_t m = 0; m < made_.size() && !errors_->full(); ++m) {
    const Made& made = made_[m];
    const auto it = made.special.find("falloff");
    if (it == made.special.end() || !it->second->value.is_scalar()) continue;
    const YamlNode& name = it->second->value;
    GraphEditor edit(&graph());
    if (!edit.Has(made.id, "falloffWeights")) {
      errors_->Add(name, "falloff: expected a falloff at rest, {{at: PLACE, radius: 5}}, found \"{}\"",
                   name.scalar);
      continue;
    }
    if (FindMade(name.scalar) == nullptr && !name.quoted && !name.scalar.empty() &&
        name.scalar.find_first_not_of("0123456789.+-") == std::string::npos) {
      errors_->Add(
          name, "falloff: expected {{at: PLACE, radius: 5}}, another shape, or the name of a falloff node");
      continue;
    }
    for (std::size_t g = 0; g < made.geometries.size(); ++g) {
      const std::optional<PlugRef> weights = FalloffOf(name, made, g, 0);
      if (!weights.has_value()) break;
      edit.Connect(*weights, edit.Plug(made.id, "falloffWeights", static_cast<int>(g)));
    }
    Fail(name.where(), edit.Take());
  }
}

// The weights that a falloff node gives the points of a deformer's geometry; none after an error.
std::optional<PlugRef> RigBuild::FalloffOf(const YamlNode& name, const Made& deformer, std::size_t geometry,
                                           int depth) {
  if (name.is_map() || name.is_sequence()) {
    errors_->Add(name, "expected the name of a falloff node, found {}", name.kind_name());
    return std::nullopt;
  }
  const std::optional<NodeId> found = FindWithOutputs(name, {"outputWeights"}, "falloff");
  if (!found.has_value()) return std::nullopt;
  Made& falloff = *FindMade(*found);
  if (depth > kMaxFalloffDepth || falloff_elements_[found->index] >= kMaxFalloffUses) {
    errors_->Add(name, "\"{}\" is made of itself, or used too often", name.scalar);
    return std::nullopt;
  }
  GraphEditor edit(&graph());
  if (edit.Has(*found, "weights")) {  // a map for this geometry
    std::vector<Geometry>& maps = falloff.geometries;
    const Geometry& of = deformer.geometries[geometry];
    auto map = std::find_if(maps.begin(), maps.end(), [&](const Geometry& m) { return m.name == of.name; });
    if (map == maps.end()) map = maps.insert(map, of);
    return edit.Plug(*found, "outputWeights", static_cast<int>(map - maps.begin()));
  }
  const auto g = static_cast<int>(geometry);
  const int element = falloff_elements_[found->index]++;
  const PlugRef weights = edit.Plug(*found, "outputWeights", element);
  if (edit.Has(*found, "inPoints")) {
    const PlugRef from = edit.Plug(deformer.id, "inPoints", g), to = edit.Plug(*found, "inPoints", element);
    if (const Connection* connection = graph().FindConnection(from)) {
      edit.Connect(PlugRef(connection->source), to);
    } else if (const Value* points = graph().FindValue(from)) {
      edit.Set(*found, "inPoints", element, Value(*points));
    }
    falloff_uses_.push_back({*found, deformer.id, element, g});
    return Fail(name.where(), edit.Take()) ? std::optional(weights) : std::nullopt;
  }
  const auto it = falloff.special.find("falloffs");
  if (it == falloff.special.end() || !it->second->value.is_sequence() ||
      it->second->value.items.size() != 2) {
    errors_->Add(it == falloff.special.end() ? name : it->second->value,
                 "\"{}\" ({}): expected two falloff nodes, falloffs: [a, b]", name.scalar,
                 graph().def(*found).name);
    return std::nullopt;
  }
  for (const std::size_t side : {0u, 1u}) {
    const std::optional<PlugRef> part =
        FalloffOf(it->second->value.items[side], deformer, geometry, depth + 1);
    if (!part.has_value()) return std::nullopt;
    edit.Connect(*part, edit.Plug(*found, side == 0 ? "input1" : "input2", element));
  }
  return Fail(name.where(), edit.Take()) ? std::optional(weights) : std::nullopt;
}

// Where the points of a stage in mesh space are, once that is known.
void RigBuild::PlaceFalloffs() {
  std::set<Index> refused;
  for (const FalloffUse& use : falloff_uses_) {
    const Made* deformer = FindMade(use.deformer);
    const Made* falloff = FindMade(use.falloff);
    if (deformer == nullptr || falloff == nullptr) continue;
    const Geometry& of = deformer->geometries[static_cast<std::size_t>(use.geometry)];
    const auto driver = falloff->special.find("driver");
    if (driver != falloff->special.end() && !FitsDriver(use.falloff, *deformer) &&
        refused.insert(use.falloff.index).second) {
      const YamlNode& name = driver->second->value;
      errors_->Add(
          name,
          "\"{}\" weighs {} in {}, and the driver \"{}\" is in {}: name a stage of the driver in the "
          "same space, or the parent that carries what is in mesh space",
          falloff->from->name, of.name, SpaceName(deformer->world), name.scalar, SpaceName(!deformer->world));
    }
    if (deformer->world) continue;
    GraphEditor edit(&graph());
    edit.Set(use.falloff, "geometryMatrix", use.element, of.world_from_stage);
    Fail(falloff->from->where, edit.Take());
  }
}

// Whether points and driver are measured in one space. In mesh space both are where they rest, unless a
// parent carries them.
bool RigBuild::FitsDriver(NodeId falloff, const Made& deformer) {
  GraphEditor edit(&graph());
  if (!edit.Has(falloff, "driverMatrix")) return true;
  const PlugRef parent = edit.Plug(falloff, "parentMatrix");
  const bool carried = graph().FindConnection(parent) != nullptr || graph().FindValue(parent) != nullptr;
  const bool world = graph().FindValue(edit.Plug(falloff, "driverMatrix")) == nullptr;
  return carried || world == deformer.world ||
         graph().FindConnection(edit.Plug(falloff, "driverPoints")) == nullptr;
}

}  // namespace kpsa::engine
