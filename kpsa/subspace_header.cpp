#include "kpsa/subspace_header.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "files/json_depth.h"
#include "kpsa/pose_kind.h"
#include "kpsa/subspace_lists.h"
#include "kpsa/training_record.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

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
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(text->data()), text->size());
  Json json = CheckJsonDepth(bytes, kDeepestEntry).ok() ? Json::parse(*text, nullptr, false)
                                                        : Json(Json::value_t::discarded);
  if (json.is_discarded() || json.is_array() != list || (!list && !json.is_object()) || json.size() > limit) {
    return Status::Invalid("\"{}\" is not a JSON {} of at most {} entries", key, list ? "list" : "object",
                           limit);
  }
  return json;
}

constexpr char kInner[] = "inner";           // points of an output; missing: none
constexpr char kStepped[] = "stepped";       // tiles that they are of; missing: all, or tensors say
constexpr char kInBlends[] = "in blends";    // patchMisses
constexpr char kRangePatches[] = "patches";  // that a range speaks of; missing: of all

// What the space was at rest, and what moves with it.
Status ReadFrame(const Json& frame, Subspace* s) {
  const auto bad = [&](const char* key, const char* expected) {
    return Status::Invalid("frame: \"{}\" should be {}", key, expected);
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

Status ReadStepped(const Json& tiles, SubspaceOutput* output) {
  const std::size_t count = (output->points + kTilePoints - 1) / kTilePoints;
  bool known = tiles.is_array() && !tiles.empty();
  std::vector<Index> stepped;
  for (std::size_t i = 0; known && i < tiles.size(); ++i) {
    known = tiles[i].is_number_unsigned() && tiles[i].get<std::uint64_t>() < count &&
            (i == 0 || tiles[i].get<std::uint64_t>() > stepped.back());
    if (known) stepped.push_back(static_cast<Index>(tiles[i].get<std::uint64_t>()));
  }
  if (!known)
    return Status::Invalid("an output: \"{}\" should be numbers of tiles that count up, below {}", kStepped,
                           count);
  output->stepped.points = PointsOfTiles(stepped, output->points);
  return {};
}

// *status: the first failure of a Reader; entries after it read as defaults.
Status ReadCues(const Json& cues, Status* status, Subspace* s) {
  for (const Json& entry : cues) {
    Reader reader_of_cue("a cue", entry, status);
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
        return Status::Invalid("a cue: \"factors\" should be an array");
      for (const Json& part : entry["factors"]) {
        Reader factor("a factor", part, status);
        cue.factors.push_back({factor.Text("plug"), {factor.Number("centre"), factor.Number("scale")}});
        cue.factors.back().curve.hinge = part.is_object() && part.value("hinge", Json(false)) == Json(true);
      }
    } else if (status->ok()) {
      return Status::Invalid("a cue is of kind \"{}\", expected point, scalar or product", kind);
    }
    if (entry.is_object() && entry.contains("joint")) cue.joint = reader_of_cue.Text("joint");
    s->cues.push_back(std::move(cue));
  }
  return {};
}

Status ReadRanges(const Json& ranges, Status* status, Subspace* s) {
  for (const Json& entry : ranges) {
    Reader range("a trained range", entry, status);
    s->ranges.push_back({range.Text("plug"), range.Number("lo"), range.Number("hi"), range.Number("ramp")});
    if (!entry.is_object() || !entry.contains(kRangePatches)) continue;
    const Json& patches = entry[kRangePatches];
    s->ranges.back().patches = 0;
    bool known = patches.is_array() && !patches.empty();
    for (std::size_t i = 0; known && i < patches.size(); ++i) {
      known = patches[i].is_number_unsigned() && patches[i].get<std::uint64_t>() < kMaxPatches;
      if (known) s->ranges.back().patches |= std::uint64_t{1} << patches[i].get<std::uint64_t>();
    }
    if (!known) return Status::Invalid("a trained range: \"{}\" should be numbers of patches", kRangePatches);
  }
  return {};
}

// Before version 9: the lists are JSON, and the trained rig is a part of the training's text.
Status ReadJsonLists(const SafetensorsFile& file, Status* status, Subspace* s) {
  const Result<Json> cues = JsonMetadata(file, "cues", true, kMaxCues),
                     ranges = JsonMetadata(file, "ranges", true, kMaxCues),
                     training = JsonMetadata(file, "training", false, 1u << 16);
  for (const Result<Json>* part : {&cues, &ranges, &training}) KPSA_RETURN_IF_ERROR(part->status());
  KPSA_RETURN_IF_ERROR(ReadCues(*cues, status, s));
  KPSA_RETURN_IF_ERROR(ReadRanges(*ranges, status, s));
  s->training = *file.Metadata("training");
  s->rig = TakeTrainedRig(&s->training);
  return {};
}

// The oldest that says all of it.
int VersionOf(const Subspace& s) {
  const auto of_some = [](const SubspaceOutput& output) { return !output.stepped.empty(); };
  const auto of_points = [](const SubspaceOutput& output) { return !output.stepped.starts.empty(); };
  const bool partial = std::ranges::any_of(s.outputs, of_some);
  const bool held = std::ranges::any_of(s.calibration, [](const CalibrationPair& pair) {
    return pair.kind == static_cast<int>(PoseKind::kHeld);
  });
  const bool stepped = std::ranges::any_of(s.outputs, of_points);
  return stepped && s.patches.tiles > 0    ? kSteppedPatchesVersion
         : stepped                         ? kSteppedPointsVersion
         : s.patches.blends_only           ? kBlendsVersion
         : std::isfinite(s.activity_limit) ? kActivityVersion
         : held                            ? kHeldVersion
         : partial                         ? kPartialVersion
         : !s.mends.empty()                ? kMendsVersion
         : s.of_inner()                    ? kInnerVersion
                                           : kListsVersion;
}

}  // namespace

