#include "gltf/node_tracks.h"

#include <algorithm>
#include <cmath>

#include "base/matrix.h"

namespace kpsa::engine {
namespace {

constexpr double kShear = 1e-5;  // of the largest entry: what translation, rotation and scale may miss
constexpr double kStill = 1e-7;  // of the largest number: what rounding to floats makes of what stays

// What they say of the matrices; false where one is sheared or not finite.
bool TakeApartAll(const std::vector<Matrix4>& locals, NodeTrack* track) {
  Quaternion before;
  for (const Matrix4& local : locals) {
    Double3 translation, scale;
    Quaternion rotation;
    DecomposeTrs(local, &translation, &rotation, &scale);
    if (Dot({rotation.x, rotation.y, rotation.z}, {before.x, before.y, before.z}) + rotation.w * before.w < 0)
      rotation = {-rotation.x, -rotation.y, -rotation.z, -rotation.w};
    before = rotation;
    const Matrix4 again = ComposeTrs(translation, rotation, scale);
    double largest = 0, off = 0;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        largest = std::max(largest, std::fabs(local(r, c)));
        off = std::max(off, std::fabs(local(r, c) - again(r, c)));
      }
    }
    bool finite = true;  // also as floats
    for (const double number : {translation.x, translation.y, translation.z, rotation.x, rotation.y,
                                rotation.z, rotation.w, scale.x, scale.y, scale.z})
      finite = finite && std::isfinite(static_cast<float>(number));
    if (!(off <= kShear * largest) || !finite) return false;
    for (int k = 0; k < 3; ++k) {
      track->translations.push_back(static_cast<float>(translation[k]));
      track->scales.push_back(static_cast<float>(scale[k]));
    }
    for (const double number : {rotation.x, rotation.y, rotation.z, rotation.w})
      track->rotations.push_back(static_cast<float>(number));
  }
  return true;
}

void KeepOneIfStill(std::size_t width, std::vector<float>* values) {
  float largest = 0;
  for (const float value : *values) largest = std::max(largest, std::fabs(value));
  for (std::size_t i = width; i < values->size(); ++i) {
    if (std::fabs(static_cast<double>((*values)[i]) - (*values)[i % width]) > kStill * largest) return;
  }
  values->resize(width);
}

std::vector<Matrix4> LocalsBelow(const CacheNode* parent, const CacheNode& node) {
  if (parent == nullptr) return node.worlds;
  std::vector<Matrix4> locals;
  for (std::size_t t = 0; t < node.worlds.size(); ++t) {
    Matrix4 inverse;
    if (!Invert(parent->worlds[t], &inverse)) return {};
    locals.push_back(inverse * node.worlds[t]);
  }
  return locals;
}

}  // namespace

bool NodeTrack::IsIdentity() const {
  using Values = std::vector<float>;
  return translations == Values{0, 0, 0} && rotations == Values{0, 0, 0, 1} && scales == Values{1, 1, 1};
}

std::vector<NodeTrack> TracksOf(const SkinnedScene& scene) {
  std::vector<NodeTrack> tracks;
  for (const CacheNode& node : scene.nodes) {
    NodeTrack track;
    bool good = false;
    for (const Index parent : {node.parent, kNoIndex}) {
      if (good || (parent != kNoIndex && tracks[parent].sheared)) continue;
      track = NodeTrack();
      track.parent = parent;
      const std::vector<Matrix4> locals =
          LocalsBelow(parent == kNoIndex ? nullptr : &scene.nodes[parent], node);
      good = !locals.empty() && TakeApartAll(locals, &track);
    }
    track.sheared = !good;
    KeepOneIfStill(3, &track.translations);
    KeepOneIfStill(4, &track.rotations);
    KeepOneIfStill(3, &track.scales);
    tracks.push_back(std::move(track));
  }
  return tracks;
}

std::vector<Matrix4> WorldsOf(const std::vector<NodeTrack>& tracks, std::size_t frame) {
  std::vector<Matrix4> worlds(tracks.size());
  const auto at = [&](const std::vector<float>& values, std::size_t width) {
    return values.size() == width ? values.data() : &values[width * frame];
  };
  for (std::size_t n = 0; n < tracks.size(); ++n) {
    const NodeTrack& track = tracks[n];
    if (track.sheared) continue;
    const float *t = at(track.translations, 3), *r = at(track.rotations, 4), *s = at(track.scales, 3);
    const Matrix4 local = ComposeTrs({t[0], t[1], t[2]}, {r[0], r[1], r[2], r[3]}, {s[0], s[1], s[2]});
    worlds[n] = track.parent == kNoIndex ? local : worlds[track.parent] * local;
  }
  return worlds;
}

}  // namespace kpsa::engine
