// The assets that characters bring: meshes, skin weights, morph targets, animation, curves, weight maps.
// All are immutable after construction, in the runtime's point order (welded, spatially sorted), with a
// digest.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "graph/value.h"

namespace kpsa::engine {

// A mesh node's geometry. `points` are welded: glTF vertices that are equal in rest position, influences and
// morph deltas are one point. Points are ordered spatially; vertex_to_point maps the file's vertices (all
// primitives concatenated in their order) to them.
class Mesh final : public Asset {
 public:
  struct Primitive {
    Index first_vertex = 0, vertex_count = 0;
    Index first_triangle = 0, triangle_count = 0;
    std::string material;  // "" where the file names none
    std::array<float, 3> base_color = {0.8f, 0.8f, 0.8f};
  };
  struct Data {
    std::string name;                      // of the mesh node, as in plugs
    PointBuffer rest;                      // [N] mesh space, metres
    std::vector<Index> triangles;          // 3 a triangle, point indices; degenerate ones left out
    std::vector<Index> vertex_to_point;    // [V]
    std::vector<Index> triangle_vertices;  // 3 a triangle, vertex indices, same triangles
    std::vector<Primitive> primitives;
  };
  explicit Mesh(Data data);
  const char* kind() const override { return "mesh"; }
  Digest digest() const override { return digest_; }
  const Data& data() const { return data_; }
  Index point_count() const { return static_cast<Index>(data_.rest.count()); }
  Index vertex_count() const { return static_cast<Index>(data_.vertex_to_point.size()); }

 private:
  Data data_;
  Digest digest_;
};

// Skin weights in compressed rows: point i is moved by joints[offsets[i]..offsets[i+1]) with those weights,
// in the file's order. Joint indices count within the skin.
class Influences final : public Asset {
 public:
  Influences(std::vector<Index> offsets, std::vector<Index> joints, std::vector<float> weights,
             Index joint_count);
  const char* kind() const override { return "influences"; }
  Digest digest() const override { return digest_; }
  const std::vector<Index>& offsets() const { return offsets_; }
  const std::vector<Index>& joints() const { return joints_; }
  const std::vector<float>& weights() const { return weights_; }
  Index joint_count() const { return joint_count_; }

 private:
  std::vector<Index> offsets_, joints_;
  std::vector<float> weights_;
  Index joint_count_;
  Digest digest_;
};

// Morph targets as sparse displacements (mesh space, metres).
class MorphTargets final : public Asset {
 public:
  struct Target {
    std::string name;
    std::vector<Index> points;  // ascending
    std::vector<float> deltas;  // xyz, 3 a point
  };
  MorphTargets(std::vector<Target> targets, Index point_count);
  const char* kind() const override { return "morphTargets"; }
  Digest digest() const override { return digest_; }
  const std::vector<Target>& targets() const { return targets_; }
  Index point_count() const { return point_count_; }

 private:
  std::vector<Target> targets_;
  Index point_count_;
  Digest digest_;
};

// The keys of one glTF animation sampler. values: components per key (x3 for cubic splines: in-tangent,
// value, out-tangent; glTF 2.0, appendix C.5).
struct AnimationSampler {
  enum class Interpolation : std::uint8_t { kLinear, kStep, kCubicSpline };
  Interpolation interpolation = Interpolation::kLinear;
  int components = 3;
  std::vector<double> times;  // seconds, strictly ascending
  std::vector<double> values;
};

// One node's part of a clip: up to three samplers for a transform (the rest value where there is none), or
// one for the weights of a mesh node.
class AnimationKeys final : public Asset {
 public:
  struct Data {
    AnimationSampler translation, rotation, scale, weights;  // empty times: not animated
    Double3 rest_translation;
    Quaternion rest_rotation;
    Double3 rest_scale{1, 1, 1};
  };
  explicit AnimationKeys(Data data);
  const char* kind() const override { return "animationKeys"; }
  Digest digest() const override { return digest_; }
  const Data& data() const { return data_; }

 private:
  Data data_;
  Digest digest_;
};

// A curve through rest control vertices, in the frame of its parent (metres).
class Curve final : public Asset {
 public:
  Curve(std::vector<Double3> cvs, bool closed);
  const char* kind() const override { return "curve"; }
  Digest digest() const override { return digest_; }
  const std::vector<Double3>& cvs() const { return cvs_; }
  bool closed() const { return closed_; }

 private:
  std::vector<Double3> cvs_;
  bool closed_;
  Digest digest_;
};

// Texture coordinates by triangle: of triangle t of a mesh u v u v u v from 6 t on, as the file has them; not
// a number where it has none.
class TriangleUvs final : public Asset {
 public:
  explicit TriangleUvs(std::vector<float> values);
  const char* kind() const override { return "triangleUvs"; }
  Digest digest() const override { return digest_; }
  const std::vector<float>& values() const { return values_; }

 private:
  std::vector<float> values_;
  Digest digest_;
};

// One float a point: a weight map, or membership (0 or 1).
class WeightMap final : public Asset {
 public:
  explicit WeightMap(std::vector<float> weights);
  const char* kind() const override { return "weights"; }
  Digest digest() const override { return digest_; }
  const std::vector<float>& weights() const { return weights_; }

 private:
  std::vector<float> weights_;
  Digest digest_;
};

}  // namespace kpsa::engine
