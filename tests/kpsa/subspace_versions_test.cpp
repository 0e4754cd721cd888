// Files of earlier versions are read as they always were: tests/kpsa/versions has one that each version wrote. Files of
// this version have their lists in tensors, so that reading them is cheap.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "files/safetensors.h"
#include "kpsa/subspace.h"
#include "kpsa/training_record.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

using Json = nlohmann::json;

std::string PathOfVersion(int version) {
  return fmt::format("{}/tests/kpsa/versions/version{}.kpsa", KPSA_SOURCE_DIR, version);
}

// 130 points that stand still, and one scalar that is measured; exact numbers, whatever rounds them.
Subspace SmallestSubspace() {
  Subspace s;
  s.outputs = {{"column@mush", 130, "mush"}};
  s.cues.resize(1);
  s.cues[0].kind = CueDescription::Kind::kScalar;
  s.cues[0].plug = "lid.weight";
  s.cue_mean = {0.5}, s.cue_scale = {4};
  s.modes = s.soft_cache.modes = 1;
  s.soft_cache.offsets = {0, 1};
  s.soft_cache.factor = AlignedArray<float>(s.soft_cache.factor_size());
  for (float& entry : s.soft_cache.factor.span()) entry = 0.25f;
  s.soft_cache.leave_one_out = {2};
  TileData data;
  data.points = 130, data.inputs = 1;
  for (auto* of : {&data.ranks, &data.wide, &data.counts}) of->assign(2, 0);
  data.direct.assign(2, 0);
  data.mean = AlignedArray<float>(5 * 3 * kPanelPoints);
  for (std::size_t i = 0; i < data.mean.size(); ++i) data.mean.data()[i] = static_cast<float>(i) / 8;
  Result<TileMap> tiles = TileMap::Make(std::move(data), "column");
  EXPECT_TRUE(tiles.ok()) << tiles.status().ToString();
  s.tiles.push_back(std::move(*tiles));
  s.calibration = {{0.5, 0.125, 0, 0}, {1.5, 0.25, 0.25, 3}};
  s.ranges = {{"lid.weight", 0, 1, 0.125}};
  s.tolerance = 0.25, s.violation_rate = 0.0625, s.blend_start = 0.875;
  s.rig_hash = "0123456789abcdef";
  s.training = R"({"seed":7})";
  s.rig.controls = {"lid.turn", "a\"b"};
  s.rig.signature["lid"] = {"ba9876543210", {{"weight", "0123456789ab"}}};
  return s;
}

// What the file of a version says.
Subspace OfVersion(int version) {
  Subspace s = SmallestSubspace();
  CueDescription& cue = s.cues[0];
  if (version == 4) cue.plug = "lid.worldMatrix/3", cue.joint = "jaw.worldMatrix";
  if (version < 5) return s;
  cue = {};
  cue.kind = CueDescription::Kind::kProduct;
  cue.factors = {{"lid.weight", {0.5, 2, true}}, {"jaw.matrix/1", {-0.125, 3, false}}};
  cue.lo = -1, cue.hi = 1;
  s.calibration[0].near_clips = version == 8;
  return s;
}

std::vector<std::tuple<std::string, double, double, double, std::uint64_t>> RangesOf(const Subspace& s) {
  std::vector<std::tuple<std::string, double, double, double, std::uint64_t>> ranges;
  for (const TrainedRange& r : s.ranges) ranges.emplace_back(r.plug, r.lo, r.hi, r.ramp, r.patches);
  return ranges;
}

