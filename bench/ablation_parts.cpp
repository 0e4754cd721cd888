#include "bench/ablation_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/quantity_text.h"
#include "cli/common.h"
#include "cli/interrupt.h"
#include "host/bench/bench.h"
#include "host/bench/tolerance_table.h"
#include "host/checks/playback_times.h"
#include "host/rig_training.h"
#include "report/table.h"

namespace kpsa::engine::ablation {
namespace {

using Clock = std::chrono::steady_clock;

class PartsBench {
 public:
  PartsBench(const std::string& rig, const PartsOptions& options) : options_(options) { flags_.file = rig; }

  Result<std::vector<PartsRow>> Run(std::span<const Part> parts) {
    for (const Part& part : parts) KPSA_RETURN_IF_ERROR(TrainWithout(part));
    Say("bench");
    // Every subspace twice: as it is, and with no frame refused
    std::vector<AccelerationChoice> sides;
    for (const bool every : {false, true}) {
      for (const std::string& path : paths_) {
        sides.emplace_back().subspace = path;
        sides.back().every_frame = every;
      }
    }
    BenchOptions bench;
    bench.runs = options_.runs;
    const Result<std::vector<BenchResult>> results =
        RunBench(OpenerOf(flags_), sides, test_clips_, bench, InterruptWatch());
    if (!results.ok()) return results.status();
    for (std::size_t i = 0; i < rows_.size(); ++i)
      Read((*results)[i], (*results)[rows_.size() + i], &rows_[i]);
    return std::move(rows_);
  }

 private:
  void Say(const std::string& what) const {
    if (options_.progress) options_.progress(what);
  }

  Status TrainWithout(const Part& part) {
    Say(part.what);
    const Result<std::unique_ptr<OpenRig>> open = LoadRigOf(flags_);
    if (!open.ok()) return open.status();
    Rig& rig = (*open)->rig;
    if (rig.accelerate.empty() || rig.accelerate[0].test_clips.empty())
      return Status::Invalid("expected an accelerate entry with a test clip").At({flags_.file});
    const AccelerateEntry entry = rig.accelerate[0];
    test_clips_ = entry.test_clips;
    const Result<std::vector<TrainingClip>> clips = ClipFrames(rig, entry.train_clips);
    if (!clips.ok()) return clips.status();
    const auto given = [](std::size_t of_options, std::int64_t of_rig) {
      return of_options > 0 ? of_options : static_cast<std::size_t>(of_rig);
    };
    TrainOptions options;
    options.samples = given(options_.samples, entry.train_samples.value_or(0));
    options.calibration_poses = given(options_.calibration_poses, entry.calibration_poses);
    options.key_points = options_.key_points;
    options.tolerance = entry.tolerance;
    options.violation_rate = entry.violation_rate;
    part.change(&options);
    const Clock::time_point begin = Clock::now();
    Result<Subspace> trained = Train(MakeTrainingRig(&rig, entry), *clips, options);
    if (!trained.ok()) return Status(trained.status()).At({flags_.file});
    PartsRow row;
    row.what = part.what;
    row.training_seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    const auto subspace = std::make_shared<const Subspace>(std::move(*trained));
    Describe(*subspace, &row);
    const Calibration calibration = Calibrate(subspace->calibration, subspace->tolerance,
                                              subspace->violation_rate, subspace->blend_start);
    row.held_out_hits = ExpectedHitRate(calibration);
    const Result<PlaybackTimes> played =
        TimePlayback(OpenerOf(flags_), entry, subspace, *clips, InterruptWatch());
    if (!played.ok()) return played.status();
    row.expected_speedup =
        SpeedupWithMisses(played->full_ms, played->hit_ms, row.held_out_hits, calibration.threshold.tau >= 0);
    paths_.push_back(fmt::format("{}/{}.kpsa", options_.folder, rows_.size()));
    rows_.push_back(std::move(row));
    return WriteSubspace(*subspace, paths_.back());
  }

