#include "report/file_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "base/quantity_text.h"
#include "files/npz.h"
#include "files/obj.h"
#include "files/point_cache.h"
#include "files/suffix.h"
#include "files/weights_json.h"
#include "gltf/document.h"
#include "kpsa/subspace.h"
#include "kpsa/training_record.h"
#include "report/character_facts.h"

namespace kpsa::engine {
namespace {

using Cell = FactTable::Cell;

Cell Count(std::size_t count) { return static_cast<std::uint64_t>(count); }

std::uint64_t FileSize(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

// The box around x y z values: "0.1 x 0.3 x 0.2 m", or that some are not finite.
std::string BoxText(const std::vector<float>& xyz, const char* unit = " m") {
  double low[3], high[3];
  for (int c = 0; c < 3; ++c) low[c] = std::numeric_limits<double>::infinity(), high[c] = -low[c];
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double v = static_cast<double>(xyz[i + c]);
      if (!std::isfinite(v)) return "values that are not finite";
      low[c] = std::min(low[c], v), high[c] = std::max(high[c], v);
    }
  }
  return xyz.empty() ? "empty"
                     : fmt::format("{:.4g} x {:.4g} x {:.4g}{}", high[0] - low[0], high[1] - low[1],
                                   high[2] - low[2], unit);
}

const char* NpzTypeName(NpzType type) {
  static const char* const kNames[] = {"float32", "float64", "int8",   "int16",  "int32", "int64",
                                       "uint8",   "uint16",  "uint32", "uint64", "bool"};
  return kNames[static_cast<std::size_t>(type)];
}

// Only where there are any: few files have them.
void AddVrmFacts(const gltf::Character& character, const std::vector<std::string>& names, FileFacts* facts) {
  if (!character.expressions.empty()) {
    static const char* const kKinds[] = {"", "blink", "lookAt", "mouth"};
    FactTable expressions{"expressions", {"expression", "kind", ">morph targets"}, {}};
    for (const gltf::Expression& e : character.expressions)
      expressions.rows.push_back(
          {e.name, std::string(kKinds[static_cast<int>(e.kind)]), Count(e.binds.size())});
    facts->tables.push_back(std::move(expressions));
  }
  if (!character.constraints.empty()) {
    static const char* const kTypes[] = {"roll", "aim", "rotation"};
    FactTable constraints{"constraints", {"node", "constraint", "source", ">weight"}, {}};
    for (const gltf::NodeConstraint& c : character.constraints) {
      constraints.rows.push_back(
          {names[c.node], std::string(kTypes[static_cast<int>(c.type)]), names[c.source], c.weight});
    }
    facts->tables.push_back(std::move(constraints));
  }
}

}  // namespace

Result<FileFacts> InspectCharacter(const std::string& path, double fps) {
  const Result<gltf::Character> character = gltf::LoadGltf(path);
  if (!character.ok()) return character.status();
  FileFacts facts;
  facts.kind = "character";
  facts.facts = {{"bytes", FileSize(path)},
                 {"nodes", Count(character->nodes.size())},
                 {"skins", Count(character->skins.size())},
                 {"materials", Count(character->materials.size())}};
  FactTable meshes{
      "meshes",
      {"mesh node", ">primitives", ">vertices", ">triangles", ">joints", ">influences", ">targets"},
      {}};
  const std::vector<std::string> names = character->UniqueNames();
  std::uint64_t memory = 0;
  for (Index n : character->MeshNodes()) {
    const gltf::Node& node = character->nodes[n];
    const gltf::Mesh& mesh = character->meshes[node.mesh];
    std::size_t triangles = 0, most = 0;
    for (const gltf::Primitive& primitive : mesh.primitives) triangles += primitive.triangles.size() / 3;
    if (mesh.skinned()) {
      for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        most = std::max(most, mesh.influence_rows().row(v).size());
    }
    memory += mesh.positions.size() * 4 + mesh.influences.size() * sizeof(gltf::Influence);
    for (const gltf::MorphTarget& target : mesh.targets)
      memory += target.deltas.size() * 4 + target.vertices.size() * 4;
    meshes.rows.push_back({names[n], Count(mesh.primitives.size()), Count(mesh.vertex_count()),
                           Count(triangles),
                           Count(node.skin == kNoIndex ? 0 : character->skins[node.skin].joints.size()),
                           Count(most), Count(mesh.targets.size())});
  }
  FactTable clips{"clips", {"clip", ">seconds", ">frames", ">channels", ">keys"}, {}};
  for (const gltf::Clip& clip : character->clips) {
    std::size_t keys = 0;
    for (const gltf::Channel& channel : clip.channels) {
      keys += channel.times.size();
      memory += (channel.times.size() + channel.values.size()) * 8;
    }
    clips.rows.push_back(
        {clip.id, clip.duration, FrameCount(clip.duration, fps), Count(clip.channels.size()), Count(keys)});
  }
  facts.facts.emplace_back("memory bytes", memory);
  facts.tables = {TreeFacts(*character), std::move(meshes), MorphFacts(*character), std::move(clips),
                  MaterialFacts(*character)};
  AddVrmFacts(*character, names, &facts);
  facts.notes = character->warnings;
  return facts;
}