void ExpectSame(const Subspace& a, const Subspace& b) {
  EXPECT_EQ(a.outputs, b.outputs);
  EXPECT_EQ(a.cues, b.cues);
  EXPECT_EQ(RangesOf(a), RangesOf(b));
  EXPECT_EQ(a.rig, b.rig);
  EXPECT_EQ(a.training, b.training);
  EXPECT_EQ(a.rig_hash, b.rig_hash);
  EXPECT_EQ(a.carried, b.carried);
  EXPECT_EQ(a.score, b.score);
  EXPECT_EQ(a.patches, b.patches);
  EXPECT_EQ(a.cue_mean, b.cue_mean);
  EXPECT_EQ(a.cue_scale, b.cue_scale);
  EXPECT_EQ(a.soft_cache.offsets, b.soft_cache.offsets);
  EXPECT_EQ(a.soft_cache.leave_one_out, b.soft_cache.leave_one_out);
  EXPECT_TRUE(std::ranges::equal(a.soft_cache.factor.span(), b.soft_cache.factor.span()));
  EXPECT_EQ(a.tolerance, b.tolerance);
  EXPECT_EQ(a.blend_start, b.blend_start);
  ASSERT_EQ(a.calibration.size(), b.calibration.size());
  for (std::size_t i = 0; i < a.calibration.size(); ++i) {
    EXPECT_EQ(a.calibration[i].score, b.calibration[i].score);
    EXPECT_EQ(a.calibration[i].kind, b.calibration[i].kind);
    EXPECT_EQ(a.calibration[i].near_clips, b.calibration[i].near_clips);
    EXPECT_EQ(a.calibration[i].middle, b.calibration[i].middle);
    EXPECT_EQ(a.calibration[i].patches, b.calibration[i].patches);
  }
  ASSERT_EQ(a.tiles.size(), b.tiles.size());
  SubspaceScratch x(a), y(b);
  const std::vector<double> raw(a.rows(), 0.375);
  Measure(a, raw, &x);
  Measure(b, raw, &y);
  EXPECT_EQ(Judge(a, {.tau = 1}, &x).score, Judge(b, {.tau = 1}, &y).score);
  for (std::size_t m = 0; m < a.tiles.size(); ++m) {
    PointBuffer p(a.outputs[m].points), q(b.outputs[m].points);
    a.tiles[m].Reconstruct(x.inputs(), p.view());
    b.tiles[m].Reconstruct(y.inputs(), q.view());
    EXPECT_EQ(p.Interleaved(), q.Interleaved());
  }
}

// Bytes of the file of a version, with something else in its header.
std::string Edited(int version, const std::function<void(Json*)>& edit) {
  const std::string good = TemporaryFolder::Read(PathOfVersion(version));
  std::uint64_t size = 0;
  std::memcpy(&size, good.data(), 8);
  Json header = Json::parse(good.substr(8, size));
  edit(&header);
  const std::string text = header.dump(), rest = good.substr(8 + size);
  size = text.size();
  return std::string(reinterpret_cast<const char*>(&size), 8) + text + rest;
}
std::string EditedList(int version, const char* key, const std::function<void(Json*)>& edit) {
  return Edited(version, [&](Json* header) {
    Json list = Json::parse((*header)["__metadata__"][key].get<std::string>());
    edit(&list);
    (*header)["__metadata__"][key] = list.dump();
  });
}
std::string RefusalOf(const std::string& bytes) {
  const TemporaryFolder folder;
  const Result<Subspace> read = ReadSubspace(folder.Write("old.kpsa", bytes));
  if (read.ok()) return "no error";
  EXPECT_EQ(read.status().errors().size(), 1u);
  EXPECT_NE(read.status().ToString().find("old.kpsa"), std::string::npos);
  return read.status().ToString();
}
#define EXPECT_REFUSED(bytes, words) \
  EXPECT_NE(RefusalOf(bytes).find(words), std::string::npos) << RefusalOf(bytes)

TEST(SubspaceVersions, EarlierFilesSayWhatTheySaid) {
  const TemporaryFolder folder;
  for (int version = kOldestVersion; version < kListsVersion; ++version) {
    SCOPED_TRACE(version);
    const std::string path = PathOfVersion(version), again = folder / "again.kpsa";
    EXPECT_EQ(*SafetensorsFile::Read(path)->Metadata("version"), std::to_string(version));
    const Result<Subspace> old = ReadSubspace(path);
    ASSERT_TRUE(old.ok()) << old.status().ToString();
    if (version != 6 && version != 7) ExpectSame(*old, OfVersion(version));
    EXPECT_EQ(old->patches.tiles > 0, version == 6 || version == 7);
    EXPECT_EQ(old->ranges[0].patches, version == 7 ? 0b10 : kAllPatches);
    ASSERT_TRUE(WriteSubspace(*old, again).ok());
    EXPECT_EQ(*SafetensorsFile::Read(again)->Metadata("version"), std::to_string(kListsVersion));
    const Result<Subspace> now = ReadSubspace(again);
    ASSERT_TRUE(now.ok()) << now.status().ToString();
    ExpectSame(*old, *now);
  }
}

