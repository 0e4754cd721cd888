#include "kpsa/subspace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/simd.h"
#include "files/safetensors.h"
#include "kpsa/training/make_subspace.h"
#include "tests/kpsa/synthetic.h"

namespace kpsa::engine {
namespace {

using test::Sheet;

// A trained subspace over two meshes of 150 and 90 points, with point cues and a scalar.
class SubspaceTest : public testing::TestWithParam<EstimatorMode> {
 protected:
  SubspaceTest()
      : sheet_(240, 15, 1),
        training_(sheet_.RandomPoses(200, 2, sheet_.Layout(false, true))),
        test_(sheet_.RandomPoses(30, 3, sheet_.Layout(false, true))) {
    const Eigen::VectorXd mean = training_.Mean();
    training_.Subtract(mean);
    pca_ = std::move(*ComputePca(training_, mean, {.max_modes = 7}));
    const std::vector<CueRef> cues = {{CueKind::kOutput, 20},
                                      {CueKind::kOutput, 170},
                                      {CueKind::kScalar, 15},
                                      {CueKind::kOutput, 130},
                                      {CueKind::kOutput, 220}};
    cues_ = MakeCueSet(pca_, cues, sheet_.diagonal());
    estimator_ =
        GetParam() == EstimatorMode::kMap ? MapEstimator(pca_, cues_) : LeastSquaresEstimator(pca_, cues_);
    EXPECT_EQ(estimator_.mode, GetParam()) << estimator_.warning;
    subspace_ = MakeSubspace(pca_, cues_, estimator_, MeasuredPoses(training_.layout(), cues_, training_),
                             {{"head@mush", 150, "mush"}, {"teeth", 90}}, {.rms_budget = 1e-6});
    for (const CueRef cue : cues) {
      if (cue.kind == CueKind::kScalar) {
        subspace_.cues.push_back({.kind = CueDescription::Kind::kScalar,
                                  .plug = "twist.amount",
                                  .stage = "",
                                  .mesh = 0,
                                  .point = 0});
      } else {
        subspace_.cues.push_back({.kind = CueDescription::Kind::kPoint,
                                  .plug = "",
                                  .stage = "mush",
                                  .mesh = cue.index >= 150 ? 1u : 0u,
                                  .point = cue.index % 150});
      }
    }
    subspace_.calibration = {{0.5, 1e-4, 0, 0}, {1.5, 3e-3, 0.25, 3}};
    subspace_.inverse_rest_stretch(1, 1) = 0.5;
    subspace_.extent = 2;
    subspace_.carried = {"head", "upperarm01.L"};
    subspace_.space_scales = true;
    subspace_.ranges = {MakeTrainedRange("a.b", -1, 1, 0, 0.05), MakeTrainedRange("c.d", 0, 0, 0.01, 0)};
    subspace_.rig_hash = "0123456789abcdef";
    subspace_.rig.controls = {"a.b"};
    subspace_.rig.signature["gr\u00f6\u00dfe"] = {"12", {{"x", "34"}}};
    subspace_.space = "head";
    subspace_.training = R"({"poses": 200})";
    subspace_.tolerance = 2e-4;
    path_ = testing::TempDir() + "kpsa_subspace_test_" +
            testing::UnitTest::GetInstance()->current_test_info()->name();
    std::replace(path_.begin() + static_cast<std::ptrdiff_t>(testing::TempDir().size()), path_.end(), '/',
                 '_');
  }
  ~SubspaceTest() override { std::filesystem::remove(path_); }

  std::vector<double> RawCues(std::size_t pose) const {
    std::vector<double> raw;
    for (std::size_t k = 0; k < cues_.cues.size(); ++k) {
      const std::size_t column = CueColumn(pca_.layout, cues_.cues[k]);
      for (std::size_t j = 0; j < CueHeight(pca_.layout, cues_.cues[k]); ++j)
        raw.push_back(static_cast<double>(test_.row(pose)[column + j]));
    }
    return raw;
  }

