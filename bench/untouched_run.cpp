#include "bench/untouched_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "bench/program.h"
#include "cli/common.h"
#include "files/file.h"
#include "gltf/import.h"
#include "report/table.h"

namespace kpsa::engine::untouched {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::uint64_t kMostBytes = 1u << 28;

Result<Json> ReadJson(const std::string& path) {
  const Result<std::vector<std::uint8_t>> bytes = ReadFileBytes(path, kMostBytes);
  if (!bytes.ok()) return bytes.status();
  Json document = Json::parse(bytes->begin(), bytes->end(), nullptr, false);
  if (!document.is_object()) return Status::Invalid("is not what kpsa --json prints").At({path});
  return document;
}

double NumberOrNan(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

Status ReadFigures(const std::string& trained, const std::string& benched, Row* row) {
  const Result<Json> training = ReadJson(trained), bench = ReadJson(benched);
  if (!training.ok()) return training.status();
  if (!bench.ok()) return bench.status();
  try {
    row->training_seconds = training->at("seconds").get<double>();
    row->predicted = NumberOrNan(training->at("predicted").at("speedup"));
    row->held_out_hits = training->at("calibration").at("hit_rate").get<double>();
    row->test_clip = bench->at("clip").get<std::string>();
    row->tolerance = bench->at("tolerance").get<double>();
    row->hits = bench->at("hit_rate").get<double>();
    row->speedup_on_hits = NumberOrNan(bench->at("speedup_on_hits"));
    row->speedup = NumberOrNan(bench->at("speedup"));
    row->points = bench->at("output_points").get<std::size_t>();
    row->accepts = !bench->at("promise").at("worst_accepted").is_null();
    const double error = bench->at("error").at("max").get<double>();
    row->largest_error = error < 0 ? std::numeric_limits<double>::infinity() : error / row->tolerance;
    row->kept = bench->at("promise").at("kept").get<bool>();
  } catch (const Json::exception& error) {
    return Status::Invalid("{}", error.what()).At({benched});
  }
  return Status();
}

Status CountJointsAndMorphs(const std::string& path, Row* row) {
  const Result<gltf::Character> character = gltf::LoadGltf(path);
  if (!character.ok()) return character.status();
  for (const Index node : character->MeshNodes()) {
    row->morphs += character->meshes[character->nodes[node].mesh].targets.size();
  }
  std::vector<bool> is_joint(character->nodes.size());
  for (const gltf::Skin& skin : character->skins) {
    for (const Index joint : skin.joints) is_joint[joint] = true;
  }
  row->joints = static_cast<std::size_t>(std::count(is_joint.begin(), is_joint.end(), true));
  return Status();
}

Table MakeTable(std::span<const Row> rows) {
  Table table({"character", ">points", ">joints", ">morphs", ">training", ">memory", ">tolerance",
               ">held-out hits", "test clip", ">hits", ">speed of hits", ">predicted", ">misses included",
               ">largest error", "promise"});
  for (const Row& row : rows) {
    table.Row({row.character, Thousands(row.points), std::to_string(row.joints), std::to_string(row.morphs),
               fmt::format("{:.0f} s", row.training_seconds),
               fmt::format("{:.1f} GB", 1e-9 * static_cast<double>(row.training_bytes)),
               LengthText(row.tolerance), fmt::format("{:.0f} %", 100 * row.held_out_hits), row.test_clip,
               fmt::format("{:.0f} %", 100 * row.hits), RatioText(row.speedup_on_hits),
               RatioText(row.predicted), RatioText(row.speedup),
               row.accepts ? fmt::format("{:.2f}", row.largest_error) : "-", row.kept ? "kept" : "BROKEN"});
  }
  return table;
}

}  // namespace

Result<Row> TryCharacter(const std::string& program, const std::string& name, const std::string& character,
                         const std::string& folder, const std::vector<std::string>& training) {
  Row row;
  row.character = name;
  KPSA_RETURN_IF_ERROR(CountJointsAndMorphs(character, &row));
  const std::string stem = folder + "/" + fs::path(character).stem().string();
  const std::string rig = stem + ".yaml", trained = stem + ".train.json", benched = stem + ".bench.json";
  KPSA_RETURN_IF_ERROR(
      RunProgram({program, "init", character, "-o", rig, "--force", "-q"}, "/dev/null").status());
  std::vector<std::string> train = {program, "train", rig, "--force", "-q", "--json"};
  train.insert(train.end(), training.begin(), training.end());
  const Result<ProgramCost> cost = RunProgram(std::move(train), trained);
  if (!cost.ok()) return cost.status();
  row.training_bytes = cost->peak_bytes;
  KPSA_RETURN_IF_ERROR(RunProgram({program, "bench", rig, "-q", "--json"}, benched).status());
  KPSA_RETURN_IF_ERROR(ReadFigures(trained, benched, &row));
  return row;
}

std::string RowsText(std::span<const Row> rows) { return MakeTable(rows).Text(); }

std::string RowsMarkdown(std::span<const Row> rows) { return MakeTable(rows).Markdown(); }

}  // namespace kpsa::engine::untouched
