#include "rig/character/clip_motion.h"

#include <optional>

#include "base/matrix.h"
#include "base/scalar_math.h"

namespace kpsa::engine {
namespace {

constexpr double kLeastTurn = 0.1;  // smaller motion is noise
constexpr double kLeastMetres = 1e-6;
constexpr double kLeastGrowth = 1e-3;
constexpr double kSlack = 0.05;  // of a range: so much beyond another is still within
constexpr double kSamples = 96;  // a second: 4 a frame of a clip of 24,
constexpr std::size_t kLeastParts = 4, kMostParts = 400;  // of the time between two keys

// What the channel is between its keys k and k + 1, at a share of the way (glTF 2.0, appendix C).
std::vector<double> Between(const gltf::Channel& channel, std::size_t k, double share) {
  const auto width = static_cast<std::size_t>(channel.components);
  const double* v = channel.values.data();
  std::vector<double> value(width);
  if (channel.interpolation == gltf::Interpolation::kCubicSpline) {
    const double span = channel.times[k + 1] - channel.times[k], t = share, tt = t * t, ttt = tt * t;
    const double *from = v + 3 * k * width, *to = from + 3 * width;  // in-tangent, value, out-tangent
    for (std::size_t i = 0; i < width; ++i) {
      value[i] = (2 * ttt - 3 * tt + 1) * from[width + i] + span * (ttt - 2 * tt + t) * from[2 * width + i] +
                 (3 * tt - 2 * ttt) * to[width + i] + span * (ttt - tt) * to[i];
    }
    return value;
  }
  const double *from = v + k * width, *to = from + width;
  const Quaternion q = Slerp(Normalized({from[0], from[1], from[2], from[3]}),
                             Normalized({to[0], to[1], to[2], to[3]}), share);
  return {q.x, q.y, q.z, q.w};
}

// Into how many parts the time after key k is cut: 1 where nothing between two keys goes beyond both.
std::size_t PartsAfter(const gltf::Channel& channel, std::size_t k) {
  const bool curved = channel.interpolation == gltf::Interpolation::kCubicSpline ||
                      (channel.interpolation == gltf::Interpolation::kLinear &&
                       channel.path == gltf::Path::kRotation);  // its angles are no straight lines
  if (!curved || k + 1 == channel.times.size()) return 1;
  const double samples = (channel.times[k + 1] - channel.times[k]) * kSamples;
  return std::clamp(static_cast<std::size_t>(std::min(samples, 1e6)), kLeastParts, kMostParts);
}

// Ranges of angles, in degrees. An elbow that bends beyond 90 degrees about its second axis jumps by half a turn in all
// three where each pose has the angles within a turn: they follow the motion, but where that goes round and round.
class Turns {
 public:
  void Add(const Matrix4& rotation) {
    const Double3 within = EulerFromRotation(rotation, RotateOrder::kXyz);
    last_ = EulerNear(within, RotateOrder::kXyz, last_);
    for (int i = 0; i < 3; ++i) followed_[i].Add(last_[i] * 180 / kPi), within_[i].Add(within[i] * 180 / kPi);
  }
  void AddTo(Motion* motion) const {
    double of_followed = 0, of_within = 0;
    for (int i = 0; i < 3; ++i) {
      of_followed += followed_[i].max - followed_[i].min;
      of_within += within_[i].max - within_[i].min;
    }
    for (int i = 0; i < 3; ++i) motion->rotate[i].Add(of_followed <= of_within ? followed_[i] : within_[i]);
  }

 private:
  Double3 last_;  // from rest on
  MotionRange followed_[3], within_[3];
};

void AddChannel(const gltf::Character& character, const gltf::Channel& channel, Motion* motion) {
  const gltf::Node& node = character.nodes[channel.node];
  const auto width = static_cast<std::size_t>(channel.components);
  const bool cubic = channel.interpolation == gltf::Interpolation::kCubicSpline;
  const Matrix4 rest_inverse = InverseOrIdentity(node.LocalMatrix());
  Turns turns;
  const auto add = [&](const double* value) {
    switch (channel.path) {
      case gltf::Path::kRotation: {
        const Quaternion now{value[0], value[1], value[2], value[3]};
        turns.Add(RotationFromQuaternion(Conjugate(Normalized(node.rotation)) * Normalized(now)));
        break;
      }
      case gltf::Path::kTranslation: {
        const Double3 offset = TransformPoint(rest_inverse, {value[0], value[1], value[2]});
        for (int i = 0; i < 3; ++i) motion->translate[i].Add(offset[i]);
        break;
      }
      case gltf::Path::kScale:
        for (int i = 0; i < 3; ++i) {
          if (node.scale[i] != 0) motion->scale[i].Add(value[i] / node.scale[i] - 1);
        }
        break;
      case gltf::Path::kWeights:
        motion->weights.resize(std::max(motion->weights.size(), width));
        for (std::size_t i = 0; i < width; ++i) motion->weights[i].Add(value[i]);
        break;
    }
  };
  for (std::size_t k = 0; k < channel.times.size(); ++k) {
    add(&channel.values[(cubic ? 3 * k + 1 : k) * width]);
    const std::size_t parts = PartsAfter(channel, k);
    for (std::size_t part = 1; part < parts; ++part)
      add(Between(channel, k, static_cast<double>(part) / static_cast<double>(parts)).data());
  }
  if (channel.path == gltf::Path::kRotation) turns.AddTo(motion);
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
      count += motion.scale[i].size() >= kLeastGrowth && GoesBeyond(motion.scale[i], others.scale[i]);
    }
    for (std::size_t k = 0; k < motion.weights.size(); ++k)
      count += GoesBeyond(motion.weights[k], others.weights[k]);
  }
  return count;
}

}  // namespace

void Motion::Add(const Motion& other) {
  for (int i = 0; i < 3; ++i) {
    rotate[i].Add(other.rotate[i]);
    translate[i].Add(other.translate[i]);
    scale[i].Add(other.scale[i]);
  }
  weights.resize(std::max(weights.size(), other.weights.size()));
  for (std::size_t k = 0; k < other.weights.size(); ++k) weights[k].Add(other.weights[k]);
}

ClipMotion MeasureClip(const gltf::Character& character, const gltf::Clip& clip) {
  ClipMotion motions;
  for (const gltf::Channel& channel : clip.channels) AddChannel(character, channel, &motions[channel.node]);
  return motions;
}

std::size_t TamestClip(const gltf::Character& character, const std::vector<ClipMotion>& motions,
                       const std::vector<bool>& may) {
  std::optional<std::size_t> best;
  std::size_t least = 0;
  for (std::size_t c = 0; c < motions.size(); ++c) {
    if (!may[c] || character.FindClip(character.clips[c].id) != c) continue;  // another one has that name
    if (best.has_value() && motions.size() > kMostClipsCompared) break;
    const std::size_t beyond = CountBeyond(motions, c);
    if (!best.has_value() || beyond < least) best = c, least = beyond;
  }
  return best.value_or(0);
}

}  // namespace kpsa::engine
