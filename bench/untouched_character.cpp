#include "bench/untouched_character.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/falloff_shapes.h"
#include "base/matrix.h"
#include "bench/untouched_motion.h"

namespace kpsa::engine::untouched {
namespace {

using scenes::Float3;

Float3 ToFloat(Double3 p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

// Bind rotation in the world: X along the bone, Z near its hinge.
Quaternion Orientation(const Bone& bone) {
  const Double3 x = UnitOrZero(bone.tip - bone.at), z = UnitOrZero(bone.hinge - x * Dot(x, bone.hinge)),
                y = Cross(z, x);
  Matrix4 m;
  for (int row = 0; row < 3; ++row) m(row, 0) = x[row], m(row, 1) = y[row], m(row, 2) = z[row];
  return QuaternionFromRotation(m);
}

class Assembler {
 public:
  Assembler(const Design& design, std::uint64_t seed, std::size_t points)
      : design_(design), seed_(seed), points_(points) {}

  scenes::GlbScene Make() {
    for (const Bone& bone : design_.bones) AddJoint(bone);
    AddMesh();
    for (std::size_t c = 0; c < design_.clips.size(); ++c) AddClip(c);
    return std::move(scene_);
  }

 private:
  void AddJoint(const Bone& bone) {
    world_.push_back(Orientation(bone));
    scenes::GlbNode node;
    node.name = bone.name;
    node.parent = bone.parent;
    if (bone.parent < 0) {
      node.translation = bone.at;
      node.rotation = world_.back();
    } else {
      const auto parent = static_cast<std::size_t>(bone.parent);
      const Quaternion back = Conjugate(world_[parent]);
      node.translation = TransformVector(RotationFromQuaternion(back), bone.at - design_.bones[parent].at);
      node.rotation = Normalized(back * world_.back());
    }
    scene_.joints.push_back(static_cast<int>(scene_.nodes.size()));
    scene_.nodes.push_back(std::move(node));
  }

  void AddMesh() {
    scenes::GlbMesh mesh;
    mesh.name = "skin";
    std::vector<Double3> points;
    std::vector<std::array<int, 4>> quads;
    for (const Part& part : design_.parts) {
      const auto count = static_cast<std::size_t>(part.share * static_cast<double>(points_));
      const Surface surface = MakeSurface(part, count);
      const auto first = static_cast<int>(points.size());
      for (const auto& quad : surface.quads) {
        std::array<int, 4>& moved = quads.emplace_back();
        for (std::size_t k = 0; k < 4; ++k) moved[k] = static_cast<int>(quad[k]) + first;
      }
      points.insert(points.end(), surface.points.begin(), surface.points.end());
      const std::vector<scenes::Influences> influences = WeighSurface(design_, part, surface);
      mesh.influences.insert(mesh.influences.end(), influences.begin(), influences.end());
    }
    for (const Double3& p : points) mesh.positions.push_back(ToFloat(p));
    mesh.triangles = scenes::Triangulate(quads);
    mesh.normals = scenes::SmoothNormals(mesh.positions, mesh.triangles);
    for (const Morph& morph : design_.morphs) mesh.targets.push_back(Displace(morph, points));
    scene_.meshes.push_back(std::move(mesh));
    scenes::GlbNode node;
    node.name = "character";
    node.mesh = 0;
    scene_.nodes.push_back(std::move(node));
  }

  static scenes::SparseTarget Displace(const Morph& morph, const std::vector<Double3>& points) {
    scenes::SparseTarget target{morph.name, {}, {}};
    const auto add = [&](std::size_t point, double weight) {
      target.points.push_back(static_cast<Index>(point));
      target.deltas.push_back(ToFloat(morph.move * weight));
    };
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double distance = Length(points[i] - morph.center) / morph.radius;
      if (Length(points[i] - morph.center) < Length(points[nearest] - morph.center)) nearest = i;
      const double inside = 1 - distance * distance;
      if (inside > 0) add(i, inside * inside);
    }
    if (target.points.empty()) add(nearest, 1);
    return target;
  }

  void AddClip(std::size_t number) {
    const ClipDesign& design = design_.clips[number];
    const Curves curves = MakeCurves(design_, design, Random(seed_ + number).Next());
    scenes::GlbClip clip;
    clip.name = design.name;
    clip.frames_per_second = kClipFps;
    for (const auto& curve : curves) clip.frames = std::max(clip.frames, static_cast<int>(curve.size()));
    for (std::size_t bone = 0; bone < design_.bones.size(); ++bone) {
      AddTurns(bone, curves, &clip);
      AddTravel(bone, curves, &clip);
    }
    AddWeights(curves, &clip);
    scene_.clips.push_back(std::move(clip));
  }

  // The bone's three curves of a kind, added to `rest` at every frame; false where all of them rest.
  bool Gather(std::size_t bone, MotionKind kind, const Curves& curves, std::vector<Double3>* values) const {
    bool moves = false;
    for (std::size_t m = 0; m < curves.size(); ++m) {
      const MotionRange& motion = design_.motions[m];
      if (motion.kind != kind || motion.of != bone || curves[m].empty()) continue;
      moves = true;
      values->resize(curves[m].size());
      for (std::size_t f = 0; f < curves[m].size(); ++f) (*values)[f][motion.axis] += curves[m][f];
    }
    return moves;
  }

  void AddTurns(std::size_t bone, const Curves& curves, scenes::GlbClip* clip) const {
    std::vector<Double3> angles;
    if (!Gather(bone, MotionKind::kTurn, curves, &angles)) return;
    scenes::GlbChannel channel = {static_cast<int>(bone), false, {}};
    Quaternion last;
    for (const Double3& turn : angles) {
      Quaternion q =
          scene_.nodes[bone].rotation * QuaternionFromRotation(RotationFromEuler(turn, RotateOrder::kXyz));
      if (last.x * q.x + last.y * q.y + last.z * q.z + last.w * q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
      last = q;
      for (double v : {q.x, q.y, q.z, q.w}) channel.values.push_back(static_cast<float>(v));
    }
    clip->channels.push_back(std::move(channel));
  }

  void AddTravel(std::size_t bone, const Curves& curves, scenes::GlbClip* clip) const {
    std::vector<Double3> offsets;
    if (!Gather(bone, MotionKind::kTravel, curves, &offsets)) return;
    scenes::GlbChannel channel = {static_cast<int>(bone), false, {}, true};
    for (const Double3& offset : offsets) {
      for (const float v : ToFloat(scene_.nodes[bone].translation + offset)) channel.values.push_back(v);
    }
    clip->channels.push_back(std::move(channel));
  }

  void AddWeights(const Curves& curves, scenes::GlbClip* clip) const {
    if (design_.morphs.empty()) return;
    const auto frames = static_cast<std::size_t>(clip->frames), count = design_.morphs.size();
    scenes::GlbChannel channel = {static_cast<int>(scene_.nodes.size()) - 1, true, {}};
    channel.values.resize(frames * count);
    for (std::size_t m = 0; m < curves.size(); ++m) {
      if (design_.motions[m].kind != MotionKind::kMorph) continue;
      for (std::size_t f = 0; f < curves[m].size(); ++f)
        channel.values[f * count + design_.motions[m].of] =
            static_cast<float>(std::clamp(curves[m][f], 0.0, 1.0));
    }
    clip->channels.push_back(std::move(channel));
  }

  const Design& design_;
  std::uint64_t seed_;
  std::size_t points_;
  std::vector<Quaternion> world_;  // of bones, in the bind pose
  scenes::GlbScene scene_;
};

Design MakeDesign(Kind kind, std::uint64_t seed) {
  return kind == Kind::kBody   ? DesignBody(seed)
         : kind == Kind::kHead ? DesignHead(seed)
                               : DesignCreature(seed);
}

}  // namespace

std::vector<scenes::Influences> WeighSurface(const Design& design, const Part& part, const Surface& surface) {
  const std::size_t bones = design.bones.size(), points = surface.points.size();
  std::vector<std::vector<double>> weights(points, std::vector<double>(bones));
  const auto parent_of = [&](int bone) { return design.bones[static_cast<std::size_t>(bone)].parent; };
  for (std::size_t i = 0; i < points; ++i) {
    std::vector<double> distance(bones);
    int nearest = part.bones.front();
    for (const int b : part.bones) {
      const auto at = static_cast<std::size_t>(b);
      const Bone& bone = design.bones[at];
      distance[at] = SegmentDistance(surface.points[i], bone.at, bone.tip) / bone.radius;
      if (distance[at] < distance[static_cast<std::size_t>(nearest)]) nearest = b;
    }
    double sum = 0;
    for (const int b : part.bones) {
      if (b != nearest && parent_of(b) != nearest && parent_of(nearest) != b) continue;
      const auto at = static_cast<std::size_t>(b);
      double power = 1e-6;
      double factor = 1;
      for (int k = 0; k < design.weight_falloff; ++k) factor *= distance[at];
      power += factor;
      weights[i][at] = 1 / power;
      sum += weights[i][at];
    }
    for (double& weight : weights[i]) weight /= sum;
  }
  const std::vector<std::vector<Index>> neighbours = surface.Neighbours();
  for (int round = 0; round < design.weight_rounds; ++round) {
    std::vector<std::vector<double>> next = weights;
    for (std::size_t i = 0; i < points; ++i) {
      if (neighbours[i].empty()) continue;
      const double share = 0.5 / static_cast<double>(neighbours[i].size());
      for (std::size_t b = 0; b < bones; ++b) {
        next[i][b] *= 0.5;
        for (const Index n : neighbours[i]) next[i][b] += share * weights[n][b];
      }
    }
    weights = std::move(next);
  }
  std::vector<scenes::Influences> out;
  out.reserve(points);
  for (const std::vector<double>& row : weights) out.push_back(scenes::MakeInfluences(row));
  return out;
}

const char* KindName(Kind kind) {
  return kind == Kind::kBody ? "body" : kind == Kind::kHead ? "head" : "creature";
}

std::size_t UsualPoints(Kind kind) {
  return kind == Kind::kBody ? 14'000 : kind == Kind::kHead ? 17'000 : 10'000;
}

scenes::GlbScene MakeCharacter(Kind kind, std::uint64_t seed, std::size_t points) {
  const Design design = MakeDesign(kind, seed);
  return Assembler(design, Random(seed * kKinds.size() + static_cast<std::size_t>(kind)).Next(), points)
      .Make();
}

std::string TestClip(Kind kind) { return MakeDesign(kind, 1).clips.back().name; }

}  // namespace kpsa::engine::untouched
