// The .kpsa file: lists as JSON in the metadata, numbers as tensors. See kpsa/subspace.h and
// files/safetensors.h.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "base/digest.h"
#include "files/safetensors.h"
#include "kpsa/calibration_file.h"
#include "kpsa/pose_kind.h"
#include "kpsa/subspace.h"
#include "kpsa/subspace_tensors.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

constexpr char kKind[] = "kpsa-subspace";
constexpr char kModes[] = "modes", kModesDigest[] = "modesDigest", kLatent[] = "latent";
constexpr std::size_t kMaxCues = 1u << 16, kMaxOutputs = 1u << 12;
constexpr std::uint64_t kMaxPoints = 1u << 28;

// Reads typed members of a JSON object; the first failure is kept, and everything after it gives defaults.
class Reader {
 public:
  Reader(std::string place, const Json& object, Status* status)
      : place_(std::move(place)), object_(object), status_(status) {}
  std::string Text(const char* key) {
    const Json* value = Find(key);
    if (value != nullptr && value->is_string()) return value->get<std::string>();
    return Fail(key, "a string"), std::string();
  }
  double Number(const char* key) {
    const Json* value = Find(key);
    if (value != nullptr && value->is_number() && std::isfinite(value->get<double>()))
      return value->get<double>();
    return Fail(key, "a number"), 0.0;
  }
  std::uint64_t Count(const char* key, std::uint64_t limit) {
    const Json* value = Find(key);
    if (value != nullptr && value->is_number_unsigned() && value->get<std::uint64_t>() <= limit)
      return value->get<std::uint64_t>();
    return Fail(key, "a whole number within bounds"), std::uint64_t{0};
  }

 private:
  const Json* Find(const char* key) const {
    if (!object_.is_object()) return nullptr;
    const auto found = object_.find(key);
    return found == object_.end() ? nullptr : &*found;
  }
  void Fail(const char* key, const char* expected) {
    if (status_->ok()) *status_ = Status::Invalid("{}: \"{}\" should be {}", place_, key, expected);
  }
  std::string place_;
  const Json& object_;
  Status* status_;
};

// A metadata entry that holds JSON of the wanted kind.
Result<Json> JsonMetadata(const SafetensorsFile& file, const std::string& key, bool list, std::size_t limit) {
  const Result<std::string> text = file.Metadata(key);
  if (!text.ok()) return text.status();
  int depth_reached = 0;
  const auto callback = [&](int depth, Json::parse_event_t, Json&) {
    depth_reached = std::max(depth_reached, depth);
    return depth <= 8;
  };
  Json json = Json::parse(*text, callback, false);
  if (json.is_discarded() || depth_reached > 8 || json.is_array() != list || (!list && !json.is_object()) ||
      json.size() > limit) {
    return Status::Invalid("{}: \"{}\" is not a JSON {} of at most {} entries", file.name(), key,
                           list ? "list" : "object", limit);
  }
  return json;
}

constexpr char kRangePatches[] = "patches";  // that a range speaks of; missing: of all

// A subspace without any of what is new is what it was before.
int VersionOf(const Subspace& s) {
  const bool products =
      std::any_of(s.tiles.begin(), s.tiles.end(), [](const TileMap& t) { return t.has_products(); });
  const bool relative = std::any_of(s.cues.begin(), s.cues.end(), [](const CueDescription& cue) {
    return cue.plug.find(".worldMatrix/") != std::string::npos;
  });
  const bool multiplied = std::any_of(s.cues.begin(), s.cues.end(), [](const CueDescription& cue) {
    return cue.kind == CueDescription::Kind::kProduct;
  });
  if (AnyNearClips(s)) return kSubspaceVersion;
  if (std::ranges::any_of(s.ranges, [](const TrainedRange& r) { return r.patches != kAllPatches; }))
    return kGuardedPatchesVersion;
  if (s.patches.tiles > 0) return kPatchesVersion;
  if (multiplied) return kProductCuesVersion;
  return products || relative || s.score != ScoreMix() ? kProductTilesVersion : kOldestVersion;
}