  static void Describe(const Subspace& subspace, PartsRow* row) {
    for (const CueDescription& cue : subspace.cues) {
      row->cue_points += cue.kind == CueDescription::Kind::kPoint;
      row->cue_scalars += cue.kind == CueDescription::Kind::kScalar;
      row->cue_products += cue.kind == CueDescription::Kind::kProduct;
    }
    row->by_tile = subspace.soft_cache.factor.size() == 0;
    row->in_parts = subspace.patches.tiles > 0;
  }

  static void Read(const BenchResult& own, const BenchResult& every, PartsRow* row) {
    row->bytes_per_point = own.bytes_per_point;
    row->hits = static_cast<double>(own.hits) / static_cast<double>(std::max<std::size_t>(1, own.frames));
    row->ms = own.accelerated_ms, row->full_ms = own.full_ms;
    row->speedup_on_hits = own.speedup_on_hits(), row->speedup = own.speedup();
    row->accepts = !own.promise.worst_clip.empty();
    row->largest_accepted = own.promise.worst_error / own.promise.tolerance;
    row->kept = own.promise.kept();
    row->rms = 100 * every.error_rms / every.diagonal;
    row->max = 100 * every.error_max / every.diagonal;
  }

  const PartsOptions& options_;
  Flags flags_;
  std::vector<std::string> test_clips_, paths_;
  std::vector<PartsRow> rows_;
};

Table PartsTable(std::span<const PartsRow> rows) {
  Table table({"", ">points", ">scalars", ">products", ">bytes a point", ">held-out hits", ">expected",
               ">test hits", ">us a frame", ">speed of hits", ">misses included", ">largest error", "promise",
               ">RMS / max %, every frame", ">training"});
  for (const PartsRow& row : rows) {
    const std::string marks = row.in_parts  ? " (of tiles, misses of parts)"
                              : row.by_tile ? " (of tiles)"
                                            : "";
    table.Row({row.what + marks, std::to_string(row.cue_points), std::to_string(row.cue_scalars),
               std::to_string(row.cue_products), fmt::format("{:.0f}", row.bytes_per_point),
               fmt::format("{:.1f} %", 100 * row.held_out_hits), RatioText(row.expected_speedup),
               fmt::format("{:.1f} %", 100 * row.hits), fmt::format("{:.1f}", 1000 * row.ms),
               RatioText(row.speedup_on_hits), RatioText(row.speedup),
               row.accepts ? fmt::format("{:.2f}", row.largest_accepted) : "-", row.kept ? "kept" : "BROKEN",
               fmt::format("{:.4f} / {:.3f}", row.rms, row.max),
               fmt::format("{:.0f} s", row.training_seconds)});
  }
  return table;
}

}  // namespace

std::vector<Part> Parts() {
  return {
      {"everything", [](TrainOptions*) {}},
      {"paper mode", [](TrainOptions* options) { options->mode = EstimatorMode::kPaper; }},
      {"no world matrices", [](TrainOptions* options) { options->without.relative_matrices = true; }},
      {"no products as cues", [](TrainOptions* options) { options->without.cue_products = true; }},
      {"no hinges", [](TrainOptions* options) { options->without.hinges = true; }},
      {"no products in tiles, no doubt",
       [](TrainOptions* options) {
         options->without.tile_products = true;
         options->may_have_cues_by_tile = false;  // which nothing but doubts can judge
       }},
      {"no cues of tiles", [](TrainOptions* options) { options->may_have_cues_by_tile = false; }},
      {"no misses of parts", [](TrainOptions* options) { options->without.patches = true; }},
      {"all doubts alike", [](TrainOptions* options) { options->without.trust = true; }},
      {"misses not priced", [](TrainOptions* options) { options->without.miss_costs = true; }},
  };
}

Result<std::vector<PartsRow>> CompareParts(const std::string& rig, std::span<const Part> parts,
                                           const PartsOptions& options) {
  return PartsBench(rig, options).Run(parts);
}

std::string PartsText(std::span<const PartsRow> rows) { return PartsTable(rows).Text(); }

std::string PartsMarkdown(std::span<const PartsRow> rows) { return PartsTable(rows).Markdown(); }

}  // namespace kpsa::engine::ablation
