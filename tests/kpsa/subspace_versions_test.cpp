// Subspaces of earlier versions of the file are written as they always were, so that files that are there
// stay readable: their digests are those of the program that had no later version.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "files/safetensors.h"
#include "kpsa/subspace.h"
#include "tests/support/temporary_folder.h"

namespace kpsa::engine {
namespace {

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
  return s;
}

struct Written {
  std::string version, digest;
};
Written WrittenAs(const Subspace& subspace) {
  TemporaryFolder folder;
  const std::string path = folder / "small.kpsa";
  const Status status = WriteSubspace(subspace, path);
  EXPECT_TRUE(status.ok()) << status.ToString();
  const Result<Subspace> read = ReadSubspace(path);
  EXPECT_TRUE(read.ok()) << read.status().ToString();
  const Result<SafetensorsFile> file = SafetensorsFile::Read(path);
  if (!file.ok()) return {};
  return {*file->Metadata("version"), *file->Metadata("digest")};
}

TEST(SubspaceVersions, OfEarlierFilesKeepTheirDigests) {
  Subspace subspace = SmallestSubspace();
  const Written oldest = WrittenAs(subspace);
  EXPECT_EQ(oldest.version, "3");
  EXPECT_EQ(oldest.digest, "acbae0fd8c59a50dc6781358dd62e2f7");
  subspace.cues[0].plug = "lid.worldMatrix/3";
  const Written relative = WrittenAs(subspace);
  EXPECT_EQ(relative.version, "4");
  EXPECT_EQ(relative.digest, "ea0376d40e28c5ae8c8be9c8190fa877");
  subspace.cues[0] = {};
  subspace.cues[0].kind = CueDescription::Kind::kProduct;
  subspace.cues[0].factors = {{"lid.weight", {0.5, 2, true}}};
  subspace.cues[0].lo = -1, subspace.cues[0].hi = 1;
  const Written product = WrittenAs(subspace);
  EXPECT_EQ(product.version, "5");
  EXPECT_EQ(product.digest, "718bafc5a03fa1cd25cb890c93e270fe");
  subspace.calibration[0].near_clips = true;
  const Written near_clips = WrittenAs(subspace);
  EXPECT_EQ(near_clips.version, "8");
  subspace.calibration[0].near_clips = false;
  subspace.calibration[0].kind = subspace.calibration[1].kind = 0;
  subspace.calibration[0].near_clips = true;
  const Written first = WrittenAs(subspace);
  std::swap(subspace.calibration[0].near_clips, subspace.calibration[1].near_clips);
  EXPECT_NE(first.digest, WrittenAs(subspace).digest) << "which one it is belongs to the contents";
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
  const auto header = nlohmann::json::parse(good.substr(8, size));
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

}  // namespace
}  // namespace kpsa::engine