Result<FileFacts> InspectNpz(const std::string& path) {
  // What is worth looking at: a deflated archive may claim a thousand times its size
  constexpr std::uint64_t kLeastBudget = std::uint64_t{256} << 20, kBudgetOfSize = 16,
                          kMostBudget = std::uint64_t{8} << 30;
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(path, unknown);
  const std::uint64_t budget =
      unknown
          ? kLeastBudget
          : std::clamp(kBudgetOfSize * std::min<std::uint64_t>(size, kMostBudget), kLeastBudget, kMostBudget);
  const Result<Npz> npz = ReadNpz(path, budget);
  if (!npz.ok()) return npz.status();
  FileFacts facts;
  facts.kind = "npz";
  facts.facts = {{"bytes", FileSize(path)}};
  FactTable arrays{"arrays", {"array", "type", "shape", "box of all frames"}, {}};
  for (const NpzArray& array : npz->arrays) {
    const bool vertices = (array.shape.size() == 2 || array.shape.size() == 3) && array.shape.back() == 3;
    arrays.rows.push_back({array.name, std::string(NpzTypeName(array.type)),
                           fmt::format("({})", fmt::join(array.shape, ", ")),
                           vertices ? BoxText(array.Floats()) : ""});
    if (array.name == "times" && array.size() > 0) {
      const std::vector<double> times = array.Doubles();
      facts.facts.emplace_back("frames", Count(times.size()));
      facts.facts.emplace_back("first time", times.front());
      facts.facts.emplace_back("last time", times.back());
    }
  }
  facts.tables = {std::move(arrays)};
  return facts;
}

Result<FileFacts> InspectObj(const std::string& path) {
  const Result<std::vector<ObjShape>> shapes = ReadObj(path);
  if (!shapes.ok()) return shapes.status();
  FileFacts facts;
  facts.kind = "obj";
  facts.facts = {{"bytes", FileSize(path)}};
  FactTable table{"shapes", {"shape", ">vertices", "box"}, {}};
  for (const ObjShape& shape : *shapes)
    table.rows.push_back({shape.name, Count(shape.positions.size() / 3), BoxText(shape.positions, "")});
  facts.tables = {std::move(table)};
  return facts;
}

Result<FileFacts> InspectPointCache(const std::string& path, double fps) {
  const bool pc2 = FileSuffix(path) == ".pc2";
  const Result<PointCache> cache = pc2 ? ReadPc2(path, fps) : ReadMdd(path, fps);
  if (!cache.ok()) return cache.status();
  FileFacts facts;
  facts.kind = pc2 ? "pc2" : "mdd";
  facts.facts = {{"bytes", FileSize(path)}, {"frames", Count(cache->times.size())}};
  if (!cache->times.empty())
    facts.facts.insert(facts.facts.end(),
                       {{"first time", cache->times.front()}, {"last time", cache->times.back()}});
  for (const PointCacheMesh& mesh : cache->meshes) {
    facts.facts.emplace_back("vertices", Count(mesh.vertex_count));
    facts.facts.emplace_back("box of all frames", BoxText(mesh.frames));
  }
  return facts;
}