TEST(SubspaceVersions, DamageOfEarlierFilesIsSeen) {
  EXPECT_EQ(RefusalOf(Edited(8, [](Json*) {})), "no error");
  const auto removed = [](const char* key) {
    return [key](Json* header) { (*header)["__metadata__"].erase(key); };
  };
  EXPECT_REFUSED(Edited(8, removed("cues")), "no \"cues\"");
  EXPECT_REFUSED(Edited(8, removed("training")), "no \"training\"");
  EXPECT_REFUSED(Edited(8, [](Json* h) { (*h)["__metadata__"]["ranges"] = "[[[["; }), "not a JSON list");
  EXPECT_REFUSED(EditedList(8, "ranges", [](Json* list) { (*list)[0]["lo"] = 9; }), "lid.weight");
  EXPECT_REFUSED(EditedList(8, "ranges", [](Json* list) { (*list)[0]["hi"] = 3; }), "the file is damaged");
  EXPECT_REFUSED(EditedList(7, "ranges", [](Json* list) { (*list)[0]["patches"] = {62}; }),
                 "numbers of patches");
  EXPECT_REFUSED(EditedList(8, "cues", [](Json* list) { (*list)[0]["kind"] = "smell"; }), "smell");
  EXPECT_REFUSED(EditedList(8, "cues", [](Json* list) { (*list)[0]["factors"] = 1; }), "array");
  EXPECT_REFUSED(EditedList(8, "cues", [](Json* list) { list->erase(0); }), "cueOffsets");
  EXPECT_REFUSED(EditedList(8, "cues", [](Json* list) { (*list)[0]["lo"] = -2; }), "the file is damaged");
  const auto as_point = [](int point, int mesh) {
    return [point, mesh](Json* list) {
      (*list)[0] = {{"kind", "point"}, {"stage", "skin"}, {"mesh", mesh}, {"point", point}};
    };
  };
  EXPECT_REFUSED(EditedList(3, "cues", as_point(-1, 0)), "whole number");
  EXPECT_REFUSED(EditedList(3, "cues", as_point(0, 0)), "1 rows, expected 3");
  EXPECT_REFUSED(EditedList(8, "training", [](Json* record) { (*record)["seed"] = 8; }),
                 "the file is damaged");
  EXPECT_REFUSED(EditedList(8, "training", [](Json* record) { (*record)["signature"] = 8; }),
                 "the file is damaged");
}

TEST(SubspaceVersions, TheTrainedRigIsTakenOutOfTheRecordAndShownWithIt) {
  const Subspace s = SmallestSubspace();
  std::string text = TrainingText(s);
  EXPECT_NE(text.find("ba9876543210"), std::string::npos);
  EXPECT_EQ(TakeTrainedRig(&text), s.rig);
  EXPECT_EQ(text, s.training);
}

TEST(SubspaceVersions, OnlySampledPosesAreNearClips) {
  Subspace subspace = SmallestSubspace();
  subspace.calibration[1].near_clips = true;  // of those beyond the ranges
  const TemporaryFolder folder;
  ASSERT_TRUE(WriteSubspace(subspace, folder / "small.kpsa").ok());
  const Result<Subspace> read = ReadSubspace(folder / "small.kpsa");
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.status().ToString().find("small.kpsa: calibration pose 1 cannot be near clips"),
            std::string::npos)
      << read.status().ToString();
}

TEST(SubspaceVersions, FlagsOfAnotherTypeOrValueAreRefused) {
  Subspace subspace = SmallestSubspace();
  subspace.calibration[0].near_clips = true;
  const TemporaryFolder folder;
  const std::string path = folder / "small.kpsa";
  ASSERT_TRUE(WriteSubspace(subspace, path).ok());
  const std::string good = TemporaryFolder::Read(path);
  std::uint64_t size = 0;
  std::memcpy(&size, good.data(), sizeof(size));
  const auto header = Json::parse(good.substr(8, size));
  const auto refused = [&](std::size_t at, std::string_view bytes) {
    folder.Write("small.kpsa", std::string(good).replace(at, bytes.size(), bytes));
    const Result<Subspace> read = ReadSubspace(path);
    return read.ok() ? "" : read.status().ToString();
  };
  const std::size_t flags = 8 + size + header["calibrationNearClips"]["data_offsets"][0].get<std::size_t>();
  EXPECT_EQ(refused(flags, "\x01"), "") << "as it was";
  EXPECT_NE(refused(flags, "\x02").find("calibration pose 0 cannot be near clips (2)"), std::string::npos);
  EXPECT_NE(refused(flags, std::string_view("\0", 1)).find("the file is damaged"), std::string::npos);
  const std::size_t type = good.find("U8", good.find("calibrationNearClips"));
  EXPECT_NE(refused(type, "I8").find("calibrationNearClips"), std::string::npos);
}

