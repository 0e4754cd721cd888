#include "graph/geometry.h"

#include "base/check.h"

namespace kpsa::engine {
namespace {

template <typename T>
void AddVector(Hasher& hasher, const std::vector<T>& values) {
  hasher.Add(std::span<const T>(values.data(), values.size()));
}

void AddSampler(Hasher& hasher, const AnimationSampler& sampler) {
  hasher.Add(sampler.interpolation);
  hasher.Add(sampler.components);
  AddVector(hasher, sampler.times);
  AddVector(hasher, sampler.values);
}

}  // namespace

Mesh::Mesh(Data data) : data_(std::move(data)) {
  Hasher hasher;
  const ConstPointsView rest = std::as_const(data_.rest).view();
  for (const float* component : {rest.x, rest.y, rest.z})
    hasher.Add(std::span<const float>(component, rest.count));
  AddVector(hasher, data_.triangles);
  AddVector(hasher, data_.vertex_to_point);
  digest_ = hasher.Finish();
}

Influences::Influences(std::vector<Index> offsets, std::vector<Index> joints, std::vector<float> weights,
                       Index joint_count)
    : offsets_(std::move(offsets)),
      joints_(std::move(joints)),
      weights_(std::move(weights)),
      joint_count_(joint_count) {
  KPSA_CHECK(!offsets_.empty());
  KPSA_CHECK_EQ(offsets_.back(), joints_.size());
  KPSA_CHECK_EQ(joints_.size(), weights_.size());
  Hasher hasher;
  AddVector(hasher, offsets_);
  AddVector(hasher, joints_);
  AddVector(hasher, weights_);
  hasher.Add(joint_count_);
  digest_ = hasher.Finish();
}

MorphTargets::MorphTargets(std::vector<Target> targets, Index point_count)
    : targets_(std::move(targets)), point_count_(point_count) {
  Hasher hasher;
  hasher.Add(point_count_);
  for (const Target& target : targets_) {
    KPSA_CHECK_EQ(target.points.size() * 3, target.deltas.size());
    hasher.Add(std::string_view(target.name));
    AddVector(hasher, target.points);
    AddVector(hasher, target.deltas);
  }
  digest_ = hasher.Finish();
}

AnimationKeys::AnimationKeys(Data data) : data_(std::move(data)) {
  Hasher hasher;
  for (const AnimationSampler* sampler :
       {&data_.translation, &data_.rotation, &data_.scale, &data_.weights}) {
    AddSampler(hasher, *sampler);
  }
  hasher.AddBytes(&data_.rest_translation, sizeof(Double3));
  hasher.AddBytes(&data_.rest_rotation, sizeof(Quaternion));
  hasher.AddBytes(&data_.rest_scale, sizeof(Double3));
  digest_ = hasher.Finish();
}

Curve::Curve(std::vector<Double3> cvs, bool closed) : cvs_(std::move(cvs)), closed_(closed) {
  Hasher hasher;
  AddVector(hasher, cvs_);
  hasher.Add(closed_);
  digest_ = hasher.Finish();
}

TriangleUvs::TriangleUvs(std::vector<float> values) : values_(std::move(values)) {
  Hasher hasher;
  AddVector(hasher, values_);
  digest_ = hasher.Finish();
}

WeightMap::WeightMap(std::vector<float> weights) : weights_(std::move(weights)) {
  Hasher hasher;
  AddVector(hasher, weights_);
  digest_ = hasher.Finish();
}

}  // namespace kpsa::engine