Result<FileFacts> InspectSubspace(const std::string& path) {
  const Result<Subspace> subspace = ReadSubspace(path);
  if (!subspace.ok()) return subspace.status();
  FileFacts facts;
  facts.kind = "subspace";
  std::uint64_t memory = subspace->soft_cache.factor.size() * 4 + subspace->cue_mean.size() * 16;
  for (const TileMap& tiles : subspace->tiles) memory += tiles.bytes();
  facts.facts = {{"bytes", FileSize(path)},
                 {"estimator",
                  std::string(subspace->mode == EstimatorMode::kMap ? "MAP" : "least squares (paper mode)")},
                 {"modes", Count(subspace->modes)},
                 {"components", static_cast<std::uint64_t>(subspace->components)},
                 {"space", subspace->space.empty() ? "world or mesh" : subspace->space},
                 {"tolerance", LengthText(subspace->tolerance)},
                 {"violation rate", subspace->violation_rate},
                 {"calibration poses", Count(subspace->calibration.size())},
                 {"rig", subspace->rig_hash},
                 {"memory bytes", memory},
                 {"training", TrainingText(*subspace)}};
  if (subspace->of_inner()) {
    std::size_t stepped = 0;
    for (const SubspaceOutput& output : subspace->outputs) stepped += output.stepped.points.size();
    facts.facts.emplace_back(
        "reconstructs", stepped == 0 ? std::string("points before the last step")
                                     : fmt::format("points, and {} of them before the last step", stepped));
  }
  if (std::isfinite(subspace->activity_limit))
    facts.facts.emplace_back("most at once", fmt::format("{:.3g}, of squared shares of what signals reached",
                                                         subspace->activity_limit));
  std::size_t mended = 0;
  for (const TileMend& mend : subspace->mends) mended += mend.points.size();
  if (mended > 0) facts.facts.emplace_back("mended points", fmt::format("{}, by their last step", mended));
  const TrainingRecord record = ParseTraining(subspace->training);
  facts.facts.insert(
      facts.facts.end(),
      {{"trained on",
        fmt::format("{} of {}, {}", Plural(record.clip_poses, "frame"),
                    record.clips.empty() ? "no clip" : fmt::format("{}", fmt::join(record.clips, ", ")),
                    Plural(record.sampled_poses, "sampled pose"))},
       {"held-out RMS", LengthText(record.held_out_rms)},
       {"held-out max", LengthText(record.held_out_max)},
       {"motion RMS", LengthText(record.motion_rms)}});
  // What a frame reads, and what of the cues and modes its tiles keep (kpsa/tiles.h)
  FactTable outputs{"outputs", {"points", ">count", ">bytes/point", ">rank", ">cue rows"}, {}};
  for (std::size_t m = 0; m < subspace->outputs.size(); ++m) {
    const TileMap& tiles = subspace->tiles[m];
    outputs.rows.push_back({subspace->outputs[m].name, Count(subspace->outputs[m].points),
                            tiles.bytes_per_point(), tiles.mean_rank(), tiles.mean_cues()});
  }
  FactTable cues{"cues", {"kind", "where", ">point"}, {}};
  for (const CueDescription& cue : subspace->cues) {
    const bool scalar = cue.kind != CueDescription::Kind::kPoint;
    cues.rows.push_back({std::string(cue.kind == CueDescription::Kind::kProduct ? "product"
                                     : scalar                                   ? "scalar"
                                                                                : "point"),
                         CueName(*subspace, cue), scalar ? Cell(std::string()) : Count(cue.point)});
  }
  FactTable ranges{"trained ranges", {"plug", ">min", ">max"}, {}};
  for (const TrainedRange& range : subspace->ranges) ranges.rows.push_back({range.plug, range.lo, range.hi});
  facts.tables = {std::move(outputs), std::move(cues), std::move(ranges)};
  return facts;
}

Result<FileFacts> InspectWeights(const std::string& path) {
  const Result<WeightFile> file = ReadWeightFile(path);
  if (!file.ok()) return file.status();
  FileFacts facts;
  facts.kind = "weights";
  facts.facts = {{"mesh", file->mesh}, {"points", Count(file->points)}};
  FactTable maps{"maps", {"map", ">entries", ">default", ">min", ">max"}, {}};
  for (const auto& map : file->maps) {
    const auto [low, high] = std::minmax_element(map.values.begin(), map.values.end());
    const double none = static_cast<double>(map.default_value);
    maps.rows.push_back({map.name, Count(map.values.size()), none,
                         map.values.empty() ? none : static_cast<double>(*low),
                         map.values.empty() ? none : static_cast<double>(*high)});
  }
  facts.tables = {std::move(maps)};
  return facts;
}

Result<FileFacts> InspectFile(const std::string& path, double fps) {
  const std::string suffix = FileSuffix(path);
  if (suffix == ".glb" || suffix == ".gltf" || suffix == ".vrm") return InspectCharacter(path, fps);
  if (suffix == ".npz") return InspectNpz(path);
  if (suffix == ".obj") return InspectObj(path);
  if (suffix == ".pc2" || suffix == ".mdd") return InspectPointCache(path, fps);
  if (suffix == ".kpsa") return InspectSubspace(path);
  if (suffix == ".json") return InspectWeights(path);
  return Status::Usage(
             "expected a file that ends in .glb, .gltf, .vrm, .yaml, .npz, .obj, .pc2, .mdd, .kpsa or .json "
             "(weight maps)")
      .At({path});
}

}  // namespace kpsa::engine