  Sheet sheet_;
  PoseMatrix training_, test_;  // test_ is not centred
  Pca pca_;
  CueSet cues_;
  Estimator estimator_;
  Subspace subspace_;
  std::string path_;
};
INSTANTIATE_TEST_SUITE_P(Modes, SubspaceTest, testing::Values(EstimatorMode::kMap, EstimatorMode::kPaper));

TEST_P(SubspaceTest, ReconstructsWhatTheEstimatorSays) {
  SubspaceScratch scratch(subspace_);
  for (std::size_t t = 0; t < test_.poses(); ++t) {
    Measure(subspace_, RawCues(t), &scratch);
    const Eigen::VectorXd expected =
        pca_.mean.head(720) +
        estimator_.gain * Eigen::Map<const Eigen::VectorXf>(scratch.y.data(), cues_.rows()).cast<double>();
    std::size_t first = 0;
    for (std::size_t output = 0; output < 2; ++output) {
      PointBuffer points(subspace_.outputs[output].points);
      subspace_.tiles[output].Reconstruct(scratch.y.span(), points.view());
      const std::vector<float> xyz = points.Interleaved();
      double sum = 0;
      for (std::size_t i = 0; i < xyz.size(); ++i)
        sum += std::pow(static_cast<double>(xyz[i]) - expected[static_cast<Eigen::Index>(first + i)], 2);
      EXPECT_LT(std::sqrt(sum / static_cast<double>(points.count())), 2e-5);
      first += xyz.size();
    }
  }
}

// Light: tiles read the few coordinates that all cues give together.
TEST_P(SubspaceTest, LatentCoordinatesSayTheSame) {
  if (GetParam() != EstimatorMode::kMap) return;
  const Estimator slim = MapEstimator(pca_, cues_, EstimatorParts::kReach);
  EXPECT_EQ(slim.gain.size(), 0);
  EXPECT_LT((slim.reach - estimator_.gain.cwiseAbs().colwise().maxCoeff().transpose()).norm(), 1e-12);
  Subspace latent = MakeSubspace(pca_, cues_, slim, MeasuredPoses(training_.layout(), cues_, training_),
                                 subspace_.outputs, {.rms_budget = 1e-6});
  EXPECT_EQ(latent.tile_inputs(), 7u);
  EXPECT_EQ(latent.soft_cache.leave_one_out, subspace_.soft_cache.leave_one_out);
  latent.cues = subspace_.cues;
  latent.units = kLightUnits;
  ASSERT_TRUE(WriteSubspace(latent, path_).ok()) << WriteSubspace(latent, path_).ToString();
  const Result<Subspace> read = ReadSubspace(path_);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->latent, latent.latent);
  EXPECT_TRUE(read->of_light());
  SubspaceScratch a(subspace_), b(*read);
  for (std::size_t t = 0; t < test_.poses(); ++t) {
    Measure(subspace_, RawCues(t), &a);
    Measure(*read, RawCues(t), &b);
    PointBuffer x(90), y(90);
    subspace_.tiles[1].Reconstruct(a.inputs(), x.view());
    read->tiles[1].Reconstruct(b.inputs(), y.view());
    const std::vector<float> p = x.Interleaved(), q = y.Interleaved();
    for (std::size_t i = 0; i < p.size(); ++i) EXPECT_NEAR(p[i], q[i], 5e-5);
  }
  latent.latent.pop_back();
  EXPECT_FALSE(WriteSubspace(latent, path_).ok());
}

// Paper mode that falls back keeps the whole map of its measurements, of light as well: there is no Q.
TEST_P(SubspaceTest, PaperModeThatFellBackComesBack) {
  if (GetParam() != EstimatorMode::kPaper) return;
  const std::vector<CueRef> few = {{CueKind::kOutput, 20}, {CueKind::kOutput, 170}};
  const CueSet cues = MakeCueSet(pca_, few, sheet_.diagonal());
  const Estimator estimator = LeastSquaresEstimator(pca_, cues);
  ASSERT_EQ(estimator.mode, EstimatorMode::kMap);
  ASSERT_NE(estimator.warning, "");
  Subspace fallen = MakeSubspace(pca_, cues, estimator, MeasuredPoses(training_.layout(), cues, training_),
                                 subspace_.outputs, {.rms_budget = 1e-6});
  fallen.cues = {subspace_.cues[0], subspace_.cues[1]};
  for (const char* units : {"m", kLightUnits}) {
    fallen.units = units;
    ASSERT_TRUE(WriteSubspace(fallen, path_).ok()) << WriteSubspace(fallen, path_).ToString();
    const Result<Subspace> read = ReadSubspace(path_);
    ASSERT_TRUE(read.ok()) << units << ": " << read.status().ToString();
    EXPECT_EQ(read->mode, EstimatorMode::kMap);
    EXPECT_EQ(read->units, units);
    EXPECT_TRUE(read->latent.empty());
    std::vector<double> raw = RawCues(3);
    raw.erase(raw.begin() + 6, raw.end());
    SubspaceScratch a(fallen), b(*read);
    PointBuffer x(90), y(90);
    Measure(fallen, raw, &a);
    Measure(*read, raw, &b);
    fallen.tiles[1].Reconstruct(a.inputs(), x.view());
    read->tiles[1].Reconstruct(b.inputs(), y.view());
    EXPECT_EQ(x.Interleaved(), y.Interleaved());
  }
}

TEST_P(SubspaceTest, ALimitOfActivityComesBackWithWhatItCounts) {
  ASSERT_TRUE(WriteSubspace(subspace_, path_).ok());
  EXPECT_TRUE(std::isinf(ReadSubspace(path_)->activity_limit)) << "none";
  subspace_.activity_limit = 12.5;
  subspace_.ranges[0].rest = 0.3, subspace_.ranges[0].reach = 0.7;
  ASSERT_TRUE(WriteSubspace(subspace_, path_).ok()) << WriteSubspace(subspace_, path_).ToString();
  const Result<SafetensorsFile> file = SafetensorsFile::Read(path_);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(*file->Metadata("version"), std::to_string(kActivityVersion));
  const Result<Subspace> read = ReadSubspace(path_);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->activity_limit, 12.5);
  for (std::size_t i = 0; i < subspace_.ranges.size(); ++i) {
    EXPECT_EQ(read->ranges[i].rest, subspace_.ranges[i].rest);
    EXPECT_EQ(read->ranges[i].reach, subspace_.ranges[i].reach);
  }
  for (const double limit : {0.0, -1.0, std::nan("")}) {
    Subspace damaged = subspace_;
    damaged.activity_limit = limit;
    EXPECT_FALSE(WriteSubspace(damaged, path_).ok()) << limit;
  }
  for (const double reach : {-1.0, std::nan("")}) {
    Subspace damaged = subspace_;
    damaged.ranges[1].reach = reach;
    EXPECT_FALSE(WriteSubspace(damaged, path_).ok()) << reach;
  }
}

