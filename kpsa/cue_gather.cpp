#include "kpsa/cue_gather.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

using RowKind = KpsaConfig::Row::Kind;

constexpr std::uint32_t ElementOf(Index entry) { return 4 * (entry / 3) + entry % 3; }

double ValueOf(const ArrayView<Matrix4>& matrices, const ArrayView<double>& scalars,
               const KpsaConfig::Row& row) {
  return row.kind == RowKind::kMatrix ? matrices[row.input].m[ElementOf(row.element)] : scalars[row.input];
}

}  // namespace

CueGather::CueGather(const KpsaConfig::Data& data)
    : has_space_(data.has_space), rest_origin_(data.rest_origin), joints_(data.joints) {
  std::map<std::tuple<Index, Index, bool>, std::vector<MatrixEntry>> blocks;
  std::size_t next = 0;
  for (const KpsaConfig::Row& row : data.rows) {
    switch (row.kind) {
      case RowKind::kPoint: {
        const KpsaConfig::PointCues& of = data.cues[row.input];
        points_.push_back({row.input, row.element, row.joint, of.in_space, of.near, next});
        next += 2;
        break;
      }
      case RowKind::kMatrix:
        blocks[{row.joint, row.input, data.relative[row.input] != 0}].push_back(
            {ElementOf(row.element), static_cast<std::uint32_t>(next)});
        break;
      case RowKind::kScalar:
        scalars_.push_back({row.input, next});
        break;
      case RowKind::kProduct:
        products_.push_back({data.products[row.input], next});
        break;
    }
    ++next;
  }
  for (const auto& [of, entries] : blocks) {
    const auto begin = static_cast<std::uint32_t>(entries_.size());
    entries_.insert(entries_.end(), entries.begin(), entries.end());
    const auto& [joint, matrix, relative] = of;
    std::uint32_t columns = 0;
    for (const MatrixEntry& entry : entries) columns |= 1u << entry.element / 4;
    blocks_.push_back({matrix,
                       joint != kNoIndex ? joint
                       : relative        ? MatrixBlock::kAfterSpace
                                         : MatrixBlock::kAsItIs,
                       columns, begin, static_cast<std::uint32_t>(entries_.size())});
  }
}

void CueGather::Gather(const Inputs& in, float* scratch, std::span<double> raw) const {
  const Matrix4& world_from_space = in.world_from_space;
  Matrix4 space_from_world;
  if (!(world_from_space == Matrix4())) space_from_world = InverseOrIdentity(world_from_space);
  // Of points that have been moved by rest_origin - origin: that is taken back in double
  Matrix4 space_from_near = space_from_world;
  if (has_space_) {
    const Double3 moved =
        Double3{world_from_space(0, 3), world_from_space(1, 3), world_from_space(2, 3)} - rest_origin_;
    space_from_near = space_from_world * Translation(moved);
  }
  Matrix4* const joint_from_world = reinterpret_cast<Matrix4*>(scratch);
  Matrix4* const joint_from_space = joint_from_world + joints_.size();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    joint_from_world[j] = InverseOrIdentity(in.matrices[joints_[j]]);
    if (!points_.empty()) joint_from_space[j] = joint_from_world[j] * world_from_space;
  }
  for (const Point& point : points_) {
    const ConstPointsView& points = in.cues[point.input];
    Double3 p{points.x[point.element], points.y[point.element], points.z[point.element]};
    if (point.in_space) p = TransformPoint(point.near ? space_from_near : space_from_world, p);
    if (point.joint != kNoIndex) p = TransformPoint(joint_from_space[point.joint], p);
    raw[point.row] = p.x, raw[point.row + 1] = p.y, raw[point.row + 2] = p.z;
  }
  TakeEntries(blocks_, entries_.data(), in.matrices, joint_from_world, space_from_world, raw.data());
  for (const Scalar& scalar : scalars_) raw[scalar.row] = in.scalars[scalar.input];
  for (const Product& of : products_) {
    double value = of.of.of_a.Of(ValueOf(in.matrices, in.scalars, of.of.a));
    if (of.of.b.kind != RowKind::kPoint) value *= of.of.of_b.Of(ValueOf(in.matrices, in.scalars, of.of.b));
    raw[of.row] = value < of.of.lo ? of.of.lo : value > of.of.hi ? of.of.hi : value;  // NaN stays
  }
}

}  // namespace kpsa::engine
