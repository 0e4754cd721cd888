#include "kpsa/tiles_file.h"

#include <string>
#include <utility>

#include "kpsa/subspace_tensors.h"

namespace kpsa::engine {

void AddTiles(const Subspace& s, SafetensorsWriter* writer) {
  for (std::size_t i = 0; i < s.tiles.size(); ++i) {
    const TileData& data = s.tiles[i].data();
    const std::string prefix = fmt::format("tiles.{}.", i);
    const SubspaceOutput& output = s.outputs[i];
    if (!output.stepped.starts.empty()) {  // else the header says which tiles
      Add<std::uint32_t>(writer, prefix + "stepped", output.stepped.points);
      Add<std::uint32_t>(writer, prefix + "starts", output.stepped.starts);
    }
    Add<std::uint32_t>(writer, prefix + "ranks", data.ranks);
    Add<std::uint32_t>(writer, prefix + "wide", data.wide);
    Add<std::uint8_t>(writer, prefix + "direct", data.direct);
    Add<std::uint32_t>(writer, prefix + "counts", data.counts);
    Add<std::uint32_t>(writer, prefix + "columns", data.columns);
    Add<float>(writer, prefix + "scale", data.scale.span());
    Add<std::uint16_t>(writer, prefix + "v", data.v.span(), true);
    Add<std::uint8_t>(writer, prefix + "u", data.u.span());
    Add<float>(writer, prefix + "mean", data.mean.span());
    if (!data.joints.empty()) {
      Add<std::uint32_t>(writer, prefix + "joints", data.joints);
      Add<std::uint32_t>(writer, prefix + "jointRows", data.joint_rows);
      Add<double>(writer, prefix + "jointMean", data.joint_mean);
      Add<double>(writer, prefix + "jointDeviation", data.joint_deviation);
    }
    if (data.products.empty()) continue;
    Add<std::uint32_t>(writer, prefix + "products", data.products);
    Add<std::uint8_t>(writer, prefix + "pairs", data.pairs);
    Add<float>(writer, prefix + "whitening", data.whitening.span());
    Add<std::uint16_t>(writer, prefix + "w", data.w.span(), true);
    Add<std::uint16_t>(writer, prefix + "doubt", data.doubt.span(), true);
  }
}

Status ReadTiles(const SafetensorsFile& file, const std::string& file_digest, Subspace* s) {
  constexpr std::uint64_t kAny = SafetensorsFile::kAnySize;
  const auto known = [&](std::size_t map) -> std::optional<Digest> {
    if (file_digest.empty()) return std::nullopt;
    Hasher hasher;
    hasher.Add(std::string_view(file_digest));
    hasher.Add(static_cast<std::uint64_t>(map));
    return hasher.Finish();
  };
  for (std::size_t i = 0; i < s->outputs.size(); ++i) {
    const std::string prefix = fmt::format("tiles.{}.", i);
    if (file.tensors().contains(prefix + "stepped")) {
      SteppedPoints& stepped = s->outputs[i].stepped;
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "stepped", {kAny}), &stepped.points));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "starts", {kAny}), &stepped.starts));
    }
    TileData data;
    data.points = s->outputs[i].reconstructed();
    data.components = s->components;
    data.inputs = s->tile_inputs();
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "ranks", {kAny}), &data.ranks));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "wide", {kAny}), &data.wide));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint8_t>(prefix + "direct", {kAny}), &data.direct));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "counts", {kAny}), &data.counts));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "columns", {kAny}), &data.columns));
    KPSA_RETURN_IF_ERROR(ReadAligned(file, prefix + "scale", &data.scale));
    KPSA_RETURN_IF_ERROR(ReadAligned(file, prefix + "v", &data.v, true));
    KPSA_RETURN_IF_ERROR(ReadAligned(file, prefix + "u", &data.u));
    KPSA_RETURN_IF_ERROR(ReadAligned(file, prefix + "mean", &data.mean));
    if (file.tensors().contains(prefix + "products")) {
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "products", {kAny}), &data.products));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint8_t>(prefix + "pairs", {kAny}), &data.pairs));
      KPSA_RETURN_IF_ERROR(ReadAligned(file, prefix + "whitening", &data.whitening));
      KPSA_RETURN_IF_ERROR(ReadAligned(file, prefix + "w", &data.w, true));
      KPSA_RETURN_IF_ERROR(ReadAligned(file, prefix + "doubt", &data.doubt, true));
    }
    if (file.tensors().contains(prefix + "joints")) {
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "joints", {kAny}), &data.joints));
      KPSA_RETURN_IF_ERROR(
          Assign(file.Values<std::uint32_t>(prefix + "jointRows", {kAny}), &data.joint_rows));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<double>(prefix + "jointMean", {kAny}), &data.joint_mean));
      KPSA_RETURN_IF_ERROR(
          Assign(file.Values<double>(prefix + "jointDeviation", {kAny}), &data.joint_deviation));
    }
    Result<TileMap> map = TileMap::Make(std::move(data), "tiles of \"" + s->outputs[i].name + "\"", known(i));
    if (!map.ok()) return map.status();
    s->tiles.push_back(std::move(*map));
  }
  return {};
}

}  // namespace kpsa::engine
