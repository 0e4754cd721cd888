// Writes the seeds of the corpora that are no text: small characters with every kind of compression, archives, point
// caches. `sh tests/fuzz/seeds.sh` runs it, and trains the subspaces.
#include <draco/compression/expert_encode.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "files/npz.h"
#include "files/point_cache.h"
#include "kpsa/subspace.h"
#include "kpsa/training/make_subspace.h"
#include "tests/gltf/draco_character.h"
#include "tests/gltf/meshopt_character.h"
#include "tests/kpsa/synthetic.h"
#include "tests/support/cube_character.h"
#include "tests/support/moving_character.h"

namespace kpsa::engine {
namespace {

void Write(const std::string& path, const std::string& bytes) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}
void Check(const Status& status) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s\n", status.ToString().c_str());
  std::exit(1);
}

void WriteCharacters(const std::string& folder) {
  Write(folder + "/triangle.gltf", GltfBuilder::Character().Text());
  Write(folder + "/triangle.glb", GltfBuilder::Character().Glb());
  Write(folder + "/cube.glb", CubeCharacter(CubeEdges::kNone).Glb());
  MovingCharacter moving;
  moving.Swing("wave", 30, 0.5);
  Write(folder + "/strip.glb", moving.builder.Glb());
  for (const auto& [name, method] : {std::pair("sequential", draco::MESH_SEQUENTIAL_ENCODING),
                                     std::pair("edgebreaker", draco::MESH_EDGEBREAKER_ENCODING)}) {
    DracoCharacter character(4, method);
    Write(folder + "/draco_" + name + ".glb", character.Document().Glb());
    Write(folder + "/draco_" + name + ".gltf", character.Document().Text());
  }
  const GridCharacter grid(4);
  for (const bool triangles : {false, true}) {
    Compressed compressed = CompressAll(grid, triangles);
    Write(folder + (triangles ? "/meshopt_triangles.glb" : "/meshopt_sequence.glb"), compressed.Glb());
    Write(folder + (triangles ? "/meshopt_triangles.gltf" : "/meshopt_sequence.gltf"), compressed.Text());
  }
}

PointCache TwoFrames() {
  PointCache cache;
  cache.times = {0, 0.5};
  cache.meshes.push_back({"strip", 3, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1}, {0, 1, 2}});
  return cache;
}

void WriteCaches(const std::string& folder) {
  std::filesystem::create_directories(folder);
  CacheOptions options;
  options.force = true;
  std::vector<std::string> warnings;
  Check(WritePc2(folder + "/strip.pc2", TwoFrames(), 0, options, &warnings));
  Check(WriteMdd(folder + "/strip.mdd", TwoFrames(), 0, options));
}

// An archive as kpsa writes it, and arrays alone, which the fuzzer packs.
void WriteArchives(const std::string& folder) {
  std::filesystem::create_directories(folder);
  Result<NpzWriter> writer = NpzWriter::Create(folder + "/strip.npz", true);
  Check(writer.status());
  Check(writer->Add("times", {2}, std::vector<double>{0, 0.5}));
  Check(writer->Add("strip/0", {2, 3, 3}, TwoFrames().meshes[0].frames));
  Check(writer->Finish());
  const auto npy = [](int version, const std::string& dictionary, const std::string& content) {
    std::string text = std::string("\x93NUMPY", 6) + static_cast<char>(version) + '\0';
    text += static_cast<char>(dictionary.size());
    text += version == 1 ? std::string(1, '\0') : std::string(3, '\0');
    return text + dictionary + content;
  };
  Write(folder + "/float.npy",
        npy(1, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1), }\n", std::string(8, '\0')));
  Write(folder + "/bool.npy",
        npy(2, "{'descr': '|b1', 'fortran_order': False, 'shape': (3,), }\n", std::string("\0\1\1", 3)));
  Write(folder + "/scalar.npy",
        npy(3, "{'descr': '<i8', 'fortran_order': False, 'shape': (), }\n", std::string(8, '\7')));
}