TEST_P(SubspaceTest, FileRoundTripKeepsEveryBit) {
  ASSERT_TRUE(WriteSubspace(subspace_, path_).ok()) << WriteSubspace(subspace_, path_).ToString();
  const Result<Subspace> read = ReadSubspace(path_);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->mode, subspace_.mode);
  EXPECT_EQ(read->modes, 7u);
  EXPECT_EQ(read->outputs, subspace_.outputs);
  EXPECT_EQ(read->cues, subspace_.cues);
  EXPECT_EQ(read->cue_mean, subspace_.cue_mean);
  EXPECT_TRUE(std::ranges::equal(read->soft_cache.factor.span(), subspace_.soft_cache.factor.span()));
  EXPECT_EQ(read->soft_cache.quantile1, subspace_.soft_cache.quantile1);
  EXPECT_EQ(read->soft_cache.quantile2, subspace_.soft_cache.quantile2);
  EXPECT_EQ(read->soft_cache.leave_one_out, subspace_.soft_cache.leave_one_out);
  EXPECT_EQ(read->ranges[0].lo, subspace_.ranges[0].lo);
  EXPECT_EQ(read->calibration[1].error, 3e-3);
  EXPECT_EQ(read->calibration[1].guard, 0.25);
  EXPECT_EQ(read->calibration[1].kind, 3);
  EXPECT_EQ(read->inverse_rest_stretch, subspace_.inverse_rest_stretch);
  EXPECT_EQ(read->extent, 2);
  EXPECT_EQ(read->carried, subspace_.carried);
  EXPECT_TRUE(read->space_scales);
  EXPECT_EQ(read->ranges[0].ramp, 0.05);
  EXPECT_EQ(read->tolerance, 2e-4);
  EXPECT_EQ(read->rig_hash, subspace_.rig_hash);
  EXPECT_EQ(read->rig, subspace_.rig);
  EXPECT_EQ(read->space, "head");
  EXPECT_EQ(read->training, subspace_.training);

  SubspaceScratch a(subspace_), b(*read);
  PointBuffer x(150), y(150);
  Measure(subspace_, RawCues(4), &a);
  Measure(*read, RawCues(4), &b);
  subspace_.tiles[0].Reconstruct(a.y.span(), x.view());
  read->tiles[0].Reconstruct(b.y.span(), y.view());
  EXPECT_EQ(x.Interleaved(), y.Interleaved());
  const SoftCacheThreshold threshold{.tau = 1};
  EXPECT_EQ(Judge(subspace_, threshold, &a).score, Judge(*read, threshold, &b).score);

  // Written again, the file has the same bytes
  const auto bytes = [](const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const std::string first = bytes(path_);
  ASSERT_TRUE(WriteSubspace(*read, path_).ok());
  EXPECT_EQ(bytes(path_), first);
}