std::map<std::string, std::string> SubspaceHeader(const Subspace& s) {
  Json outputs = Json::array();
  for (const SubspaceOutput& output : s.outputs) {
    outputs.push_back({{"name", output.name}, {"points", output.points}, {"stage", output.stage}});
    if (output.inner > 0) outputs.back()[kInner] = output.inner;
    if (!output.stepped.empty() && output.stepped.starts.empty())
      outputs.back()[kStepped] = WholeTiles(output.stepped.points, output.points);
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
                  {"blendStart", s.blend_start},
                  {"score", {s.score.measured, s.score.doubt}}};
  if (std::isfinite(s.activity_limit)) summary["activityLimit"] = s.activity_limit;
  if (s.patches.tiles > 0) {
    summary["tilesOfPatch"] = s.patches.tiles;
    summary["patchShare"] = s.patches.share;
    if (s.patches.blends_only) summary["patchMisses"] = kInBlends;
  }
  return {{"kind", kSubspaceKind},     {"version", std::to_string(VersionOf(s))},
          {"summary", summary.dump()}, {"outputs", outputs.dump()},
          {"rigHash", s.rig_hash},     {"units", s.units},
          {"space", s.space},          {"frame", frame.dump()}};
}

Status ReadSubspaceHeader(const SafetensorsFile& file, bool with_lists, Subspace* s) {
  const Result<Json> summary = JsonMetadata(file, "summary", false, 64),
                     outputs = JsonMetadata(file, "outputs", true, kMaxOutputs),
                     frame = JsonMetadata(file, "frame", false, 64);
  for (const Result<Json>* part : {&summary, &outputs, &frame}) KPSA_RETURN_IF_ERROR(part->status());
  Status status;
  Reader reader("summary", *summary, &status);
  const std::string mode = reader.Text("mode");
  if (status.ok() && mode != "map" && mode != "paper")
    return Status::Invalid("the mode is \"{}\", expected map or paper", mode);
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
      return Status::Invalid("summary: \"score\" should be two numbers");
    s->score = {score[0].get<double>(), score[1].get<double>()};
  }
  if (summary->contains("activityLimit")) s->activity_limit = reader.Number("activityLimit");
  if (summary->contains("tilesOfPatch")) {
    s->patches.tiles = reader.Count("tilesOfPatch", kMaxPoints);
    s->patches.share = reader.Number("patchShare");
    if (summary->contains("patchMisses")) {
      s->patches.blends_only = reader.Text("patchMisses") == kInBlends;
      if (status.ok() && !s->patches.blends_only)
        return Status::Invalid("summary: \"patchMisses\" should be \"{}\"", kInBlends);
    }
  }
  for (const Json& entry : *outputs) {
    Reader output("an output", entry, &status);
    s->outputs.push_back({output.Text("name"), output.Count("points", kMaxPoints), output.Text("stage")});
    if (entry.is_object() && entry.contains(kInner))
      s->outputs.back().inner = output.Count(kInner, kMaxPoints);
    if (entry.is_object() && entry.contains(kStepped))
      KPSA_RETURN_IF_ERROR(ReadStepped(entry[kStepped], &s->outputs.back()));
  }
  if (with_lists) KPSA_RETURN_IF_ERROR(ReadJsonLists(file, &status, s));
  s->extent = Reader("frame", *frame, &status).Number("extent");
  KPSA_RETURN_IF_ERROR(ReadFrame(*frame, s));
  for (const auto& [key, target] :
       {std::pair{"rigHash", &s->rig_hash}, {"units", &s->units}, {"space", &s->space}}) {
    const Result<std::string> text = file.Metadata(key);
    KPSA_RETURN_IF_ERROR(text.status());
    *target = *text;
  }
  return status;
}

}  // namespace kpsa::engine