// A sheet that bends and twists: tiles have products, and parts of it miss by themselves. What `kpsa train` makes of so
// few points has neither.
void WriteSubspaces(const std::string& folder) {
  std::filesystem::create_directories(folder);
  const test::Sheet sheet(400, 2, 1);
  PoseMatrix poses = sheet.RandomPoses(600, 5, sheet.Layout(false, true));
  const Eigen::VectorXd mean = poses.Mean();
  poses.Subtract(mean);
  const Pca pca = std::move(*ComputePca(poses, mean, {.max_modes = 3}));
  std::vector<CueRef> scalars;
  for (Index i = 0; i < 4; ++i) scalars.push_back({CueKind::kScalar, i});
  const CueSet cues = MakeCueSet(pca, scalars, sheet.diagonal());
  Subspace s = MakeSubspace(pca, cues, MapEstimator(pca, cues), MeasuredPoses(poses.layout(), cues, poses),
                            {{"sheet@mush", 400, "mush"}}, {.rms_budget = 1e-3, .max_budget = 1e-2}, &poses);
  for (const char* plug : {"a.x", "b.x", "c.x", "d.x"})
    s.cues.push_back(
        {.kind = CueDescription::Kind::kScalar, .plug = plug, .stage = "", .mesh = 0, .point = 0});
  s.score = {0.5, 300};
  s.tolerance = 1e-3;
  s.ranges = {MakeTrainedRange("a.x", -1, 1, 0, 0.05)};
  Check(WriteSubspace(s, folder + "/products.kpsa"));
  Subspace before_last_step = s;
  before_last_step.outputs = {{"sheet@mush", 380, "mush", 400}};
  Check(WriteSubspace(before_last_step, folder + "/inner.kpsa"));
  before_last_step.outputs[0].stepped.points = PointsOfTiles(std::vector<Index>{1}, 380);
  Check(WriteSubspace(before_last_step, folder + "/stepped.kpsa"));
  before_last_step.outputs[0].stepped = {{3, 130, 300}, {0, 128, 240, 368}};
  before_last_step.outputs[0].inner = 400;
  Check(WriteSubspace(before_last_step, folder + "/points.kpsa"));
  TileMend mend{0, 1, {130, 131}, {129, 130, 131, 132}, std::vector<float>(12, 1.0f), {}};
  mend.map.assign(12 * s.tiles[0].CuesOf(1).size(), 0.5f);
  Subspace mended = s;
  mended.mends = {mend};
  Check(WriteSubspace(mended, folder + "/mends.kpsa"));
  Subspace limited = s;
  limited.activity_limit = 2.5;
  for (TrainedRange& range : limited.ranges) range.rest = 0.25, range.reach = 0.75;
  Check(WriteSubspace(limited, folder + "/limited.kpsa"));
  s.patches = MakePatchLayout(s.tiles_of_outputs());
  s.patches.costs.assign(s.patches.regions.size(), 0.1);
  s.calibration = {{0.5, 1e-4, 0, 0}};
  s.calibration[0].patches.assign(s.patches.patches, {0.1, 1e-4});
  Check(WriteSubspace(s, folder + "/patches.kpsa"));
  before_last_step.patches = s.patches, before_last_step.calibration = s.calibration;
  Check(WriteSubspace(before_last_step, folder + "/parts.kpsa"));
  s.patches.blends_only = true;
  s.calibration[0].middle = s.calibration[0].score;
  Check(WriteSubspace(s, folder + "/blends.kpsa"));
}

}  // namespace
}  // namespace kpsa::engine

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 2;
  }
  const std::string folder = arguments[1];
  kpsa::engine::WriteCharacters(folder + "/gltf");
  kpsa::engine::WriteCaches(folder + "/caches");
  kpsa::engine::WriteArchives(folder + "/npz");
  kpsa::engine::WriteSubspaces(folder + "/subspace");
  return 0;
}
