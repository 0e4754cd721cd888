// Weights over a plane of symmetry (rig/build/deformer_weights.h).
#include <algorithm>
#include <cmath>

#include "base/matrix.h"
#include "base/triangle_tree.h"
#include "graph/compiler.h"
#include "rig/build/deformer_weights.h"
#include "rig/character/mesh_weights.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kCandidates = 8;  // points at one place: lips that touch, seams
constexpr double kDefaultTolerance = 1e-3;

// Where the points are, where those are that share triangles with them, and who is the nearest to a place.
class Partners {
 public:
  // to: where the rest places are mirrored.
  Partners(const Mesh& mesh, const Matrix4& to, int axis)
      : places_(mesh.point_count()),
        rest_(std::as_const(places_).view()),
        axis_(axis),
        around_(rest_.count),
        own_(3 * rest_.count) {
    const ConstPointsView rest = mesh.data().rest.view();
    const PointsView places = places_.view();
    for (std::size_t p = 0; p < rest.count; ++p) {
      const Double3 at = TransformPoint(to, {double{rest.x[p]}, double{rest.y[p]}, double{rest.z[p]}});
      places.x[p] = static_cast<float>(at.x), places.y[p] = static_cast<float>(at.y);
      places.z[p] = static_cast<float>(at.z);
    }
    std::vector<double> count(rest_.count, 0.0);
    const std::vector<Index>& triangles = mesh.data().triangles;
    for (std::size_t t = 0; t < triangles.size(); t += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        around_[triangles[t + k]] =
            around_[triangles[t + k]] + At(triangles[t + (k + 1) % 3]) + At(triangles[t + (k + 2) % 3]);
        count[triangles[t + k]] += 2;
      }
    }
    for (Index p = 0; p < rest_.count; ++p) {
      around_[p] = count[p] > 0 ? around_[p] * (1 / count[p]) : At(p);
      std::fill_n(own_.begin() + 3 * static_cast<std::ptrdiff_t>(p), 3, p);
    }
    tree_ = TriangleTree(rest_, own_);  // triangles without area: the points themselves
  }
  double Side(Index p) const { return At(p)[axis_]; }
  double Diagonal() const {
    if (rest_.count == 0) return 0;
    Double3 low = At(0), high = At(0);
    for (Index p = 0; p < rest_.count; ++p) {
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], At(p)[i]);
        high[i] = std::max(high[i], At(p)[i]);
      }
    }
    return Length(high - low);
  }
  // kNoIndex where no point is anywhere.
  Index Find(Index p, double tolerance, double* distance) {
    const Double3 place = Mirrored(At(p)), around = Mirrored(around_[p]);
    const SurfacePoint nearest = tree_.Closest(place);
    if (nearest.triangle == kNoIndex) return kNoIndex;
    tree_.ClosestSeveral(place, kCandidates, std::max(std::sqrt(nearest.squared), tolerance), &found_);
    Index best = nearest.triangle;
    double least = std::numeric_limits<double>::infinity();
    for (const SurfacePoint& candidate : found_) {
      const Double3 apart = around_[candidate.triangle] - around;
      const double score = candidate.squared + Dot(apart, apart);
      if (score < least) least = score, best = candidate.triangle;
    }
    *distance = Length(At(best) - place);
    return best;
  }

 private:
  Double3 At(Index p) const { return {rest_.x[p], rest_.y[p], rest_.z[p]}; }
  Double3 Mirrored(Double3 place) const {
    place[axis_] = -place[axis_];
    return place;
  }

  PointBuffer places_;
  ConstPointsView rest_;
  int axis_;
  std::vector<Double3> around_;
  std::vector<Index> own_;
  TriangleTree tree_;
  std::vector<SurfacePoint> found_;
};

// How the weights of each point come about.
struct Source {
  enum How { kKeeps, kShares, kTakes } how = kKeeps;  // its own; joints of both sides; those of `from`
  Index from = kNoIndex;
};

bool HasSide(const std::string& name, const NamePairs& pairs) {
  return std::any_of(pairs.begin(), pairs.end(), [&](const auto& pair) {
    return name.ends_with(pair.first) || name.ends_with(pair.second);
  });
}

// The influences with the rows that `sources` say, joints changed for those of the other side.
Influences MirroredInfluences(const Influences& before, const std::vector<Source>& sources,
                              const std::vector<Index>& other_joint) {
  std::vector<Index> offsets{0}, joints;
  std::vector<float> weights;
  const auto each = [&](Index p, const auto& take) {
    for (Index i = before.offsets()[p]; i < before.offsets()[p + 1]; ++i)
      take(before.joints()[i], before.weights()[i]);
  };
  const auto add = [&](Index joint, float weight) {
    const auto begin = joints.begin() + offsets.back();
    const auto at = std::find(begin, joints.end(), joint);
    if (at != joints.end()) {
      weights[static_cast<std::size_t>(at - joints.begin())] += weight;
    } else {
      joints.push_back(joint);
      weights.push_back(weight);
    }
  };
  for (Index p = 0; p < sources.size(); ++p) {
    const float share = sources[p].how == Source::kShares ? 0.5f : 1.0f;
    if (sources[p].how != Source::kTakes)
      each(p, [&](Index joint, float weight) { add(joint, weight * share); });
    if (sources[p].how != Source::kKeeps)
      each(sources[p].from, [&](Index joint, float weight) { add(other_joint[joint], weight * share); });
    offsets.push_back(static_cast<Index>(joints.size()));
  }
  return Influences(std::move(offsets), std::move(joints), std::move(weights), before.joint_count());
}

}  // namespace

NamePairs DefaultNamePairs() {
  return {{".L", ".R"}, {"_L", "_R"}, {"-L", "-R"},      {".l", ".r"},     {"_l", "_r"},
          {"L_", "R_"}, {"l_", "r_"}, {"Left", "Right"}, {"left", "right"}};
}

