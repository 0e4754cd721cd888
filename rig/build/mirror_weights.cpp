// Weights over a plane of symmetry (rig/build/deformer_weights.h).
#include <algorithm>
#include <cmath>

#include "base/triangle_tree.h"
#include "rig/build/deformer_weights.h"
#include "rig/character/mesh_weights.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kCandidates = 8;  // points at one place: lips that touch, seams
constexpr double kDefaultTolerance = 1e-3;

// Where the points are, where those are that share triangles with them, and who is the nearest to a place.
class Partners {
 public:
  Partners(const Mesh& mesh, int axis)
      : rest_(mesh.data().rest.view()), axis_(axis), around_(rest_.count), own_(3 * rest_.count) {
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

Result<MirroredWeights> MirrorWeights(const Rig& rig, const DeformedMesh& of, const MirrorOptions& options) {
  const CharacterMesh& mesh = *of.mesh;
  Partners partners(mesh.mesh(), options.axis);
  MirroredWeights result;
  result.tolerance = options.tolerance.value_or(partners.Diagonal() * kDefaultTolerance);
  std::vector<Source> sources(mesh.mesh().point_count());
  std::vector<bool> unmatched(sources.size(), false);
  for (Index p = 0; p < sources.size(); ++p) {
    sources[p] = {Source::kKeeps, p};
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
      sources[p] = {partner == p && !flips ? Source::kShares : Source::kTakes, partner};
    unmatched[p] = far;
    result.farthest = std::max(result.farthest, distance);
  }
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