std::map<std::string, std::string> Header(const Subspace& s) {
  Json outputs = Json::array(), cues = Json::array(), ranges = Json::array();
  for (const SubspaceOutput& output : s.outputs)
    outputs.push_back({{"name", output.name}, {"points", output.points}, {"stage", output.stage}});
  for (const CueDescription& cue : s.cues) {
    if (cue.kind == CueDescription::Kind::kScalar) {
      cues.push_back({{"kind", "scalar"}, {"plug", cue.plug}});
    } else if (cue.kind == CueDescription::Kind::kProduct) {
      Json factors = Json::array();
      for (const CueDescription::Factor& factor : cue.factors) {
        factors.push_back({{"plug", factor.plug},
                           {"centre", factor.curve.centre},
                           {"scale", factor.curve.scale},
                           {"hinge", factor.curve.hinge}});
      }
      cues.push_back({{"kind", "product"}, {"factors", factors}, {"lo", cue.lo}, {"hi", cue.hi}});
    } else {
      cues.push_back({{"kind", "point"}, {"stage", cue.stage}, {"mesh", cue.mesh}, {"point", cue.point}});
    }
    if (!cue.joint.empty()) cues.back()["joint"] = cue.joint;
  }
  for (const TrainedRange& range : s.ranges) {
    ranges.push_back({{"plug", range.plug}, {"lo", range.lo}, {"hi", range.hi}, {"ramp", range.ramp}});
    if (range.patches == kAllPatches) continue;
    Json& patches = ranges.back()[kRangePatches] = Json::array();
    for (std::size_t p = 0; p < kMaxPatches; ++p) {
      if ((range.patches >> p & 1) != 0) patches.push_back(p);
    }
  }
  Json frame = {{"extent", s.extent}, {"scales", s.space_scales}, {"carried", s.carried}};
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) frame["inverseRestStretch"].push_back(s.inverse_rest_stretch(r, c));
  }
  Json summary = {{"mode", s.mode == EstimatorMode::kMap ? "map" : "paper"},
                  {"components", s.components},
                  {"modes", s.modes},
                  {"quantile1", s.soft_cache.quantile1},
                  {"quantile2", s.soft_cache.quantile2},
                  {"tolerance", s.tolerance},
                  {"violationRate", s.violation_rate},
                  {"blendStart", s.blend_start}};
  if (VersionOf(s) > kOldestVersion) summary["score"] = {s.score.measured, s.score.doubt};
  if (s.patches.tiles > 0) {
    summary["tilesOfPatch"] = s.patches.tiles;
    summary["patchShare"] = s.patches.share;
  }
  return {{"kind", kKind},
          {"version", std::to_string(VersionOf(s))},
          {"summary", summary.dump()},
          {"outputs", outputs.dump()},
          {"cues", cues.dump()},
          {"ranges", ranges.dump()},
          {"rigHash", s.rig_hash},
          {"units", s.units},
          {"space", s.space},
          {"frame", frame.dump()},
          {"training", s.training}};
}

std::span<const float> ModeValues(const Subspace& s) { return s.kept_modes.values; }

std::string ModesDigest(const Subspace& s) {
  Hasher hasher;
  hasher.Add(ModeValues(s));
  return hasher.Finish().ToHex();
}