std::string MirroredName(const std::string& name, const NamePairs& pairs,
                         const std::vector<std::string>& joints) {
  for (const auto& [left, right] : pairs) {
    for (const auto& [from, to] : {std::pair(left, right), std::pair(right, left)}) {
      for (std::size_t at = name.find(from); at != std::string::npos; at = name.find(from, at + 1)) {
        std::string other = name;
        other.replace(at, from.size(), to);
        if (std::find(joints.begin(), joints.end(), other) != joints.end()) return other;
      }
    }
  }
  return name;
}

namespace {

// Who takes weights from whom, over the plane of one space.
struct Paired {
  std::vector<Source> sources;
  std::vector<bool> unmatched;
  std::size_t unmatched_count = 0;
  double farthest = 0, tolerance = 0;
};

Result<Paired> PairPoints(const CharacterMesh& mesh, const Matrix4& to, const MirrorOptions& options) {
  Partners partners(mesh.mesh(), to, options.axis);
  Paired result;
  result.tolerance = options.tolerance.value_or(partners.Diagonal() * kDefaultTolerance);
  result.sources.resize(mesh.mesh().point_count());
  result.unmatched.resize(result.sources.size(), false);
  for (Index p = 0; p < result.sources.size(); ++p) {
    result.sources[p] = {Source::kKeeps, p};
    double distance = 0;
    const Index partner = partners.Find(p, result.tolerance, &distance);
    if (partner == kNoIndex) return Status::Invalid("the rest points of {} are not finite", mesh.name);
    const double side = options.from == MirrorOptions::From::kLeft    ? partners.Side(p)
                        : options.from == MirrorOptions::From::kRight ? -partners.Side(p)
                                                                      : 0;
    const bool flips = options.from == MirrorOptions::From::kBoth, far = distance > result.tolerance;
    if (side > 0 && (partner != p || far)) continue;
    // Its own partner, but not in the plane: nobody is on the other side
    if (partner != p || !far)
      result.sources[p] = {partner == p && !flips ? Source::kShares : Source::kTakes, partner};
    result.unmatched[p] = far, result.unmatched_count += far;
    result.farthest = std::max(result.farthest, distance);
  }
  return result;
}

// Where the rest pose has the mesh, by the joint that its first point weighs on.
Result<Matrix4> WorldFromMesh(const Rig& rig, const CharacterMesh& mesh) {
  const bool skinned = mesh.influences != nullptr && !mesh.influences->joints().empty();
  const Index joint = skinned ? mesh.influences->joints().front() : 0;
  const NodeId node = skinned ? mesh.influence_nodes[joint] : mesh.transform;
  Compiler compiler;
  const Result<Value> world =
      compiler.Rest(*rig.graph, {node, rig.graph->def(node).FindAttribute("worldMatrix"), -1, -1});
  if (!world.ok()) return world.status();
  return skinned ? world->get<Matrix4>() * mesh.inverse_binds[joint] : world->get<Matrix4>();
}

// In the mesh's own space, as long as things are in the world; or where that leaves fewer without a partner, in the
// world: the middle of numbers that are stored as whole ones (KHR_mesh_quantization) is not that of the character.
Result<Paired> PairPoints(const Rig& rig, const CharacterMesh& mesh, const MirrorOptions& options) {
  const Result<Matrix4> world = WorldFromMesh(rig, mesh);
  if (!world.ok()) return world.status();
  const double volume = std::abs(Determinant3(*world)), scale = volume > 0 ? std::cbrt(volume) : 1;
  Result<Paired> own = PairPoints(mesh, Scaling({scale, scale, scale}), options);
  if (!own.ok() || own->unmatched_count == 0 || !(volume > 0)) return own;
  Result<Paired> there = PairPoints(mesh, *world, options);
  return there.ok() && there->unmatched_count < own->unmatched_count ? std::move(there) : std::move(own);
}

}  // namespace

Result<MirroredWeights> MirrorWeights(const Rig& rig, const DeformedMesh& of, const MirrorOptions& options) {
  const CharacterMesh& mesh = *of.mesh;
  const Result<Paired> paired = PairPoints(rig, mesh, options);
  if (!paired.ok()) return paired.status();
  const std::vector<Source>& sources = paired->sources;
  const std::vector<bool>& unmatched = paired->unmatched;
  MirroredWeights result;
  result.tolerance = paired->tolerance, result.farthest = paired->farthest;
  for (Index v = 0; v < mesh.vertex_count; ++v) {
    if (unmatched[mesh.mesh().data().vertex_to_point[v]]) result.unmatched.push_back(v);
  }
  if (of.is_skin()) {
    const Result<std::vector<std::string>> names = InfluenceNames(mesh, *rig.graph);
    if (!names.ok()) return names.status();
    std::vector<Index> other_joint;
    for (const std::string& name : *names) {
      const std::string other = MirroredName(name, options.names, *names);
      other_joint.push_back(
          static_cast<Index>(std::find(names->begin(), names->end(), other) - names->begin()));
      if (other == name && HasSide(name, options.names)) result.unpaired.push_back(name);
    }
    Result<WeightFile> file =
        SkinWeights(mesh, MirroredInfluences(*mesh.influences, sources, other_joint), *rig.graph);
    if (!file.ok()) return file.status();
    result.file = InOwnNames(rig, of, std::move(*file));
    return result;
  }
  const std::vector<float> before = PointWeights(rig, of);
  std::vector<float> after;
  for (const Source& source : sources) after.push_back(before[source.from]);
  result.file = InOwnNames(rig, of, VertexWeights(mesh, rig.graph->name(of.stage->node), after));
  return result;
}

}  // namespace kpsa::engine
