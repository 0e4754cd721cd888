#include "rig/build/lattice_box.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/matrix.h"
#include "rig/build/stack_parts.h"
#include "rig/graph_editor.h"

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

bool BoxOfMembers(const BuildInput& in, const SourceLocation& where, RestPose* rest, MadeNode* lattice,
                  Graph* graph, Matrix4* world_from_box) {
  GraphEditor edit(graph);
  const PlugRef min_plug = edit.Plug(lattice->id, "boxMin"), max_plug = edit.Plug(lattice->id, "boxMax");
  if (!edit.ok()) return in.Fail(where, edit.Take());
  const Value* min_set = graph->FindValue(min_plug);
  const Value* max_set = graph->FindValue(max_plug);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Double3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  const Matrix4 world_from_stage =
      lattice->geometries.empty() ? Matrix4() : lattice->geometries.front().world_from_stage;
  for (std::size_t g = 0; g < lattice->geometries.size(); ++g) {
    if (!Near(lattice->geometries[g].world_from_stage, world_from_stage)) {
      return in.Fail(where,
                     Status::Invalid("\"{}\" deforms {} and {} under different skins, so its points have no "
                                     "one place: give each a lattice of its own",
                                     lattice->from->name, lattice->geometries.front().name,
                                     lattice->geometries[g].name));
    }
    const std::optional<std::size_t> mesh = lattice->geometries[g].mesh;
    if (!mesh.has_value()) continue;
    const WeightMap* weights = WeightsOf(*lattice, g, graph);
    const Places points =
        lattice->world ? rest->WorldPoints(*mesh) : rest->MeshPoints(*mesh, lattice->geometries[g].morphed);
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
    return in.Fail(
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
  return in.Fail(where, edit.Take());
}

PointBufferPtr RegularGrid(const BuildInput& in, const PlugRef& plug, const RigString& name) {
  const NodeDef& def = in.graph().def(plug.node);
  const AttributeDef& attribute = def.attributes[static_cast<std::size_t>(plug.attribute)];
  const int number = def.FindAttribute(attribute.grid);
  const Value* divisions_set = in.graph().FindValue({plug.node, number, -1, -1});
  const Value& divisions = divisions_set != nullptr
                               ? *divisions_set
                               : def.attributes[static_cast<std::size_t>(number)].default_value;
  const auto* sizes = divisions.get_if<std::vector<std::int64_t>>();
  constexpr std::int64_t kMaxDivisions = 32;
  if (sizes == nullptr || sizes->size() != 3 ||
      std::any_of(sizes->begin(), sizes->end(), [](std::int64_t n) { return n < 2 || n > kMaxDivisions; })) {
    in.Fail(name.where, Status::Invalid("{}: the divisions {} are not three whole numbers from 2 to {}",
                                        name.text, divisions.ToString(), kMaxDivisions));
    return nullptr;
  }
  std::vector<float> grid;
  for (std::int64_t u = 0; u < (*sizes)[2]; ++u) {
    for (std::int64_t t = 0; t < (*sizes)[1]; ++t) {
      for (std::int64_t s = 0; s < (*sizes)[0]; ++s) {
        const std::int64_t at[3] = {s, t, u};
        for (std::size_t i = 0; i < 3; ++i) {
          grid.push_back(
              static_cast<float>(static_cast<double>(at[i]) / static_cast<double>((*sizes)[i] - 1)));
        }
      }
    }
  }
  return std::make_shared<const PointBuffer>(PointBuffer::FromInterleaved(grid));
}

}  // namespace kpsa::engine