// Of all that the file says but the kept modes, which have a digest of their own: a damaged one is refused,
// as numbers that are only a little wrong would not be seen.
std::string ContentDigest(const Subspace& s) {
  Hasher hasher;
  for (const auto& [key, text] : Header(s)) {
    hasher.Add(std::string_view(key));
    hasher.Add(std::string_view(text));
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

// What the space was at rest, and what moves with it.
Status ReadFrame(const SafetensorsFile& file, const Json& frame, Subspace* s) {
  const auto bad = [&](const char* key, const char* expected) {
    return Status::Invalid("{}: frame: \"{}\" should be {}", file.name(), key, expected);
  };
  if (!frame.contains("scales") || !frame["scales"].is_boolean()) return bad("scales", "true or false");
  s->space_scales = frame["scales"].get<bool>();
  if (!frame.contains("carried") || !frame["carried"].is_array() || frame["carried"].size() > kMaxCues)
    return bad("carried", "a list of names");
  for (const Json& name : frame["carried"]) {
    if (!name.is_string()) return bad("carried", "a list of names");
    s->carried.push_back(name.get<std::string>());
  }
  const char* const kStretch = "inverseRestStretch";
  if (!frame.contains(kStretch) || !frame[kStretch].is_array() || frame[kStretch].size() != 9)
    return bad(kStretch, "nine numbers");
  for (int i = 0; i < 9; ++i) {
    const Json& entry = frame[kStretch][static_cast<std::size_t>(i)];
    if (!entry.is_number()) return bad(kStretch, "nine numbers");
    s->inverse_rest_stretch(i / 3, i % 3) = entry.get<double>();
  }
  return {};
}

Status ReadHeader(const SafetensorsFile& file, Subspace* s) {
  const Result<Json> summary = JsonMetadata(file, "summary", false, 64),
                     outputs = JsonMetadata(file, "outputs", true, kMaxOutputs),
                     cues = JsonMetadata(file, "cues", true, kMaxCues),
                     ranges = JsonMetadata(file, "ranges", true, kMaxCues),
                     frame = JsonMetadata(file, "frame", false, 64),
                     training = JsonMetadata(file, "training", false, 1u << 16);
  for (const Result<Json>* part : {&summary, &outputs, &cues, &ranges, &frame, &training})
    KPSA_RETURN_IF_ERROR(part->status());
  Status status;
  Reader reader(file.name() + ": summary", *summary, &status);
  const std::string mode = reader.Text("mode");
  if (status.ok() && mode != "map" && mode != "paper")
    return Status::Invalid("{}: the mode is \"{}\", expected map or paper", file.name(), mode);
  s->mode = s->soft_cache.mode = mode == "paper" ? EstimatorMode::kPaper : EstimatorMode::kMap;
  s->components = static_cast<int>(reader.Count("components", 3));
  s->modes = s->soft_cache.modes = reader.Count("modes", 1u << 20);
  s->soft_cache.quantile1 = reader.Number("quantile1");
  s->soft_cache.quantile2 = reader.Number("quantile2");
  s->tolerance = reader.Number("tolerance");
  s->violation_rate = reader.Number("violationRate");
  s->blend_start = reader.Number("blendStart");
  if (summary->contains("score")) {
    const Json& score = (*summary)["score"];
    if (!score.is_array() || score.size() != 2 || !score[0].is_number() || !score[1].is_number())
      return Status::Invalid("{}: summary: \"score\" should be two numbers", file.name());
    s->score = {score[0].get<double>(), score[1].get<double>()};
  }
  if (summary->contains("tilesOfPatch")) {
    s->patches.tiles = reader.Count("tilesOfPatch", kMaxPoints);
    s->patches.share = reader.Number("patchShare");
  }
  for (const Json& entry : *outputs) {
    Reader output(file.name() + ": an output", entry, &status);
    s->outputs.push_back({output.Text("name"), output.Count("points", kMaxPoints), output.Text("stage")});
  }
  for (const Json& entry : *cues) {
    Reader reader_of_cue(file.name() + ": a cue", entry, &status);
    CueDescription cue;
    const std::string kind = reader_of_cue.Text("kind");
    if (kind == "scalar") {
      cue.kind = CueDescription::Kind::kScalar;
      cue.plug = reader_of_cue.Text("plug");
    } else if (kind == "point") {
      cue.stage = reader_of_cue.Text("stage");
      cue.mesh = static_cast<Index>(reader_of_cue.Count("mesh", kMaxOutputs));
      cue.point = static_cast<Index>(reader_of_cue.Count("point", kMaxPoints));
    } else if (kind == "product") {
      cue.kind = CueDescription::Kind::kProduct;
      cue.lo = reader_of_cue.Number("lo"), cue.hi = reader_of_cue.Number("hi");
      if (!entry.contains("factors") || !entry["factors"].is_array())
        return Status::Invalid("{}: a cue: \"factors\" should be an array", file.name());
      for (const Json& part : entry["factors"]) {
        Reader factor(file.name() + ": a factor", part, &status);
        cue.factors.push_back({factor.Text("plug"), {factor.Number("centre"), factor.Number("scale")}});
        cue.factors.back().curve.hinge = part.is_object() && part.value("hinge", Json(false)) == Json(true);
      }
    } else if (status.ok()) {
      return Status::Invalid("{}: a cue is of kind \"{}\", expected point, scalar or product", file.name(),
                             kind);
    }
    if (entry.is_object() && entry.contains("joint")) cue.joint = reader_of_cue.Text("joint");
    s->cues.push_back(std::move(cue));
  }
  for (const Json& entry : *ranges) {
    Reader range(file.name() + ": a trained range", entry, &status);
    s->ranges.push_back({range.Text("plug"), range.Number("lo"), range.Number("hi"), range.Number("ramp")});
    if (!entry.is_object() || !entry.contains(kRangePatches)) continue;
    const Json& patches = entry[kRangePatches];
    s->ranges.back().patches = 0;
    bool known = patches.is_array() && !patches.empty();
    for (std::size_t i = 0; known && i < patches.size(); ++i) {
      known = patches[i].is_number_unsigned() && patches[i].get<std::uint64_t>() < kMaxPatches;
      if (known) s->ranges.back().patches |= std::uint64_t{1} << patches[i].get<std::uint64_t>();
    }
    if (!known)
      return Status::Invalid("{}: a trained range: \"{}\" should be numbers of patches", file.name(),
                             kRangePatches);
  }
  s->extent = Reader(file.name() + ": frame", *frame, &status).Number("extent");
  KPSA_RETURN_IF_ERROR(ReadFrame(file, *frame, s));
  for (const auto& [key, target] : {std::pair{"rigHash", &s->rig_hash},
                                    {"units", &s->units},
                                    {"space", &s->space},
                                    {"training", &s->training}}) {
    const Result<std::string> text = file.Metadata(key);
    KPSA_RETURN_IF_ERROR(text.status());
    *target = *text;
  }
  return status;
}

Status ReadTiles(const SafetensorsFile& file, Subspace* s) {
  constexpr std::uint64_t kAny = SafetensorsFile::kAnySize;
  for (std::size_t i = 0; i < s->outputs.size(); ++i) {
    const std::string prefix = fmt::format("tiles.{}.", i);
    TileData data;
    data.points = s->outputs[i].points;
    data.components = s->components;
    data.inputs = s->tile_inputs();
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "ranks", {kAny}), &data.ranks));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "wide", {kAny}), &data.wide));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint8_t>(prefix + "direct", {kAny}), &data.direct));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "counts", {kAny}), &data.counts));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "columns", {kAny}), &data.columns));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<float>(prefix + "scale", {kAny}), &data.scale));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint16_t>(prefix + "v", {kAny}, true), &data.v));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint8_t>(prefix + "u", {kAny}), &data.u));
    KPSA_RETURN_IF_ERROR(Assign(file.Values<float>(prefix + "mean", {kAny}), &data.mean));
    if (file.tensors().contains(prefix + "products")) {
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "products", {kAny}), &data.products));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint8_t>(prefix + "pairs", {kAny}), &data.pairs));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<float>(prefix + "whitening", {kAny}), &data.whitening));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint16_t>(prefix + "w", {kAny}, true), &data.w));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint16_t>(prefix + "doubt", {kAny}, true), &data.doubt));
    }
    if (file.tensors().contains(prefix + "joints")) {
      KPSA_RETURN_IF_ERROR(Assign(file.Values<std::uint32_t>(prefix + "joints", {kAny}), &data.joints));
      KPSA_RETURN_IF_ERROR(
          Assign(file.Values<std::uint32_t>(prefix + "jointRows", {kAny}), &data.joint_rows));
      KPSA_RETURN_IF_ERROR(Assign(file.Values<double>(prefix + "jointMean", {kAny}), &data.joint_mean));
      KPSA_RETURN_IF_ERROR(
          Assign(file.Values<double>(prefix + "jointDeviation", {kAny}), &data.joint_deviation));
    }
    Result<TileMap> map =
        TileMap::Make(std::move(data), file.name() + ": tiles of \"" + s->outputs[i].name + "\"");
    if (!map.ok()) return map.status();
    s->tiles.push_back(std::move(*map));
  }
  return {};
}

