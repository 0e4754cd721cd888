// `clips:` of a rig file: clips of the character over each other. `references:`: other rigs.
#include "rig/file/sections.h"

namespace kpsa::engine {
namespace {

constexpr std::size_t kMaxLayers = 64;
constexpr std::int64_t kMaxFrame = 1'000'000;
constexpr std::size_t kMaxNamespace = 256;

}  // namespace

void SectionReader::ReadClips(const YamlNode& node) {
  if (!CheckMap(node, "clips")) return;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const YamlNode& key = node.keys[i];
    if (!define("clip", key.scalar, key.where())) continue;
    auto clip = Declared<RigClip>(key);
    YamlMap map(node.items[i], fmt::format("clip \"{}\"", key.scalar), errors);
    const YamlNode* layers = map.Required("layers");
    if (layers != nullptr &&
        (!layers->is_sequence() || layers->items.empty() || layers->items.size() > kMaxLayers)) {
      errors->Add(*layers, "layers: expected a list of 1 to {} {{clip: NAME, ...}}", kMaxLayers);
    } else if (layers != nullptr) {
      for (const YamlNode& layer : layers->items) ReadLayer(layer, &clip);
    }
    if (const YamlNode* frames = map.Find("frames")) {
      std::int64_t first = 0, last = 0;
      if (!frames->is_sequence() || frames->items.size() != 2) {
        errors->Add(*frames, "frames: expected the first and the last frame, as in [0, 144]");
      } else if (ReadInteger(frames->items[0], "frames", -kMaxFrame, kMaxFrame, &first, errors) &&
                 ReadInteger(frames->items[1], "frames", -kMaxFrame, kMaxFrame, &last, errors)) {
        if (last < first) errors->Add(*frames, "frames: the last, {}, is before the first, {}", last, first);
        clip.frames = {first, last};
      }
    }
    map.RejectUnread();
    rig->clips.push_back(std::move(clip));
  }
}

void SectionReader::ReadLayer(const YamlNode& node, RigClip* clip) const {
  YamlMap map(node, "layer", errors);
  RigClipLayer layer;
  if (const YamlNode* name = map.Required("clip")) {
    layer.clip = {{}, name->where(), source};
    ReadString(*name, "clip", &layer.clip.text, errors);
  }
  if (const YamlNode* weight = map.Find("weight");
      weight != nullptr && ReadNumber(*weight, "weight", Unit::kNone, units(), &layer.weight, errors) &&
      !(layer.weight >= 0 && layer.weight <= 1)) {
    errors->Add(*weight, "weight: expected 0 to 1, found {}", weight->scalar);
  }
  std::string mode = "override";
  if (const YamlNode* text = map.Find("mode"); text != nullptr && ReadString(*text, "mode", &mode, errors)) {
    if (mode != "additive" && mode != "override")
      errors->Add(*text, "mode: unknown \"{}\"{}; expected additive or override", mode,
                  DidYouMean(mode, {"additive", "override"}));
  }
  layer.additive = mode == "additive";
  if (const YamlNode* mask = map.Find("mask")) {
    ReadNames(*mask, "mask", &layer.mask);
    if (layer.mask.empty()) errors->Add(*mask, "mask: expected at least one name of nodes");
  }
  if (const YamlNode* start = map.Find("start")) layer.start = *start;
  if (const YamlNode* speed = map.Find("speed"))
    ReadNumber(*speed, "speed", Unit::kNone, units(), &layer.speed, errors);
  if (const YamlNode* loop = map.Find("loop")) ReadBool(*loop, "loop", &layer.loop, errors);
  map.RejectUnread();
  if (!layer.clip.text.empty()) clip->layers.push_back(std::move(layer));
}

void SectionReader::ReadReferences(const YamlNode& node) {
  if (!CheckMap(node, "references")) return;
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const YamlNode& key = node.keys[i];
    if (key.scalar.empty() || key.scalar.size() > kMaxNamespace ||
        key.scalar.find(':') != std::string::npos) {
      errors->Add(key, "a reference needs a name of at most {} bytes, without a colon", kMaxNamespace);
      continue;
    }
    if (!define("reference", key.scalar, key.where())) continue;
    auto reference = Declared<RigReference>(key);
    YamlMap map(node.items[i], fmt::format("reference \"{}\"", key.scalar), errors);
    const YamlNode* file = map.Required("file");
    if (const YamlNode* translate = map.Find("translate")) reference.translate = *translate;
    if (const YamlNode* start = map.Find("start")) reference.start = *start;
    if (const YamlNode* clip = map.Find("clip")) {
      reference.clip = RigString{{}, clip->where(), source};
      ReadString(*clip, "clip", &reference.clip->text, errors);
    }
    map.RejectUnread();
    if (file == nullptr || !ReadString(*file, "file", &reference.file.text, errors)) continue;
    auto resolved = ResolvePath(*rig, source, reference.file.text, *file, errors);
    if (!resolved.has_value()) {
      rig->complete = false;
      continue;
    }
    reference.file.text = std::move(*resolved);
    reference.file.where = file->where();
    reference.file.source = source;
    rig->references.push_back(std::move(reference));
  }
}

}  // namespace kpsa::engine
