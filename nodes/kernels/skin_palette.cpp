#include "nodes/kernels/skin_palette.h"

#include "base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/kernels/skin_palette.cpp"
#include "hwy/foreach_target.h"

#include "nodes/kernels/affine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace kpsa::engine {
namespace HWY_NAMESPACE {

template <typename T>
HWY_INLINE void WritePalette(const SkinJoints& joints, const Index* HWY_RESTRICT numbers, std::size_t count,
                             const double* HWY_RESTRICT binds, float* HWY_RESTRICT origin,
                             T* HWY_RESTRICT columns) {
  const Four offset = FourOf(joints.offset);
  const Four place = Placed(LoadColumns(*joints.world[0]), binds + 9) + offset;
  for (std::size_t i = 0; i < 3; ++i)
    origin[i] = std::isfinite(place[i]) ? static_cast<float>(place[i]) : 0.0f;
  const Four shift = offset - Four{origin[0], origin[1], origin[2], 0};
  for (std::size_t j = 0; j < count; ++j, columns += 16) {
    binds += 12;
    const FourColumns world = LoadColumns(*joints.world[numbers[j]]);
    for (std::size_t c = 0; c < 3; ++c) StoreFour(Turned(world, binds + 3 * c), columns + 4 * c);
    StoreFour(Placed(world, binds + 9) + shift, columns + 12);
  }
}

void FloatPalette(const SkinJoints& joints, const Index* numbers, std::size_t count, const double* binds,
                  float* origin, float* columns) {
  WritePalette(joints, numbers, count, binds, origin, columns);
}
void DoublePalette(const SkinJoints& joints, const Index* numbers, std::size_t count, const double* binds,
                   float* origin, double* columns) {
  WritePalette(joints, numbers, count, binds, origin, columns);
}

}  // namespace HWY_NAMESPACE
}  // namespace kpsa::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace kpsa::engine {

HWY_EXPORT(FloatPalette);
HWY_EXPORT(DoublePalette);

SkinPalette::SkinPalette(std::span<const Index> joints, std::span<const Matrix4> joint_from_bind,
                         Index joint_count)
    : joints_(joints.begin(), joints.end()), joint_count_(joint_count) {
  KPSA_CHECK(joint_from_bind.empty() || joint_from_bind.size() == joint_count);
  const auto add = [&](Index j) {
    const Matrix4 bind = joint_from_bind.empty() ? Matrix4() : joint_from_bind[j];
    for (std::size_t i = 0; i < 16; ++i) {
      if (i % 4 != 3) binds_.push_back(bind.m[i]);
    }
  };
  add(0);
  for (const Index j : joints_) add(j);
}

void SkinPalette::Run(const SkinJoints& joints, float origin[3], float* columns) const noexcept {
  KPSA_CHECK_EQ(joints.world.size(), joint_count_);
  HWY_DYNAMIC_DISPATCH(FloatPalette)(joints, joints_.data(), joints_.size(), binds_.data(), origin, columns);
}
void SkinPalette::Run(const SkinJoints& joints, float origin[3], double* columns) const noexcept {
  KPSA_CHECK_EQ(joints.world.size(), joint_count_);
  HWY_DYNAMIC_DISPATCH(DoublePalette)(joints, joints_.data(), joints_.size(), binds_.data(), origin, columns);
}

}  // namespace kpsa::engine
#endif  // HWY_ONCE