// So do cues that are products of scalars.
TEST_P(SubspaceTest, CuesThatAreProductsTravelWithTheFile) {
  const auto scalar = std::ranges::find(subspace_.cues, CueDescription::Kind::kScalar, &CueDescription::kind);
  ASSERT_NE(scalar, subspace_.cues.end());
  CueDescription product;
  product.kind = CueDescription::Kind::kProduct;
  product.factors = {{"jaw.matrix/3", {0.25, 4, false}}, {"a * b/c.x", {-1.5, 0.1, true}}};
  product.lo = -2, product.hi = 1e-3;
  *scalar = product;
  ASSERT_TRUE(WriteSubspace(subspace_, path_).ok());
  const Result<Subspace> read = ReadSubspace(path_);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->cues, subspace_.cues);
  EXPECT_EQ(CueName(*read, product), "jaw.matrix/3 * a * b/c.x");
  const auto refused = [&](auto edit) {
    *scalar = product;
    edit(&*scalar);
    return !ValidateSubspace(subspace_).ok();
  };
  EXPECT_FALSE(refused([](CueDescription*) {}));
  EXPECT_TRUE(refused([](CueDescription* c) { c->factors.clear(); }));
  EXPECT_TRUE(refused([](CueDescription* c) { c->factors.push_back(c->factors[0]); }));
  EXPECT_TRUE(refused([](CueDescription* c) { c->factors[1].plug = ""; }));
  EXPECT_TRUE(refused([](CueDescription* c) { c->factors[0].curve.scale = std::nan(""); }));
  EXPECT_TRUE(refused([](CueDescription* c) { c->lo = 1; }));
}

