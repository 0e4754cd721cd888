#include "gltf/skin_residual.h"

#include <algorithm>

#include "base/matrix.h"
#include "base/parallel.h"

namespace kpsa::engine {
namespace {

Matrix4 AsFloats(Matrix4 m) {
  for (double& number : m.m) number = static_cast<double>(static_cast<float>(number));
  return m;
}

// Rest and targets in a frame, xyz in double.
std::vector<double> MorphedPoints(const CacheSkin& skin, std::size_t frame) {
  std::vector<double> points(skin.rest.begin(), skin.rest.end());
  for (std::size_t k = 0; k < skin.targets.size(); ++k) {
    const CacheTarget& target = skin.targets[k];
    const auto weight =
        static_cast<double>(static_cast<float>(skin.weights[frame * skin.targets.size() + k]));
    for (std::size_t i = 0; i < target.deltas.size() && weight != 0; ++i)
      points[3 * std::size_t{target.vertices[i / 3]} + i % 3] += weight * target.deltas[i];
  }
  return points;
}

SkinResidual FrameResidual(const PointCacheMesh& mesh, const CacheSkin& skin,
                           const std::vector<NodeTrack>& tracks, std::size_t frame) {
  const std::vector<double> points = MorphedPoints(skin, frame);
  const std::vector<Matrix4> worlds = WorldsOf(tracks, frame);
  std::vector<Matrix4> palette;
  for (std::size_t j = 0; j < skin.joints.size(); ++j)
    palette.push_back(worlds[skin.joints[j]] * AsFloats(skin.inverse_binds[j]));
  SkinResidual residual;
  for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
    const Double3 point{points[3 * v], points[3 * v + 1], points[3 * v + 2]};
    Double3 moved;
    if (skin.node != kNoIndex) {
      moved = TransformPoint(worlds[skin.node], point);
    } else {
      for (Index i = skin.offsets[v]; i < skin.offsets[v + 1]; ++i)
        moved = moved + TransformPoint(palette[skin.influences[i]], point) * skin.shares[i];
    }
    const float* wanted = &mesh.frames[3 * (frame * mesh.vertex_count + v)];
    const double off = Length(moved - Double3{wanted[0], wanted[1], wanted[2]});
    residual.max = off <= residual.max ? residual.max : off;  // also where it is not a number
    residual.square_sum += off * off;
  }
  return residual;
}

}  // namespace

SkinResidual ResidualOf(const PointCacheMesh& mesh, const CacheSkin& skin,
                        const std::vector<NodeTrack>& tracks) {
  std::vector<SkinResidual> frames(mesh.frames.size() / (3 * std::max<std::size_t>(mesh.vertex_count, 1)));
  ParallelFor(frames.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) frames[t] = FrameResidual(mesh, skin, tracks, t);
  });
  SkinResidual residual;
  for (const SkinResidual& frame : frames) {
    residual.max = frame.max <= residual.max ? residual.max : frame.max;
    residual.square_sum += frame.square_sum;
  }
  return residual;
}

const CacheNode* ShearedNode(const SkinnedScene& scene, const CacheSkin& skin,
                             const std::vector<NodeTrack>& tracks) {
  if (skin.node != kNoIndex && tracks[skin.node].sheared) return &scene.nodes[skin.node];
  for (const Index joint : skin.joints) {
    if (tracks[joint].sheared) return &scene.nodes[joint];
  }
  return nullptr;
}

}  // namespace kpsa::engine
