#include "rig/build/steps/add_clips.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "rig/file/values.h"

namespace kpsa::engine {
namespace {

constexpr double kMaxSeconds = 1e6;

// Whether a name is what a pattern with * (any text) and ? (any byte) says. Linear but for the last star.
bool Matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, resume = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++, resume = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p, ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1, n = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

// By glTF node: whether a pattern of the mask names it. Every pattern names a node that the clip animates.
std::vector<bool> MaskedNodes(const BuildInput& in, const RigClipLayer& layer) {
  const gltf::Clip& clip = in.rig.character->clips[in.rig.character->FindClip(layer.clip.text)];
  std::vector<bool> animated(in.rig.character->nodes.size(), false), moves = animated;
  for (const gltf::Channel& channel : clip.channels) animated[channel.node] = true;
  for (const RigString& pattern : layer.mask) {
    bool any = false, any_animated = false;
    std::vector<std::string> names;
    for (Index i = 0; i < moves.size(); ++i) {
      const std::string& name = in.graph().name(in.rig.scene.transforms[i]);
      names.push_back(name);
      if (!Matches(pattern.text, name) && !Matches(pattern.text, in.rig.character->nodes[i].name)) continue;
      any = true;
      any_animated = any_animated || animated[i];
      moves[i] = true;
    }
    if (!any) {
      in.Fail(pattern.where, Status::Invalid("mask: \"{}\" matches no node of the character{}", pattern.text,
                                             DidYouMean(pattern.text, names)));
    } else if (!any_animated) {
      in.Fail(pattern.where, Status::Invalid("mask: \"{}\" matches nothing that the clip \"{}\" moves",
                                             pattern.text, layer.clip.text));
    }
  }
  return moves;
}

// *end: raised to when the layer is over.
void AddLayer(const BuildInput& in, const RigClip& clip, const RigClipLayer& from, LayeredClip* to,
              double* end) {
  LayeredClip::Layer layer;
  layer.clip = in.rig.character->FindClip(from.clip.text);
  if (layer.clip == kNoIndex) {
    std::vector<std::string> names;
    for (const gltf::Clip& known : in.rig.character->clips) names.push_back(known.id);
    in.Fail(from.clip.where, Status::Invalid("clip \"{}\": the character has no clip \"{}\"{}", clip.name,
                                             from.clip.text, DidYouMean(from.clip.text, names)));
    return;
  }
  if (from.start.has_value() &&
      !ReadStart(*from.start, in.rig.fps, in.units(clip.source), &layer.start, in.errors))
    return;
  layer.weight = from.weight;
  layer.additive = from.additive;
  layer.speed = from.speed;
  layer.loop = from.loop;
  if (!from.mask.empty()) layer.moves = MaskedNodes(in, from);
  const double lasts = in.rig.character->clips[layer.clip].duration / std::max(std::abs(layer.speed), 1e-3);
  *end = std::clamp(layer.start + lasts, *end, kMaxSeconds);
  to->layers.push_back(std::move(layer));
}

}  // namespace

void AddClips(const BuildInput& in, CharacterGraph* scene) {
  for (const RigClip& from : in.file.clips) {
    if (in.errors->full()) return;
    if (in.rig.character->FindClip(from.name) != kNoIndex) {
      in.Fail(from.where,
              Status::Invalid("the character has a clip \"{}\" already: expected another name", from.name));
      continue;
    }
    LayeredClip to;
    to.id = from.name;
    double end = 0;
    for (const RigClipLayer& layer : from.layers) AddLayer(in, from, layer, &to, &end);
    CharacterClip clip{from.name, end, 0};
    if (from.frames.has_value()) {
      clip.begin = static_cast<double>(from.frames->first) / in.rig.fps;
      clip.duration = static_cast<double>(from.frames->second) / in.rig.fps;
    }
    scene->clips.push_back(clip);
    scene->layered.push_back(std::move(to));
  }
}

}  // namespace kpsa::engine