// Products and the doubt travel with the file.
TEST_P(SubspaceTest, ProductsTravelWithTheFile) {
  if (GetParam() != EstimatorMode::kMap) return;
  // A sheet that bends and twists, and the values that say how far
  const Sheet sheet(240, 2, 1);
  PoseMatrix poses = sheet.RandomPoses(1500, 5, sheet.Layout(false, true));
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  const Pca pca = std::move(*ComputePca(poses, mean, {.max_modes = 4}));
  std::vector<CueRef> scalars;
  for (Index i = 0; i < 4; ++i) scalars.push_back({CueKind::kScalar, i});
  const CueSet cues = MakeCueSet(pca, scalars, sheet.diagonal());
  Subspace bent = MakeSubspace(pca, cues, MapEstimator(pca, cues), MeasuredPoses(poses.layout(), cues, poses),
                               subspace_.outputs, {.rms_budget = 1e-5, .max_budget = 1e-4}, &poses);
  const PoseMatrix fresh = sheet.RandomPoses(30, 6, sheet.Layout(false, true));
  const auto raw = [&](std::size_t t) {
    const std::span<const float> row = fresh.row(t).subspan(fresh.layout().scalar_begin());
    return std::vector<double>(row.begin(), row.end());
  };
  bent.cues.clear();
  for (const char* plug : {"a.x", "b.x", "c.x", "d.x"})
    bent.cues.push_back(
        {.kind = CueDescription::Kind::kScalar, .plug = plug, .stage = "", .mesh = 0, .point = 0});
  bent.score = {0.5, 300};
  ASSERT_GT(bent.doubt_inputs(), 0u);
  ASSERT_TRUE(WriteSubspace(bent, path_).ok()) << WriteSubspace(bent, path_).ToString();
  const Result<Subspace> read = ReadSubspace(path_);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->score, bent.score);
  SubspaceScratch a(bent), b(*read);
  bool doubted = false;
  for (std::size_t t = 0; t < fresh.poses(); ++t) {
    Measure(bent, raw(t), &a);
    Measure(*read, raw(t), &b);
    const Verdict x = Judge(bent, {.tau = 0.3}, &a), y = Judge(*read, {.tau = 0.3}, &b);
    EXPECT_EQ(x.score, y.score);
    EXPECT_EQ(x.offender, y.offender);
    if (x.reason == MissReason::kDoubt) {
      doubted = true;
      EXPECT_LT(x.offender, bent.tiles[0].tiles() + bent.tiles[1].tiles());
    }
    const float* inputs[2] = {a.t.data(), b.t.data()};
    PointBuffer p(150), q(150);
    const PointsView views[2] = {p.view(), q.view()};
    bent.tiles[0].ReconstructFrom({inputs, 1}, {views, 1}, {});
    read->tiles[0].ReconstructFrom({inputs + 1, 1}, {views + 1, 1}, {});
    EXPECT_EQ(p.Interleaved(), q.Interleaved());
  }
  EXPECT_TRUE(doubted);
  // A measurement that is no number is a miss, whatever the score counts
  for (const ScoreMix& mix : {ScoreMix{0, 1}, ScoreMix{1, 1}}) {
    bent.score = mix;
    for (const float bad : {std::nanf(""), 1e30f}) {  // the points of the second would be infinite
      a.y.data()[2] = bad;
      EXPECT_EQ(Judge(bent, {.tau = 1e30}, &a).reason, MissReason::kNotFinite) << bad;
    }
  }
  // A doubt of nothing is no hit where nothing is
  Measure(bent, raw(0), &a);
  bent.score = {0, std::numeric_limits<double>::denorm_min()};
  const Verdict never = Judge(bent, {.tau = -1}, &a);
  EXPECT_EQ(never.score, 0);
  EXPECT_EQ(never.reason, MissReason::kNeverHit);
  EXPECT_FALSE(never.hit);
  bent.score = {0, 0};
  EXPECT_NE(ValidateSubspace(bent).ToString().find("the score counts"), std::string::npos);
  subspace_.score = {1, 1};
  EXPECT_NE(ValidateSubspace(subspace_).ToString().find("no tile has products"), std::string::npos);
}

TEST_P(SubspaceTest, CuesAreNamedByMeshAndStage) {
  const std::vector<std::string> expected = {"head@mush", "teeth@mush", "twist.amount", "head@mush",
                                             "teeth@mush"};
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_EQ(CueName(subspace_, subspace_.cues[k]), expected[k]) << k;
  subspace_.cues[0].stage = "skin";  // measured before the stage that is reconstructed
  EXPECT_EQ(CueName(subspace_, subspace_.cues[0]), "head@skin");
  subspace_.outputs[0] = {"head@1@mush@2.L", 150, "mush@2.L"};
  EXPECT_EQ(CueName(subspace_, subspace_.cues[0]), "head@1@skin");
  EXPECT_TRUE(ValidateSubspace(subspace_).ok());
  subspace_.outputs[0].stage = "skin";
  EXPECT_EQ(ValidateSubspace(subspace_).ToString(),
            "output \"head@1@mush@2.L\" is not at the stage \"skin\"");
}

// Three numbers are measured of a point, whatever the file says.
TEST_P(SubspaceTest, APointHasThreeRows) {
  subspace_.cues[2] = subspace_.cues[0];  // where a scalar was, which has one
  EXPECT_EQ(ValidateSubspace(subspace_).ToString(), "cue 2 is a point, but has 1 rows, expected 3");
}

