// How stages before a skin lie in the world at rest. Their points are in mesh space, their handles, curves
// and boxes in the world: world_from_stage says what is where, as the skin does at rest at those points.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/matrix.h"
#include "rig/build/rig_build.h"

namespace kpsa::engine {
namespace {

// Equal up to the rounding of matrices that files hold as floats.
bool Near(const Matrix4& a, const Matrix4& b) {
  double largest = 0, apart = 0;
  for (std::size_t i = 0; i < a.m.size(); ++i) {
    largest = std::max(largest, std::fabs(a.m[i]));
    apart = std::max(apart, std::fabs(a.m[i] - b.m[i]));
  }
  return apart <= 1e-5 * largest;
}

}  // namespace

const WeightMap* RigBuild::WeightsOf(const Made& made, std::size_t geometry) {
  GraphEditor edit(&graph());
  const Value* map = graph().FindValue(edit.Plug(made.id, "weights", static_cast<int>(geometry)));
  return map == nullptr ? nullptr : map->asset<WeightMap>();
}

void RigBuild::SetWorldFromStage(Made* made, std::size_t geometry, const Matrix4& world_from_stage) {
  made->geometries[geometry].world_from_stage = world_from_stage;
  GraphEditor edit(&graph());
  if (!edit.Has(made->id, "geometryMatrix")) return;
  edit.Set(made->id, "geometryMatrix", static_cast<int>(geometry), world_from_stage);
  Fail(made->from->where, edit.Take());
}

// As the skin carries the deformer's members.
void RigBuild::PlaceStages() {
  for (Made& made : made_) {
    for (std::size_t g = 0; g < made.geometries.size() && !made.world; ++g) {
      const Geometry& of = made.geometries[g];
      if (!of.mesh.has_value()) continue;
      const WeightMap* weights = WeightsOf(made, g);
      SetWorldFromStage(
          &made, g,
          rest_->WorldFromMesh(*of.mesh, weights == nullptr ? std::vector<float>() : weights->weights()));
    }
  }
}

// Where a deformer has a handle or a curve, as the skin carries the points that are nearest to it: a handle
// at a vertex then moves that vertex fully, wherever the rest pose has taken it.
void RigBuild::PlaceStagesAtHandles() {
  for (Made& made : made_) {
    if (made.world || errors_->full()) continue;
    const std::optional<Places> places = HandlePlaces(made);
    for (std::size_t g = 0; g < made.geometries.size() && places.has_value(); ++g) {
      if (const std::optional<std::size_t> mesh = made.geometries[g].mesh)
        SetWorldFromStage(&made, g, rest_->WorldFromMeshAt(*mesh, *places, made.geometries[g].morphed));
    }
  }
}

// In the world at rest: the vertices of a wire's curve, the centre of a softMod, the transform that moves a
// cluster. None where the deformer has nothing like it, or where a computation places it.
std::optional<RigBuild::Places> RigBuild::HandlePlaces(const Made& made) {
  if (made.geometries.empty()) return std::nullopt;
  const NodeDef& def = graph().def(made.id);
  GraphEditor edit(&graph());
  if (def.name == "wire") {
    Places places;
    const auto add = [&](const PlugRef& plug) {
      const Value* curve = graph().FindValue(plug);
      const Curve* asset = curve == nullptr ? nullptr : curve->asset<Curve>();
      if (asset != nullptr) places.insert(places.end(), asset->cvs().begin(), asset->cvs().end());
    };
    const PlugRef several = edit.Plug(made.id, "baseWire", 0);
    for (int i = 0; i < graph().ArraySize(made.id, several.attribute); ++i)
      add({several.node, several.attribute, i, -1});
    if (places.empty()) add(edit.Plug(made.id, "curve"));
    return places.empty() ? std::nullopt : std::optional(std::move(places));
  }
  if (edit.Has(made.id, "falloffCenter")) {
    if (const Value* center = graph().FindValue(edit.Plug(made.id, "falloffCenter")))
      return Places{center->get<Double3>()};
  }
  if (def.name != "cluster" && def.name != "softMod") return std::nullopt;
  const Connection* handle = graph().FindConnection(edit.Plug(made.id, "matrix"));
  if (handle == nullptr || graph().def(handle->source.node).FindAttribute("offsetParentMatrix") < 0)
    return std::nullopt;
  Matrix4 world;
  if (!RestWorld(handle->source.node, made.from->type_node, 0, &world)) return std::nullopt;
  return Places{{world(0, 3), world(1, 3), world(2, 3)}};
}

// The lattice's box at rest, in the axes of its stage. Where the rig does not set it, it is set here to what
// the members fill.
bool RigBuild::BoxOfMembers(Made* lattice, const SourceLocation& where, Matrix4* world_from_box) {
  GraphEditor edit(&graph());
  const PlugRef min_plug = edit.Plug(lattice->id, "boxMin"), max_plug = edit.Plug(lattice->id, "boxMax");
  if (!edit.ok()) return Fail(where, edit.Take());
  const Value* min_set = graph().FindValue(min_plug);
  const Value* max_set = graph().FindValue(max_plug);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Double3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  const Matrix4 world_from_stage =
      lattice->geometries.empty() ? Matrix4() : lattice->geometries.front().world_from_stage;
  for (std::size_t g = 0; g < lattice->geometries.size(); ++g) {
    if (!Near(lattice->geometries[g].world_from_stage, world_from_stage)) {
      return Fail(where,
                  Status::Invalid("\"{}\" deforms {} and {} under different skins, so its points have no "
                                  "one place: give each a lattice of its own",
                                  lattice->from->name, lattice->geometries.front().name,
                                  lattice->geometries[g].name));
    }
    const std::optional<std::size_t> mesh = lattice->geometries[g].mesh;
    if (!mesh.has_value()) continue;
    const WeightMap* weights = WeightsOf(*lattice, g);
    const Places points =
        lattice->world ? rest_->WorldPoints(*mesh) : rest_->MeshPoints(*mesh, lattice->geometries[g].morphed);
    for (std::size_t p = 0; p < points.size(); ++p) {
      if (weights != nullptr && !(weights->weights()[p] > 0)) continue;
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], points[p][i]);
        high[i] = std::max(high[i], points[p][i]);
      }
    }
  }
  if (min_set != nullptr) low = min_set->get<Double3>();
  if (max_set != nullptr) high = max_set->get<Double3>();
  if (!(low.x <= high.x)) {
    return Fail(
        where,
        Status::Invalid(
            "\"{}\" has no members, so its points have no place: put it in a stack or set boxMin and boxMax",
            lattice->from->name));
  }
  if (min_set == nullptr && max_set == nullptr) {
    // A hair wider than the members, as the lattice makes it by itself
    const double margin = 1e-4 * Length(high - low) + 1e-9;
    for (int i = 0; i < 3; ++i) low[i] -= margin, high[i] += margin;
  }
  edit.Set(lattice->id, "boxMin", low);
  edit.Set(lattice->id, "boxMax", high);
  *world_from_box = world_from_stage * Translation(low) * Scaling(high - low);
  return Fail(where, edit.Take());
}

}  // namespace kpsa::engine
