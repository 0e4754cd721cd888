#include "kpsa/subspace_digest.h"

#include <span>
#include <string_view>

#include "base/digest.h"
#include "kpsa/calibration_file.h"
#include "kpsa/subspace_header.h"

namespace kpsa::engine {

std::string ModesDigest(const Subspace& s) {
  Hasher hasher;
  hasher.Add(std::span<const float>(s.kept_modes.values));
  return hasher.Finish().ToHex();
}

std::string FileDigest(const SafetensorsFile& file) {
  Hasher hasher;
  for (const auto& [key, text] : file.metadata()) {
    if (key == kDigest || key == kModesDigest) continue;
    hasher.Add(std::string_view(key));
    hasher.Add(std::string_view(text));
  }
  for (const auto& [key, tensor] : file.tensors()) {
    if (key == kModes) continue;
    hasher.Add(std::string_view(key));
    hasher.Add(TensorTypeName(tensor.type));
    hasher.Add(std::span<const std::uint64_t>(tensor.shape));
    hasher.AddLong(tensor.bytes);
  }
  return hasher.Finish().ToHex();
}

std::string ContentDigest(const Subspace& s, const std::map<std::string, std::string>& metadata) {
  Hasher hasher;
  for (const char* key : {"cues", "frame", "kind", "outputs", "ranges", "rigHash", "space", "summary",
                          "training", "units", "version"}) {
    hasher.Add(std::string_view(key));
    const auto text = metadata.find(key);
    hasher.Add(text == metadata.end() ? std::string_view() : std::string_view(text->second));
  }
  hasher.Add(std::span<const double>(s.cue_mean));
  hasher.Add(std::span<const double>(s.cue_scale));
  hasher.Add(std::span<const Index>(s.soft_cache.offsets));
  hasher.Add(std::span<const float>(s.soft_cache.factor.span()));
  hasher.Add(std::span<const float>(s.soft_cache.leave_one_out));
  if (!s.latent.empty()) hasher.Add(std::span<const float>(s.latent));
  HashCalibration(s, &hasher);
  for (const TileMap& tiles : s.tiles) {
    const TileData& data = tiles.data();
    for (const auto* list : {&data.ranks, &data.wide, &data.counts, &data.columns})
      hasher.Add(std::span<const std::uint32_t>(*list));
    hasher.Add(std::span<const std::uint8_t>(data.direct));
    hasher.Add(std::span<const float>(data.scale.span()));
    hasher.Add(std::span<const std::uint16_t>(data.v.span()));
    hasher.Add(std::span<const std::uint8_t>(data.u.span()));
    hasher.Add(std::span<const float>(data.mean.span()));
    if (!data.joints.empty()) {
      for (const auto* list : {&data.joints, &data.joint_rows})
        hasher.Add(std::span<const std::uint32_t>(*list));
      for (const auto* list : {&data.joint_mean, &data.joint_deviation})
        hasher.Add(std::span<const double>(*list));
    }
    if (data.products.empty()) continue;
    hasher.Add(std::span<const std::uint32_t>(data.products));
    hasher.Add(std::span<const std::uint8_t>(data.pairs));
    hasher.Add(std::span<const float>(data.whitening.span()));
    hasher.Add(std::span<const std::uint16_t>(data.w.span()));
    hasher.Add(std::span<const std::uint16_t>(data.doubt.span()));
  }
  return hasher.Finish().ToHex();
}

}  // namespace kpsa::engine