TEST_P(SubspaceTest, KeptModesAreStoredAndChecked) {
  subspace_.kept_modes = KeptModesOf(pca_);
  ASSERT_TRUE(WriteSubspace(subspace_, path_).ok()) << WriteSubspace(subspace_, path_).ToString();
  const Result<Subspace> read = ReadSubspace(path_, KeptModes::kRead), frames = ReadSubspace(path_);
  ASSERT_TRUE(read.ok()) << read.status().ToString();
  EXPECT_EQ(read->kept_modes, subspace_.kept_modes);
  ASSERT_TRUE(frames.ok()) << frames.status().ToString();
  EXPECT_EQ(frames->kept_modes.values.size(), 0u);  // frames need none
  // What differs from what was written is refused
  std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::string wanted(reinterpret_cast<const char*>(subspace_.kept_modes.values.data() + 40), 32);
  const std::size_t at = bytes.find(wanted);
  ASSERT_NE(at, std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  file.seekp(0);
  file << bytes;
  file.close();
  EXPECT_NE(ReadSubspace(path_, KeptModes::kRead).status().ToString().find("damaged"), std::string::npos);
  EXPECT_TRUE(ReadSubspace(path_).ok());  // what is not read is not looked at
  // Modes of which nothing tells what they were
  const std::size_t digest = bytes.find("modesDigest");
  ASSERT_NE(digest, std::string::npos);
  bytes[digest] = 'n';
  std::ofstream(path_, std::ios::binary) << bytes;
  EXPECT_NE(ReadSubspace(path_, KeptModes::kRead).status().ToString().find("damaged"), std::string::npos);
  subspace_.kept_modes.columns -= 1;
  EXPECT_NE(WriteSubspace(subspace_, path_).ToString().find("kept modes"), std::string::npos);
}

TEST_P(SubspaceTest, EveryTargetGivesTheSameFrames) {
  std::vector<float> first;
  double score = 0;
  for (const char* target : {"avx512", "avx2", "scalar"}) {
    if (!SelectSimdTarget(target)) continue;
    SubspaceScratch scratch(subspace_);
    PointBuffer points(150);
    Measure(subspace_, RawCues(0), &scratch);
    subspace_.tiles[0].Reconstruct(scratch.y.span(), points.view());
    const double now = Judge(subspace_, {.tau = 1}, &scratch).score;
    if (first.empty()) first = points.Interleaved(), score = now;
    EXPECT_EQ(points.Interleaved(), first) << target;
    EXPECT_EQ(now, score) << target;
  }
  SelectSimdTarget("");
}

TEST_P(SubspaceTest, DamagedFilesGiveOneClearMessage) {
  ASSERT_TRUE(WriteSubspace(subspace_, path_).ok());
  std::ifstream stream(path_, std::ios::binary);
  const std::string good(std::istreambuf_iterator<char>(stream), {});
  std::uint64_t header_size;
  std::memcpy(&header_size, good.data(), 8);
  const std::string header = good.substr(8, header_size), data = good.substr(8 + header_size);
  const auto message = [&](const std::string& text) {
    const std::uint64_t size = text.size();
    std::ofstream out(path_, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(&size), 8);
    out << text << data;
    out.close();
    const Result<Subspace> read = ReadSubspace(path_);
    if (read.ok()) return std::string("no error");
    EXPECT_EQ(read.status().errors().size(), 1u);
    EXPECT_NE(read.status().ToString().find(path_), std::string::npos);
    return read.status().ToString();
  };
  const auto edited = [&](auto edit) {
    nlohmann::json json = nlohmann::json::parse(header);
    edit(&json);
    return message(json.dump());
  };
  using Json = nlohmann::json;
  const auto metadata = [&](const char* key, auto edit) {
    return edited([&](Json* json) {
      Json value = Json::parse((*json)["__metadata__"][key].get<std::string>());
      edit(&value);
      (*json)["__metadata__"][key] = value.dump();
    });
  };
  EXPECT_EQ(message(header), "no error");
  EXPECT_NE(edited([](Json* j) {
              (*j)["__metadata__"]["version"] = "1";
            }).find("format version 1, this program reads versions 3 to 17; train it again"),
            std::string::npos);
  EXPECT_NE(edited([](Json* j) { (*j)["__metadata__"]["kind"] = "poem"; }).find("not a subspace"),
            std::string::npos);
  EXPECT_NE(edited([](Json* j) { (*j)["__metadata__"].erase("outputs"); }).find("no \"outputs\""),
            std::string::npos);
  EXPECT_NE(edited([](Json* j) { (*j)["__metadata__"]["outputs"] = "[[[["; }).find("not a JSON list"),
            std::string::npos);
  EXPECT_NE(edited([](Json* j) { j->erase("cues"); }).find("tensors"), std::string::npos);
  // Entries of tensors
  const auto entry = [&](const char* tensor, std::size_t at, auto value) {
    std::string bad = good;
    const auto begin = nlohmann::json::parse(header)[tensor]["data_offsets"][0].get<std::size_t>();
    std::memcpy(&bad[8 + header_size + begin + at * sizeof(value)], &value, sizeof(value));
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << bad;
    const Result<Subspace> read = ReadSubspace(path_);
    return read.ok() ? std::string("no error") : read.status().ToString();
  };
  using U32 = std::uint32_t;
  EXPECT_EQ(subspace_.cues[0].kind, CueDescription::Kind::kPoint);
  EXPECT_NE(entry("cues", 3, U32{150}).find("point 150"), std::string::npos);
  EXPECT_NE(entry("cues", 2, U32{2}).find("mesh 2"), std::string::npos);
  EXPECT_NE(entry("cues", 0, ~U32{0}).find("name 4294967295 of"), std::string::npos);
  EXPECT_NE(entry("cues", 1, U32{99}).find("name 99 of"), std::string::npos);
  EXPECT_NE(entry("cueKinds", 0, std::uint8_t{3}).find("cue 0 is of kind 3"), std::string::npos);
  EXPECT_NE(entry("cueKinds", 0, std::uint8_t{1}).find("cue 0 is a scalar"), std::string::npos);
  EXPECT_NE(entry("cueKinds", 0, std::uint8_t{2}).find("0 products of 0 factors"), std::string::npos);
  EXPECT_NE(entry("cueOffsets", 1, U32{9999}).find("cue 1 begins at row 9999"), std::string::npos);
  EXPECT_NE(entry("ranges", 0, 9.0).find("a.b"), std::string::npos);
  EXPECT_NE(entry("ranges", 0, std::nan("")).find("NaN"), std::string::npos);
  EXPECT_NE(entry("rangePatches", 0, std::uint64_t{0}).find("\"a.b\" speaks of no patch"), std::string::npos);
  EXPECT_NE(entry("rangePatches", 1, std::uint64_t{1}).find("patches that there are not"), std::string::npos);
  EXPECT_NE(entry("nameEnds", 0, ~U32{0}).find("name 0 lies at bytes 0 to"), std::string::npos);
  EXPECT_NE(entry("nameEnds", 1, U32{0}).find("name 1 lies at"), std::string::npos);
  EXPECT_NE(entry("names", 0, std::uint8_t{0xff}).find("name 0 is not UTF-8"), std::string::npos);
  EXPECT_NE(entry("names", 0, std::uint8_t{'x'}).find("the file is damaged"), std::string::npos);
  EXPECT_NE(entry("training", 0, std::uint8_t{'['}).find("\"training\" is not a JSON object"),
            std::string::npos);
  EXPECT_NE(entry("training", 1, std::uint8_t{'}'}).find("\"training\" is not a JSON object"),
            std::string::npos);
  EXPECT_NE(entry("signatureNodes", 2, U32{7}).find("has 7 attributes"), std::string::npos);
  EXPECT_NE(entry("signatureNodes", 2, U32{0}).find("belong to no node"), std::string::npos);
  EXPECT_NE(entry("controls", 0, U32{99}).find("name 99 of"), std::string::npos);
  EXPECT_NE(metadata("outputs", [](Json* j) { (*j)[0]["points"] = 90; }).find("tiles of \"head@mush\""),
            std::string::npos);
  EXPECT_NE(metadata("outputs", [](Json* j) { (*j)[0]["points"] = 1e12; }).find("\"points\""),
            std::string::npos);
  EXPECT_NE(metadata("summary", [](Json* j) { (*j)["mode"] = "guess"; }).find("guess"), std::string::npos);
  EXPECT_NE(metadata("summary", [](Json* j) { (*j)["quantile1"] = 0; }).find("quantiles"), std::string::npos);
  EXPECT_NE(metadata("summary", [](Json* j) { (*j)["blendStart"] = nullptr; }).find("blendStart"),
            std::string::npos);
  EXPECT_NE(edited([](Json* j) {
              (*j)["tiles.0.w"] = (*j)["tiles.0.v"];
              j->erase("tiles.0.v");
            }).find("no tensor \"tiles.0.v\""),
            std::string::npos);
  EXPECT_NE(edited([](Json* j) { (*j)["tiles.0.v"]["dtype"] = "U16"; }).find("expected F16"),
            std::string::npos);
  EXPECT_NE(edited([](Json* j) {
              (*j)["factor"]["shape"] = {(*j)["factor"]["shape"][0], 2};
            }).find("needs"),
            std::string::npos);

  EXPECT_NE(entry("ranges", 2, 0.5).find("the file is damaged"), std::string::npos);
  EXPECT_NE(edited([](Json* j) { (*j)["__metadata__"]["units"] = "cm"; }).find("the file is damaged"),
            std::string::npos);

  // Any flipped byte or cut: one message, never a crash; but for padding and how the header is written
  std::mt19937 random(1);
  for (int i = 0; i < 400; ++i) {
    std::string bad = good;
    bad[i % 2 == 0 ? random() % bad.size() : random() % header_size] ^= static_cast<char>(1 + random() % 255);
    if (i % 5 == 0) bad.resize(random() % bad.size());
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << bad;
    const Result<Subspace> read = ReadSubspace(path_);
    EXPECT_TRUE(read.ok() || read.status().errors().size() == 1);
    EXPECT_FALSE(i % 5 == 0 && read.ok());
    if (read.ok()) {
      EXPECT_EQ(read->tiles[0].data().u.span().size(), subspace_.tiles[0].data().u.span().size());
      EXPECT_TRUE(std::ranges::equal(read->tiles[0].data().u.span(), subspace_.tiles[0].data().u.span()));
      EXPECT_EQ(read->cue_mean, subspace_.cue_mean);
    }
  }
}

TEST_P(SubspaceTest, InconsistentSubspacesAreNotWritten) {
  subspace_.cue_scale.pop_back();
  EXPECT_FALSE(WriteSubspace(subspace_, path_).ok());
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST(Subspace, SomeTilesTellTheBytesOfAll) {
  const Sheet sheet(2000, 15, 1);  // 16 tiles, of two meshes
  PoseMatrix poses = sheet.RandomPoses(200, 2, sheet.Layout(false, true));
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  const Pca pca = std::move(*ComputePca(poses, mean, {.max_modes = 20}));
  std::vector<CueRef> points;
  for (Index i = 0; i < 40; ++i) points.push_back({CueKind::kOutput, 50 * i});
  const CueSet cues = MakeCueSet(pca, points, sheet.diagonal());
  const Estimator estimator = MapEstimator(pca, cues);
  const Eigen::MatrixXd measured = MeasuredPoses(poses.layout(), cues, poses);
  const std::vector<SubspaceOutput> outputs{{"body", 1300}, {"cloth", 700}};
  const TileOptions options{.rms_budget = 1e-4 * sheet.diagonal()};
  for (const PoseMatrix* products : {static_cast<const PoseMatrix*>(nullptr), &std::as_const(poses)}) {
    const Subspace all = MakeSubspace(pca, cues, estimator, measured, outputs, options, products);
    double bytes = 0;
    for (const TileMap& tiles : all.tiles) bytes += static_cast<double>(tiles.bytes());
    EXPECT_NEAR(BytesOfTiles(pca, estimator, measured, outputs, options, products, 0, 4) / bytes, 1, 0.15);
  }
  // No whole tile is one of sixty
  EXPECT_EQ(BytesOfTiles(pca, estimator, measured, outputs, options, nullptr, 0, 60), 0);
}

TEST(Subspace, BlendMixesPoints) {
  PointBuffer full = PointBuffer::FromInterleaved(std::vector<float>{1, 2, 3, 4, 5, 6}), points(2);
  BlendPoints(0.25, full.view(), points.view());
  EXPECT_EQ(points.Interleaved(), (std::vector<float>{0.25f, 0.5f, 0.75f, 1, 1.25f, 1.5f}));
}

}  // namespace
}  // namespace kpsa::engine
