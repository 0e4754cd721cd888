// Clips of the rig's own: what `clips:` says, looked up in the character.
#include <algorithm>
#include <cmath>

#include "rig/build/rig_build.h"

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

}  // namespace

void RigBuild::AddClips() {
  for (const RigClip& from : file_->clips) {
    if (errors_->full()) return;
    if (rig_->character->FindClip(from.name) != kNoIndex) {
      Fail(from.where,
           Status::Invalid("the character has a clip \"{}\" already: expected another name", from.name));
      continue;
    }
    LayeredClip to;
    to.id = from.name;
    double end = 0;
    for (const RigClipLayer& layer : from.layers) AddLayer(from, layer, &to, &end);
    CharacterClip clip{from.name, end, 0};
    if (from.frames.has_value()) {
      clip.begin = static_cast<double>(from.frames->first) / rig_->fps;
      clip.duration = static_cast<double>(from.frames->second) / rig_->fps;
    }
    rig_->scene.clips.push_back(clip);
    rig_->scene.layered.push_back(std::move(to));
  }
}

// *end: raised to when the layer is over.
void RigBuild::AddLayer(const RigClip& clip, const RigClipLayer& from, LayeredClip* to, double* end) {
  LayeredClip::Layer layer;
  layer.clip = rig_->character->FindClip(from.clip.text);
  if (layer.clip == kNoIndex) {
    std::vector<std::string> names;
    for (const gltf::Clip& known : rig_->character->clips) names.push_back(known.id);
    Fail(from.clip.where, Status::Invalid("clip \"{}\": the character has no clip \"{}\"{}", clip.name,
                                          from.clip.text, DidYouMean(from.clip.text, names)));
    return;
  }
  if (from.start.has_value() &&
      !ReadStart(*from.start, rig_->fps, units(clip.source), &layer.start, errors_))
    return;
  layer.weight = from.weight;
  layer.additive = from.additive;
  layer.speed = from.speed;
  layer.loop = from.loop;
  if (!from.mask.empty()) layer.moves = MaskedNodes(from);
  const double lasts = rig_->character->clips[layer.clip].duration / std::max(std::abs(layer.speed), 1e-3);
  *end = std::clamp(layer.start + lasts, *end, kMaxSeconds);
  to->layers.push_back(std::move(layer));
}

// By glTF node: whether a pattern of the mask names it. Every pattern names a node that the clip animates.
std::vector<bool> RigBuild::MaskedNodes(const RigClipLayer& layer) {
  const gltf::Clip& clip = rig_->character->clips[rig_->character->FindClip(layer.clip.text)];
  std::vector<bool> animated(rig_->character->nodes.size(), false), moves = animated;
  for (const gltf::Channel& channel : clip.channels) animated[channel.node] = true;
  for (const RigString& pattern : layer.mask) {
    bool any = false, any_animated = false;
    std::vector<std::string> names;
    for (Index i = 0; i < moves.size(); ++i) {
      const std::string& name = graph().name(rig_->scene.transforms[i]);
      names.push_back(name);
      if (!Matches(pattern.text, name) && !Matches(pattern.text, rig_->character->nodes[i].name)) continue;
      any = true;
      any_animated = any_animated || animated[i];
      moves[i] = true;
    }
    if (!any) {
      Fail(pattern.where, Status::Invalid("mask: \"{}\" matches no node of the character{}", pattern.text,
                                          DidYouMean(pattern.text, names)));
    } else if (!any_animated) {
      Fail(pattern.where, Status::Invalid("mask: \"{}\" matches nothing that the clip \"{}\" moves",
                                          pattern.text, layer.clip.text));
    }
  }
  return moves;
}

}  // namespace kpsa::engine
