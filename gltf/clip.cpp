#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <optional>
#include <set>

#include "gltf/document.h"

namespace kpsa::engine::gltf {
namespace {

std::optional<Path> ParsePath(const std::string& text) {
  if (text == "translation") return Path::kTranslation;
  if (text == "rotation") return Path::kRotation;
  if (text == "scale") return Path::kScale;
  if (text == "weights") return Path::kWeights;
  return std::nullopt;
}

std::optional<Interpolation> ParseInterpolation(const std::string& text) {
  if (text == "STEP") return Interpolation::kStep;
  if (text == "LINEAR") return Interpolation::kLinear;
  if (text == "CUBICSPLINE") return Interpolation::kCubicSpline;
  return std::nullopt;
}

Status ReadTimes(const Document& document, int accessor, const std::string& what,
                 std::vector<double>* times) {
  KPSA_RETURN_IF_ERROR(ReadNumbers(document, accessor, 1, kFloat, what, times));
  if (times->empty()) return Status::Invalid("{} has no keys", what);
  if (times->front() < 0)
    return Status::Invalid("{}: the first key is at {} s, before 0", what, times->front());
  for (std::size_t i = 1; i < times->size(); ++i) {
    if ((*times)[i] <= (*times)[i - 1]) {
      return Status::Invalid("{}: key {} is at {} s, not after the key before at {} s", what, i, (*times)[i],
                             (*times)[i - 1]);
    }
  }
  return {};
}

// `values` is read with the number of components that the path wants.
Status ReadValues(const Document& document, int accessor, const std::string& what, Channel* channel) {
  constexpr unsigned kTypes = kFloat | kAnyInteger16;
  const int width = channel->path == Path::kWeights ? 1 : channel->components;
  KPSA_RETURN_IF_ERROR(ReadNumbers(document, accessor, width, kTypes, what, &channel->values));
  const std::size_t parts = channel->interpolation == Interpolation::kCubicSpline ? 3 : 1;
  const std::size_t expected = channel->times.size() * parts * static_cast<std::size_t>(channel->components);
  if (channel->values.size() != expected) {
    return Status::Invalid("{} has {} numbers, {} keys need {}", what, channel->values.size(),
                           channel->times.size(), expected);
  }
  return {};
}

// nullopt for a channel that moves nothing.
Result<std::optional<Channel>> ReadChannel(const Document& document, const tinygltf::Animation& animation,
                                           const tinygltf::AnimationChannel& in, const std::string& where,
                                           const std::string& animation_place, const Character& character,
                                           std::vector<std::string>* warnings) {
  Channel channel;
  channel.node = static_cast<Index>(in.target_node);
  const std::optional<Path> path = ParsePath(in.target_path);
  if (!path) {
    return Status::Invalid("{}.target.path is \"{}\", expected translation, rotation, scale or weights",
                           where, in.target_path);
  }
  channel.path = *path;
  if (in.sampler < 0 || static_cast<std::size_t>(in.sampler) >= animation.samplers.size()) {
    return Status::Invalid("{}.sampler is {}, there are {} samplers", where, in.sampler,
                           animation.samplers.size());
  }
  const tinygltf::AnimationSampler& sampler = animation.samplers[static_cast<std::size_t>(in.sampler)];
  const std::string sampler_place = fmt::format("{}.samplers[{}]", animation_place, in.sampler);
  const std::optional<Interpolation> interpolation = ParseInterpolation(sampler.interpolation);
  if (!interpolation) {
    return Status::Invalid("{}.interpolation is \"{}\", expected LINEAR, STEP or CUBICSPLINE", sampler_place,
                           sampler.interpolation);
  }
  channel.interpolation = *interpolation;

  const Node& node = character.nodes[channel.node];
  if (channel.path == Path::kWeights) {
    const std::size_t targets = node.mesh == kNoIndex ? 0 : character.meshes[node.mesh].targets.size();
    if (targets == 0) {
      warnings->push_back(
          fmt::format("{} animates morph weights of nodes[{}], which has no morph targets; ignored", where,
                      channel.node));
      return std::optional<Channel>();
    }
    channel.components = static_cast<int>(targets);
  } else {
    if (node.has_matrix) {
      return Status::Invalid(
          "{} animates nodes[{}], which has a matrix; expected translation, rotation and scale", where,
          channel.node);
    }
    channel.components = channel.path == Path::kRotation ? 4 : 3;
  }
  KPSA_RETURN_IF_ERROR(ReadTimes(document, sampler.input, sampler_place + ".input", &channel.times));
  KPSA_RETURN_IF_ERROR(ReadValues(document, sampler.output, sampler_place + ".output", &channel));
  return std::optional<Channel>(std::move(channel));
}

}  // namespace

Status ReadClips(const Document& document, Character* character) {
  const tinygltf::Model& model = *document.model;
  std::vector<std::string> warnings = document.warnings;
  for (std::size_t a = 0; a < model.animations.size(); ++a) {
    const tinygltf::Animation& in = model.animations[a];
    const std::string animation_place = fmt::format("animations[{}]", a);
    Clip clip;
    clip.name = in.name;
    clip.id = in.name.empty() ? fmt::format("anim{}", a) : in.name;
    const auto taken = [&] {
      return std::any_of(character->clips.begin(), character->clips.end(),
                         [&](const Clip& other) { return other.id == clip.id; });
    };
    if (taken()) clip.id += fmt::format("#{}", a);  // legal; nodes of one name are told apart in the same way
    std::set<std::pair<Index, Path>> seen;
    for (std::size_t c = 0; c < in.channels.size(); ++c) {
      const std::string where = fmt::format("{}.channels[{}]", animation_place, c);
      Result<std::optional<Channel>> channel =
          ReadChannel(document, in, in.channels[c], where, animation_place, *character, &warnings);
      if (!channel.ok()) return channel.status();
      if (!channel->has_value()) continue;
      Channel& read = **channel;
      if (!seen.emplace(read.node, read.path).second) {
        return Status::Invalid("{} animates {} of nodes[{}], as a channel before does", where,
                               in.channels[c].target_path, read.node);
      }
      clip.duration = std::max(clip.duration, read.times.back());
      clip.channels.push_back(std::move(read));
    }
    character->clips.push_back(std::move(clip));
  }
  character->warnings = std::move(warnings);
  return {};
}

}  // namespace kpsa::engine::gltf
