// A naive evaluator of glTF characters in double precision, written from the specification and from nothing
// else of this project but the plain structs: the reference that real evaluation is compared with. One vertex
// at a time, libm throughout.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/matrix.h"
#include "gltf/import.h"

namespace kpsa::engine::gltf_reference {

using Vector = std::vector<double>;

inline Vector Normalize(Vector q) {
  double sum = 0;
  for (double c : q) sum += c * c;
  if (sum == 0) return {0, 0, 0, 1};
  for (double& c : q) c /= std::sqrt(sum);
  return q;
}

// glTF 2.0, appendix C: the value of a channel at a time, clamped to its keys.
inline Vector Sample(const gltf::Channel& channel, double time) {
  const std::size_t n = static_cast<std::size_t>(channel.components), keys = channel.times.size();
  const bool cubic = channel.interpolation == gltf::Interpolation::kCubicSpline;
  const auto part = [&](std::size_t key, std::size_t which) {  // which: 0 in-tangent, 1 value, 2 out-tangent
    const std::size_t at = (cubic ? 3 * key + which : key) * n;
    return Vector(channel.values.begin() + static_cast<std::ptrdiff_t>(at),
                  channel.values.begin() + static_cast<std::ptrdiff_t>(at + n));
  };
  const bool rotation = channel.path == gltf::Path::kRotation;
  const auto finish = [&](Vector v) { return rotation ? Normalize(v) : v; };
  if (time <= channel.times.front()) return finish(part(0, 1));
  if (time >= channel.times.back()) return finish(part(keys - 1, 1));
  std::size_t k = 0;
  while (channel.times[k + 1] <= time) ++k;
  if (channel.interpolation == gltf::Interpolation::kStep) return finish(part(k, 1));
  const double duration = channel.times[k + 1] - channel.times[k], t = (time - channel.times[k]) / duration;
  Vector a = part(k, 1), b = part(k + 1, 1), result(n);
  if (cubic) {
    const Vector out = part(k, 2), in = part(k + 1, 0);
    const double t2 = t * t, t3 = t2 * t;
    for (std::size_t i = 0; i < n; ++i) {
      result[i] = (2 * t3 - 3 * t2 + 1) * a[i] + duration * (t3 - 2 * t2 + t) * out[i] +
                  (-2 * t3 + 3 * t2) * b[i] + duration * (t3 - t2) * in[i];
    }
    return finish(result);
  }
  double wa = 1 - t, wb = t;
  if (rotation) {
    a = Normalize(a), b = Normalize(b);
    double dot = 0;
    for (std::size_t i = 0; i < 4; ++i) dot += a[i] * b[i];
    const double sign = dot < 0 ? -1 : 1, angle = std::acos(std::min(1.0, std::fabs(dot)));
    if (std::sin(angle) > 1e-9) {
      wa = std::sin((1 - t) * angle) / std::sin(angle);
      wb = std::sin(t * angle) / std::sin(angle);
    }
    wb *= sign;
  }
  for (std::size_t i = 0; i < n; ++i) result[i] = wa * a[i] + wb * b[i];
  return finish(result);
}

// The character's transforms and weights at one time of a clip (nullptr: rest).
struct Pose {
  std::vector<Matrix4> world;   // world_from_node
  std::vector<Vector> weights;  // of each node's mesh
};

inline Pose Evaluate(const gltf::Character& character, const gltf::Clip* clip, double time) {
  Pose pose;
  std::vector<gltf::Node> nodes = character.nodes;
  for (gltf::Node& node : nodes) {
    if (node.mesh != kNoIndex && node.weights.empty()) node.weights = character.meshes[node.mesh].weights;
  }
  if (clip != nullptr) {
    for (const gltf::Channel& channel : clip->channels) {
      const Vector v = Sample(channel, time);
      gltf::Node& node = nodes[channel.node];
      switch (channel.path) {
        case gltf::Path::kTranslation:
          node.translation = {v[0], v[1], v[2]};
          break;
        case gltf::Path::kRotation:
          node.rotation = {v[0], v[1], v[2], v[3]};
          break;
        case gltf::Path::kScale:
          node.scale = {v[0], v[1], v[2]};
          break;
        case gltf::Path::kWeights:
          node.weights = v;
          break;
      }
    }
  }
  pose.world.resize(nodes.size());
  pose.weights.resize(nodes.size());
  for (const Index i : character.order) {
    const Matrix4 local = nodes[i].LocalMatrix();
    pose.world[i] = nodes[i].parent == kNoIndex ? local : pose.world[nodes[i].parent] * local;
    pose.weights[i] = nodes[i].weights;
  }
  return pose;
}

// World-space positions of all vertices of a mesh node.
inline std::vector<Double3> Points(const gltf::Character& character, const Pose& pose, Index node_index) {
  const gltf::Node& node = character.nodes[node_index];
  const gltf::Mesh& mesh = character.meshes[node.mesh];
  std::vector<Double3> points(mesh.vertex_count());
  for (std::size_t v = 0; v < points.size(); ++v) {
    points[v] = {mesh.positions[3 * v], mesh.positions[3 * v + 1], mesh.positions[3 * v + 2]};
  }
  for (std::size_t t = 0; t < mesh.targets.size(); ++t) {
    const gltf::MorphTarget& target = mesh.targets[t];
    for (std::size_t i = 0; i < target.vertices.size(); ++i) {
      points[target.vertices[i]] =
          points[target.vertices[i]] +
          Double3{target.deltas[3 * i], target.deltas[3 * i + 1], target.deltas[3 * i + 2]} *
              pose.weights[node_index][t];
    }
  }
  for (const gltf::Primitive& primitive : mesh.primitives) {
    for (Index v = primitive.first_vertex; v < primitive.first_vertex + primitive.vertex_count; ++v) {
      if (node.skin == kNoIndex || !primitive.skinned) {
        points[v] = TransformPoint(pose.world[node_index], points[v]);
        continue;
      }
      const gltf::Skin& skin = character.skins[node.skin];
      Double3 sum;
      for (const gltf::Influence& influence : mesh.influence_rows().row(v)) {
        const Matrix4 joint =
            pose.world[skin.joints[influence.joint]] * skin.inverse_bind_matrices[influence.joint];
        sum = sum + TransformPoint(joint, points[v]) * influence.weight;
      }
      points[v] = sum;
    }
  }
  return points;
}

// Every primitive in the scene at each of the times, under its name in an .npz: "<node>/<primitive>", T * V
// * 3.
inline std::map<std::string, Vector> AllPoints(const gltf::Character& character, const gltf::Clip* clip,
                                               const Vector& times) {
  std::map<std::string, Vector> result;
  const std::vector<std::string> names = character.UniqueNames();
  for (const double time : times) {
    const Pose pose = Evaluate(character, clip, time);
    for (const Index node : character.MeshNodes()) {
      const std::vector<Double3> points = Points(character, pose, node);
      const std::vector<gltf::Primitive>& primitives =
          character.meshes[character.nodes[node].mesh].primitives;
      for (std::size_t p = 0; p < primitives.size(); ++p) {
        Vector& values = result[names[node] + "/" + std::to_string(p)];
        for (Index v = primitives[p].first_vertex;
             v < primitives[p].first_vertex + primitives[p].vertex_count; ++v) {
          values.insert(values.end(), {points[v].x, points[v].y, points[v].z});
        }
      }
    }
  }
  return result;
}

}  // namespace kpsa::engine::gltf_reference
