#include "nodes/delta_mush_step.h"

#include <utility>

#include "nodes/deformer.h"
#include "nodes/kernels/delta_mush_step.h"
#include "nodes/mesh_topology.h"

namespace kpsa::engine {
namespace {

// Of a Run, where the whole mush costs what delta_mush.cpp says: 6.2 in a loop by itself, half as much again behind tiles,
// which leave nothing of its data in the cache (kpsa bench: reconstruction).
constexpr float kPointNs = 9;

class MushPart final : public LastStep::Bound {
 public:
  explicit MushPart(DeltaMushStep::Part part) : part_(std::move(part)) {}
  const std::vector<Index>& inner() const override { return part_.inner(); }
  std::size_t scratch_floats() const override { return part_.ScratchFloats(); }
  void Run(ConstPointsView inner, PointsView out, std::span<float> scratch) const noexcept override {
    part_.Run(inner, out, scratch);
  }

 private:
  DeltaMushStep::Part part_;
};

class MushStep final : public LastStep {
 public:
  MushStep(Value mesh, DeltaMushStep step) : mesh_(std::move(mesh)), step_(std::move(step)) {}
  std::size_t points() const override { return step_.points(); }
  std::size_t inner_points() const override { return step_.inner_points(); }
  Index PointOf(Index inner) const override { return step_.PointOf(inner); }
  float cost_ns() const override { return kPointNs * static_cast<float>(points()); }
  void Inner(ConstPointsView in, PointsView inner) const override { step_.Inner(in, inner); }
  std::unique_ptr<const Bound> Bind(const PointSet& out) const override {
    return std::make_unique<MushPart>(step_.Bind(out.ToVector()));
  }
  std::vector<Index> InnerOf(const PointSet& out) const override { return step_.InnerOf(out.ToVector()); }

 private:
  Value mesh_;  // keeps the topology
  DeltaMushStep step_;
};

Result<double> RestNumber(const Structural& structural, std::string_view name) {
  const Value* rest = structural.rest(name);
  if (rest == nullptr) return Status::Invalid("{} has no value at rest", name);
  return rest->AsDouble();
}

}  // namespace

DeltaMushSettings MushSettings(const Structural& structural) {
  return {structural.get_int("iterations"), structural.get_double("smoothingStep"),
          structural.get_double("distanceWeight"), structural.get_bool("pinBorderVertices")};
}

Result<std::shared_ptr<const LastStep>> MushLastStep(const Structural& structural) {
  const std::shared_ptr<const LastStep> none;
  if (structural.is_set("falloffWeights")) return none;
  const DeltaMushSettings settings = MushSettings(structural);
  KPSA_RETURN_IF_ERROR(settings.Validate());
  Status error;
  const Topology* topology = TopologyOf(structural.asset<Mesh>("mesh"), &error);
  if (topology == nullptr) return error;
  const Result<ConstPointsView> rest = RestPoints(structural);
  if (!rest.ok()) return rest.status();
  if (topology->point_count() != rest->count)
    return Status::Invalid("its mesh has {} points, the geometry {}", topology->point_count(), rest->count);
  const Result<double> envelope = RestNumber(structural, "envelope"),
                       displacement = RestNumber(structural, "displacement");
  if (!envelope.ok()) return envelope.status();
  if (!displacement.ok()) return displacement.status();
  DeltaMushStep step(
      *topology, *rest, settings,
      {*envelope, *displacement, WeightsAt(structural, PointSet::All(static_cast<Index>(rest->count)))});
  if (!step.changes()) return none;
  return std::shared_ptr<const LastStep>(
      std::make_shared<const MushStep>(structural.value("mesh"), std::move(step)));
}

}  // namespace kpsa::engine
