#include "io/clip_motion.h"

#include "base/matrix.h"
#include "base/scalar_math.h"

namespace kpsa {
namespace {

constexpr double kLeastTurn = 0.1;  // smaller motion is noise
constexpr double kLeastMetres = 1e-6;
constexpr double kSlack = 0.05;  // of a range: so much beyond another is still within

void AddChannel(const gltf::Character& character, const gltf::Channel& channel, Motion* motion) {
  const gltf::Node& node = character.nodes[channel.node];
  const auto width = static_cast<std::size_t>(channel.components);
  const bool cubic = channel.interpolation == gltf::Interpolation::kCubicSpline;
  const Matrix4 rest_inverse = InverseOrIdentity(node.LocalMatrix());
  for (std::size_t k = 0; k < channel.times.size(); ++k) {
    const double* value = &channel.values[(cubic ? 3 * k + 1 : k) * width];
    switch (channel.path) {
      case gltf::Path::kRotation: {
        const Quaternion now{value[0], value[1], value[2], value[3]};
        const Matrix4 relative =
            RotationFromQuaternion(Conjugate(Normalized(node.rotation)) * Normalized(now));
        const Double3 angles = EulerFromRotation(relative, RotateOrder::kXyz);
        for (int i = 0; i < 3; ++i) motion->rotate[i].Add(angles[i] * 180 / kPi);
        break;
      }
      case gltf::Path::kTranslation: {
        const Double3 offset = TransformPoint(rest_inverse, {value[0], value[1], value[2]});
        for (int i = 0; i < 3; ++i) motion->translate[i].Add(offset[i]);
        break;
      }
      case gltf::Path::kScale:
        break;
      case gltf::Path::kWeights:
        motion->weights.resize(std::max(motion->weights.size(), width));
        for (std::size_t i = 0; i < width; ++i) motion->weights[i].Add(value[i]);
        break;
    }
  }
}

bool GoesBeyond(const MotionRange& range, const MotionRange& other) {
  const double slack = kSlack * range.size();
  return range.min < other.min - slack || range.max > other.max + slack;
}

// How many ranges of the clip go beyond those of the others together.
std::size_t CountBeyond(const std::vector<ClipMotion>& motions, std::size_t clip) {
  std::size_t count = 0;
  for (const auto& [node, motion] : motions[clip]) {
    Motion others;
    for (std::size_t o = 0; o < motions.size(); ++o) {
      const auto other = motions[o].find(node);
      if (o != clip && other != motions[o].end()) others.Add(other->second);
    }
    others.weights.resize(std::max(others.weights.size(), motion.weights.size()));
    for (int i = 0; i < 3; ++i) {
      count += motion.rotate[i].size() >= kLeastTurn && GoesBeyond(motion.rotate[i], others.rotate[i]);
      count +=
          motion.translate[i].size() >= kLeastMetres && GoesBeyond(motion.translate[i], others.translate[i]);
    }
    for (std::size_t k = 0; k < motion.weights.size(); ++k)
      count += GoesBeyond(motion.weights[k], others.weights[k]);
  }
  return count;
}

}  // namespace

void Motion::Add(const Motion& other) {
  const auto add = [](const MotionRange& from, MotionRange* to) {
    to->Add(from.min);
    to->Add(from.max);
  };
  for (int i = 0; i < 3; ++i) {
    add(other.rotate[i], &rotate[i]);
    add(other.translate[i], &translate[i]);
  }
  weights.resize(std::max(weights.size(), other.weights.size()));
  for (std::size_t k = 0; k < other.weights.size(); ++k) add(other.weights[k], &weights[k]);
}

ClipMotion MeasureClip(const gltf::Character& character, const gltf::Clip& clip) {
  ClipMotion motions;
  for (const gltf::Channel& channel : clip.channels) AddChannel(character, channel, &motions[channel.node]);
  return motions;
}

std::size_t TamestClip(const gltf::Character& character, const std::vector<ClipMotion>& motions) {
  if (motions.size() > kMostClipsCompared) return 0;
  std::size_t best = 0, least = 0;
  for (std::size_t c = 0; c < motions.size(); ++c) {
    if (character.FindClip(character.clips[c].id) != c) continue;  // another one has that name
    const std::size_t beyond = CountBeyond(motions, c);
    if (c == 0 || beyond < least) best = c, least = beyond;
  }
  return best;
}

}  // namespace kpsa
