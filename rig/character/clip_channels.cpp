#include "rig/character/clip_channels.h"

#include <algorithm>

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxNotes = 200;

AnimationSampler ToSampler(const gltf::Channel& channel) {
  AnimationSampler sampler;
  switch (channel.interpolation) {
    case gltf::Interpolation::kStep:
      sampler.interpolation = AnimationSampler::Interpolation::kStep;
      break;
    case gltf::Interpolation::kLinear:
      sampler.interpolation = AnimationSampler::Interpolation::kLinear;
      break;
    case gltf::Interpolation::kCubicSpline:
      sampler.interpolation = AnimationSampler::Interpolation::kCubicSpline;
      break;
  }
  sampler.components = channel.components;
  sampler.times = channel.times;
  sampler.values = channel.values;
  return sampler;
}

void AddNote(std::string note, std::vector<std::string>* notes) {
  if (std::find(notes->begin(), notes->end(), note) == notes->end() && notes->size() < kMaxNotes)
    notes->push_back(std::move(note));
}

}  // namespace

std::map<Index, NodeKeys> KeysByNode(const gltf::Character& character, const gltf::Clip& clip,
                                     std::vector<std::string>* notes) {
  std::map<Index, NodeKeys> keys;
  for (const gltf::Channel& channel : clip.channels) {
    NodeKeys& of_node = keys[channel.node];
    AnimationSampler* sampler = nullptr;
    switch (channel.path) {
      case gltf::Path::kTranslation:
        sampler = &of_node.data.translation;
        break;
      case gltf::Path::kRotation:
        sampler = &of_node.data.rotation;
        break;
      case gltf::Path::kScale:
        sampler = &of_node.data.scale;
        break;
      case gltf::Path::kWeights:
        sampler = &of_node.data.weights;
        break;
    }
    if (!sampler->times.empty()) {
      AddNote(fmt::format("clip \"{}\" animates one property of nodes[{}] twice; the first is used", clip.id,
                          channel.node),
              notes);
      continue;
    }
    *sampler = ToSampler(channel);
    (channel.path == gltf::Path::kWeights ? of_node.morphs : of_node.moves) = true;
  }
  for (auto& [index, of_node] : keys) {
    of_node.data.rest_translation = character.nodes[index].translation;
    of_node.data.rest_rotation = character.nodes[index].rotation;
    of_node.data.rest_scale = character.nodes[index].scale;
  }
  return keys;
}

}  // namespace kpsa::engine
