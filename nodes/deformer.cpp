#include "nodes/deformer.h"

#include <cmath>

#include "graph/geometry.h"

namespace kpsa {

NodeBuilder AddDeformer(NodeRegistry& registry, std::string name, std::string doc) {
  NodeBuilder builder = registry.add(std::move(name), std::move(doc));
  builder.category("deformer");
  builder.points_in("inPoints", "the points to deform").per_geometry();
  builder.in("envelope", 1.0, {.min = 0, .max = 1, .doc = "0 leaves the points alone, 1 deforms them fully"});
  builder.in("parentMatrix", Matrix4(), {.doc = "carries the deformer's frame; `parent:` connects it"});
  builder.structural("weights", Type::kAsset, {.doc = "weight map times membership; 1 where unset"})
      .per_geometry();
  builder.structural("mesh", Type::kMesh, {.doc = "the topology of the geometry"}).per_geometry();
  builder.enumeration("space", {"world", "mesh"}, true,
                      "the space of the stage: mesh space before the skin, world space after it");
  builder
      .structural("geometryMatrix", Matrix4(),
                  {.doc = "world from mesh space at rest, for stages in mesh space"})
      .per_geometry();
  return builder;
}

NodeBuilder& FinishDeformer(NodeBuilder& builder, ComputeFn compute, BindFn bind, DemandFn demand) {
  builder.out("outPoints", Type::kPoints, "the deformed points").per_geometry();
  builder.compute(compute).in_place("inPoints");
  if (bind) builder.bind(std::move(bind));
  if (demand) builder.demand(std::move(demand));
  return builder;
}

std::vector<float> WeightsAt(const Structural& structural, const PointSet& points) {
  const WeightMap* map = structural.asset<WeightMap>("weights");
  if (map == nullptr) return {};
  std::vector<float> weights(points.size());
  for (Index i = 0; i < points.size(); ++i)
    weights[i] = points[i] < map->weights().size() ? map->weights()[points[i]] : 0.0f;
  return weights;
}

std::vector<float> BoundWeights(const Binding& binding) {
  return WeightsAt(binding.structural(), binding.output("outPoints"));
}

Result<ConstPointsView> RestPoints(const Structural& structural) {
  const Value* rest = structural.rest("inPoints");
  if (rest == nullptr || rest->points() == nullptr) return Status::Invalid("its input has no rest shape");
  return rest->points()->view();
}

Result<Matrix4> RestMatrix(const Structural& structural, std::string_view name) {
  const Value* rest = structural.rest(name);
  if (rest == nullptr || rest->get_if<Matrix4>() == nullptr)
    return Status::Invalid("{} has no value at rest", name);
  return rest->get<Matrix4>();
}

Result<CarriedFrame> CarriedFrame::Bind(const Structural& structural) {
  CarriedFrame frame;
  Result<Matrix4> parent = RestMatrix(structural, "parentMatrix");
  if (!parent.ok()) return parent.status();
  frame.fixed_ = structural.get_int("space") == 1;
  frame.parent_rest_ = *parent;
  if (!Invert(*parent, &frame.parent_rest_inverse_))
    return Status::Invalid("parentMatrix is singular at rest");
  if (frame.fixed_) {
    frame.world_from_stage_ = structural.value("geometryMatrix").get<Matrix4>();
    if (!Invert(frame.world_from_stage_, &frame.stage_from_world_))
      return Status::Invalid("geometryMatrix is singular");
  }
  return frame;
}

double CarriedFrame::Growth(const Matrix4& parent_now) const {
  const double growth = std::cbrt(std::fabs(Determinant3(Motion(parent_now))));
  return std::fabs(growth - 1) < 1e-9 ? 1 : growth;
}

}  // namespace kpsa