// Column by column: a row of the tensor is a mode.
Status ReadKeptModes(const SafetensorsFile& file, Subspace* s) {
  std::uint64_t rows = 0;
  for (const SubspaceOutput& output : s->outputs)
    rows += output.points * static_cast<std::uint64_t>(s->components);
  const Result<std::vector<float>> values = file.Values<float>(kModes, {s->modes, rows});
  if (!values.ok()) return values.status();
  s->kept_modes = {rows, s->modes, *values};
  const Result<std::string> digest = file.Metadata(kModesDigest);
  if (!digest.ok()) return digest.status();
  if (*digest != ModesDigest(*s))
    return Status::Invalid("{}: the file is damaged: its modes are not those that were written", file.name());
  return {};
}

}  // namespace

Status WriteSubspace(const Subspace& s, const std::string& path) {
  KPSA_RETURN_IF_ERROR(ValidateSubspace(s));
  SafetensorsWriter writer;
  for (const auto& [key, text] : Header(s)) writer.SetMetadata(key, text);
  writer.SetMetadata("digest", ContentDigest(s));
  Add<double>(&writer, "cueMean", s.cue_mean);
  Add<double>(&writer, "cueScale", s.cue_scale);
  Add<std::uint32_t>(&writer, "cueOffsets", s.soft_cache.offsets);
  Add<float>(&writer, "factor", s.soft_cache.factor.span());
  Add<float>(&writer, "leaveOneOut", s.soft_cache.leave_one_out);
  if (!s.latent.empty()) Add<float>(&writer, kLatent, s.latent);
  AddCalibration(s, &writer);
  for (std::size_t i = 0; i < s.tiles.size(); ++i) {
    const TileData& data = s.tiles[i].data();
    const std::string prefix = fmt::format("tiles.{}.", i);
    Add<std::uint32_t>(&writer, prefix + "ranks", data.ranks);
    Add<std::uint32_t>(&writer, prefix + "wide", data.wide);
    Add<std::uint8_t>(&writer, prefix + "direct", data.direct);
    Add<std::uint32_t>(&writer, prefix + "counts", data.counts);
    Add<std::uint32_t>(&writer, prefix + "columns", data.columns);
    Add<float>(&writer, prefix + "scale", data.scale.span());
    Add<std::uint16_t>(&writer, prefix + "v", data.v.span(), true);
    Add<std::uint8_t>(&writer, prefix + "u", data.u.span());
    Add<float>(&writer, prefix + "mean", data.mean.span());
    if (!data.joints.empty()) {
      Add<std::uint32_t>(&writer, prefix + "joints", data.joints);
      Add<std::uint32_t>(&writer, prefix + "jointRows", data.joint_rows);
      Add<double>(&writer, prefix + "jointMean", data.joint_mean);
      Add<double>(&writer, prefix + "jointDeviation", data.joint_deviation);
    }
    if (data.products.empty()) continue;
    Add<std::uint32_t>(&writer, prefix + "products", data.products);
    Add<std::uint8_t>(&writer, prefix + "pairs", data.pairs);
    Add<float>(&writer, prefix + "whitening", data.whitening.span());
    Add<std::uint16_t>(&writer, prefix + "w", data.w.span(), true);
    Add<std::uint16_t>(&writer, prefix + "doubt", data.doubt.span(), true);
  }
  if (!s.kept_modes.values.empty()) {
    writer.Add<float>(kModes, {s.kept_modes.columns, s.kept_modes.rows}, ModeValues(s));
    writer.SetMetadata(kModesDigest, ModesDigest(s));
  }
  return writer.Write(path);
}