// With that many scalars and ranges.
Subspace OfManyCues(std::size_t count) {
  Subspace s = SmallestSubspace();
  s.soft_cache.offsets = {0};
  s.cues.clear(), s.ranges.clear(), s.cue_mean.clear(), s.cue_scale.clear();
  for (std::size_t k = 0; k < count; ++k) {
    CueDescription& cue = s.cues.emplace_back();
    cue.kind = CueDescription::Kind::kScalar;
    cue.plug = fmt::format("arm1_{}.worldMatrix/{}", k / 12, k % 12);
    cue.joint = "arm1_3.worldMatrix";
    s.ranges.push_back({cue.plug, -0.123456789, 0.987654321, 0.0555555555});
    s.rig.signature[cue.plug] = {"0123456789ab", {{"translate", "ba9876543210"}}};
    s.rig.controls.push_back(cue.plug);
    s.cue_mean.push_back(0), s.cue_scale.push_back(1);
    s.soft_cache.offsets.push_back(static_cast<Index>(k + 1));
  }
  s.mode = s.soft_cache.mode = EstimatorMode::kPaper;
  s.soft_cache.factor = AlignedArray<float>(s.soft_cache.factor_size());
  s.soft_cache.leave_one_out.clear();
  TileData data;
  data.points = 130, data.inputs = count;
  for (auto* of : {&data.ranks, &data.wide, &data.counts}) of->assign(2, 0);
  data.direct.assign(2, 0);
  data.mean = AlignedArray<float>(5 * 3 * kPanelPoints);
  s.tiles.clear();
  s.tiles.push_back(std::move(*TileMap::Make(std::move(data), "column")));
  return s;
}

// What is measured, how far it may go and what the rig is, is most of what a file says in words. As JSON in the header,
// which is JSON itself, it was most of the time until a first accelerated frame.
TEST(SubspaceVersions, HeadersDoNotGrowWithTheLists) {
  const TemporaryFolder folder;
  const auto header_of = [&](std::size_t count, std::string list) {
    const std::string path = folder / "many.kpsa";
    const Subspace s = OfManyCues(count);
    EXPECT_TRUE(WriteSubspace(s, path).ok()) << WriteSubspace(s, path).ToString();
    const Result<Subspace> read = ReadSubspace(path);
    EXPECT_TRUE(read.ok()) << read.status().ToString();
    if (read.ok()) ExpectSame(*read, s);
    SafetensorsWriter writer;
    const Result<SafetensorsFile> file = SafetensorsFile::Read(path);
    for (const auto& [key, text] : file->metadata()) writer.SetMetadata(key, text);
    if (!list.empty()) writer.SetMetadata("cues", list);
    std::uint64_t with_list = 0, size = 0;
    std::memcpy(&with_list, writer.Serialize().data(), 8);
    std::memcpy(&size, TemporaryFolder::Read(path).data(), 8);
    return list.empty() ? size : with_list;
  };
  constexpr std::size_t kFew = 10, kMany = 400;
  constexpr std::uint64_t kDigits = 256;  // of larger offsets and shapes
  const auto list_of = [](std::size_t count) {
    Json list = Json::array();
    for (const CueDescription& cue : OfManyCues(count).cues)
      list.push_back({{"kind", "scalar"}, {"plug", cue.plug}});
    return list.dump();
  };
  EXPECT_LT(header_of(kMany, ""), header_of(kFew, "") + kDigits);
  EXPECT_GT(header_of(kMany, list_of(kMany)), header_of(kFew, list_of(kFew)) + kDigits) << "it would be seen";
}

// What stands for the tiles where kernels are looked up: of a file its digest, else what is in them.
TEST(TileDigests, TellMapsApart) {
  const TemporaryFolder folder;
  const auto read = [&](const Subspace& written) {
    const std::string path = folder / "one.kpsa";
    EXPECT_TRUE(WriteSubspace(written, path).ok());
    Result<Subspace> s = ReadSubspace(path);
    EXPECT_TRUE(s.ok()) << s.status().ToString();
    return s->tiles[0].digest();
  };
  const Subspace smallest = SmallestSubspace();
  Subspace other = SmallestSubspace();
  TileData data = other.tiles[0].data();
  data.mean.data()[129] += 0.125f;
  other.tiles[0] = *TileMap::Make(std::move(data), "column");
  EXPECT_EQ(read(smallest), read(smallest));
  EXPECT_NE(read(smallest), read(other));
  EXPECT_EQ(smallest.tiles[0].digest(), SmallestSubspace().tiles[0].digest());
  EXPECT_NE(smallest.tiles[0].digest(), other.tiles[0].digest());
  // Of a file before version 9, whose digest is not of all that it says
  const Result<Subspace> old = ReadSubspace(PathOfVersion(8));
  ASSERT_TRUE(old.ok()) << old.status().ToString();
  EXPECT_EQ(old->tiles[0].digest(), TileMap::Make(old->tiles[0].data(), "column")->digest());
  // Changed since
  Result<Subspace> s = ReadSubspace(folder / "one.kpsa");
  ASSERT_TRUE(s.ok()) << s.status().ToString();
  const std::vector<double> factors(s->tiles[0].tiles(), 2);
  EXPECT_NE(s->tiles[0].WithDoubts(factors).digest(), s->tiles[0].digest());
}

}  // namespace
}  // namespace kpsa::engine
