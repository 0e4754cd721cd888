#include "rig/build/shape_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/quantity_text.h"

namespace kpsa::engine {
namespace {

constexpr double kRounding = 1e-6;  // of the diagonal: six decimals of metres, or float32
constexpr double kApart = 1e-5;     // of the diagonal: between displacements of vertices that are one point
constexpr double kFarOff = 0.5;     // of the diagonal, RMS: a shape of something else

double DiagonalOf(const PointBuffer& rest) {
  const ConstPointsView view = rest.view();
  double square = 0;
  for (const float* axis : {view.x, view.y, view.z}) {
    if (view.count == 0) return 0;
    const auto [low, high] = std::minmax_element(axis, axis + view.count);
    square += (static_cast<double>(*high) - *low) * (static_cast<double>(*high) - *low);
  }
  return std::sqrt(square);
}

// The point of each of the shape's vertices; empty where their number fits neither vertices nor points.
std::vector<Index> PointsOfShape(Index vertex_count, const CharacterMesh& mesh) {
  const std::vector<Index>& vertex_to_point = mesh.mesh().data().vertex_to_point;
  if (vertex_count == vertex_to_point.size()) return vertex_to_point;
  if (vertex_count != mesh.mesh().point_count()) return {};
  std::vector<Index> points(vertex_count);
  std::iota(points.begin(), points.end(), 0u);
  const std::vector<Index>& first = mesh.geometry.point_to_vertex;
  std::sort(points.begin(), points.end(), [&](Index a, Index b) { return first[a] < first[b]; });
  return points;
}

}  // namespace

Result<PointShape> ShapeOfPoints(const TargetSource& source, const CharacterMesh& mesh) {
  const FileShape& shape = *source.shape;
  const std::vector<Index> point_of = PointsOfShape(shape.vertex_count, mesh);
  const std::size_t count = mesh.mesh().point_count();
  if (point_of.empty()) {
    const std::string welded = count == mesh.vertex_count
                                   ? ""
                                   : fmt::format(", or {} where those that are welded count once", count);
    return Status::Invalid("shape \"{}\" of {} has {} vertices; {} has {}{}", shape.name, source.file->path,
                           shape.vertex_count, mesh.name, mesh.vertex_count, welded);
  }
  const ConstPointsView rest = mesh.mesh().data().rest.view();
  const double diagonal = DiagonalOf(mesh.mesh().data().rest);
  std::vector<Double3> sum(count), first(count);
  std::vector<Index> vertices(count, 0), apart(count, 0);
  const auto add = [&](Index vertex, const float* xyz) {
    const Index p = point_of[vertex];
    Double3 delta = Double3{xyz[0], xyz[1], xyz[2]} * source.metres;
    if (!source.displacements) {
      delta = delta - Double3{rest.x[p], rest.y[p], rest.z[p]};
      if (Length(delta) <= kRounding * diagonal) delta = {};
    }
    if (vertices[p] == 0) first[p] = delta;
    if (Length(delta - first[p]) > kApart * diagonal) apart[p] = 1;
    sum[p] = sum[p] + delta;
    ++vertices[p];
  };
  if (!shape.vertices.has_value()) {
    for (Index v = 0; v < shape.vertex_count; ++v) add(v, &shape.values[3 * std::size_t{v}]);
  } else {
    constexpr float kStill[3] = {0, 0, 0};
    std::size_t k = 0;
    for (Index v = 0; v < shape.vertex_count; ++v) {
      const bool moves = k < shape.vertices->size() && (*shape.vertices)[k] == v;
      add(v, moves ? &shape.values[3 * k++] : kStill);
    }
  }

  PointShape result;
  double squares = 0;
  for (Index p = 0; p < count; ++p) {
    const Double3 mean = vertices[p] == 1 ? sum[p] : sum[p] * (1.0 / vertices[p]);
    squares += Dot(mean, mean);
    const float delta[3] = {static_cast<float>(mean.x), static_cast<float>(mean.y),
                            static_cast<float>(mean.z)};
    if (!std::isfinite(delta[0]) || !std::isfinite(delta[1]) || !std::isfinite(delta[2])) {
      return Status::Invalid("shape \"{}\" of {} moves vertex {} of {} too far", shape.name,
                             source.file->path, mesh.geometry.point_to_vertex[p], mesh.name);
    }
    if (delta[0] == 0 && delta[1] == 0 && delta[2] == 0) continue;
    result.points.push_back(p);
    result.deltas.insert(result.deltas.end(), delta, delta + 3);
  }
  const auto torn = std::accumulate(apart.begin(), apart.end(), std::size_t{0});
  if (torn > 0) {
    result.notes.push_back(
        fmt::format("shape \"{}\" of {} pulls vertices apart that are one point of {}, at {}: "
                    "these go to the mean (weld: off keeps them apart)",
                    shape.name, source.file->path, mesh.name, Plural(torn, "place")));
  }
  const double rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(count, 1)));
  if (rms > kFarOff * diagonal) {
    result.notes.push_back(fmt::format(
        "shape \"{}\" of {} moves the points of {} by {:.3g} m (RMS), which is {:.0f} % of its size: is it "
        "in "
        "another unit (unit: cm), of another mesh, or are its numbers displacements (as: displacements)?",
        shape.name, source.file->path, mesh.name, rms, diagonal > 0 ? 100 * rms / diagonal : 0.0));
  }
  return result;
}

}  // namespace kpsa::engine