Result<Subspace> ReadSubspace(const std::string& path, KeptModes modes) {
  const Result<SafetensorsFile> read = SafetensorsFile::Read(path);
  if (!read.ok()) return read.status();
  const SafetensorsFile& file = *read;
  const auto kind = file.metadata().find("kind");
  if (kind == file.metadata().end() || kind->second != kKind) {
    return Status::Invalid("{}: a file of tensors, but not a subspace (write one with `kpsa train`)", path);
  }
  const Result<std::string> version = file.Metadata("version");
  if (!version.ok()) return version.status();
  bool known = false;
  for (int v = kOldestVersion; v <= kSubspaceVersion; ++v) known |= *version == std::to_string(v);
  if (!known) {
    return Status::Invalid(
        "{}: the subspace has format version {}, this program reads versions {} to {}; train it again or use "
        "the program that wrote it",
        path, *version, kOldestVersion, kSubspaceVersion);
  }
  Subspace s;
  KPSA_RETURN_IF_ERROR(ReadHeader(file, &s));
  constexpr std::uint64_t kAny = SafetensorsFile::kAnySize;
  KPSA_RETURN_IF_ERROR(Assign(file.Values<double>("cueMean", {kAny}), &s.cue_mean));
  const std::uint64_t rows = s.rows();
  KPSA_RETURN_IF_ERROR(Assign(file.Values<double>("cueScale", {rows}), &s.cue_scale));
  KPSA_RETURN_IF_ERROR(
      Assign(file.Values<std::uint32_t>("cueOffsets", {s.cues.size() + 1}), &s.soft_cache.offsets));
  for (std::size_t k = 0; k <= s.cues.size(); ++k) {
    const Index offset = s.soft_cache.offsets[k];
    if (offset > rows || (k == 0 ? offset != 0 : offset < s.soft_cache.offsets[k - 1])) {
      return Status::Invalid("{}: cue {} begins at row {} of {}", path, k, offset, rows);
    }
  }
  KPSA_RETURN_IF_ERROR(
      Assign(file.Values<float>("factor", {s.score.measured > 0 ? s.soft_cache.factor_size() : kAny}),
             &s.soft_cache.factor));
  KPSA_RETURN_IF_ERROR(Assign(file.Values<float>("leaveOneOut", {kAny}), &s.soft_cache.leave_one_out));
  if (file.tensors().contains(kLatent)) {
    KPSA_RETURN_IF_ERROR(Assign(file.Values<float>(kLatent, {kAny}), &s.latent));
    if (rows == 0 || s.latent.empty() || s.latent.size() % rows != 0)
      return Status::Invalid("{}: {} latent factors of {} rows", path, s.latent.size(), rows);
  }
  KPSA_RETURN_IF_ERROR(ReadTiles(file, &s));
  KPSA_RETURN_IF_ERROR(ReadCalibration(file, &s));
  if (modes == KeptModes::kRead &&
      (file.tensors().contains(kModes) || file.metadata().contains(kModesDigest)))
    KPSA_RETURN_IF_ERROR(ReadKeptModes(file, &s));
  if (Status status = ValidateSubspace(s); !status.ok())
    return Status::Invalid("{}: {}", path, status.ToString());
  const Result<std::string> digest = file.Metadata("digest");
  if (!digest.ok()) return digest.status();
  if (*digest != ContentDigest(s))
    return Status::Invalid(
        "{}: the file is damaged: its contents are not those that were written; train it again", path);
  return s;
}

}  // namespace kpsa::engine
