#include "report/train_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/quantity_text.h"
#include "base/text.h"
#include "kpsa/training/poses.h"
#include "report/json_text.h"
#include "report/table.h"
#include "report/tolerance_text.h"

namespace kpsa::engine {

std::size_t TrainResult::points() const {
  std::size_t points = 0;
  for (const SubspaceOutput& output : subspace->outputs) points += output.points;
  return points;
}

namespace {

// Tolerances of the worst accepted pose, that are no matter of how sharp a crease is.
constexpr double kFarOff = 5;

ToleranceWords WordsOf(const TrainResult& r) {
  return {"poses", "more --samples or narrower controls help", r.subspace->of_light()};
}

}  // namespace

std::string TrainJson(const TrainResult& r) {
  nlohmann::ordered_json poses = nlohmann::ordered_json::array(), regions = poses;
  for (const auto& pose : r.check.worst_poses)
    poses.push_back(
        {{"controls", pose.controls}, {"region", pose.region}, {"max", pose.max}, {"rms", pose.rms}});
  for (const auto& region : r.check.worst_regions)
    regions.push_back({{"name", region.name}, {"rms", region.rms}, {"max", region.max}});
  nlohmann::ordered_json kinds = nlohmann::ordered_json::array();
  for (const Calibration::Kind& kind : r.calibration.kinds) {
    kinds.push_back({{"kind", PoseKindName(static_cast<PoseKind>(kind.kind))},
                     {"poses", kind.poses},
                     {"hits", kind.hits},
                     {"accepted", kind.accepted},
                     {"violations", kind.violations},
                     {"rate_at_most", kind.upper_bound}});
  }
  const auto training = nlohmann::ordered_json::parse(r.subspace->training);
  const nlohmann::ordered_json document =
      nlohmann::ordered_json{{"schema", "kpsa.train/1"},
                             {"subspace", r.path},
                             {"units", r.subspace->units},
                             {"points", r.points()},
                             {"cues", r.subspace->cues.size()},
                             {"rows", r.subspace->rows()},
                             {"modes", r.subspace->modes},
                             {"trained_on",
                              {{"clips", r.record.clips},
                               {"clip_poses", r.record.clip_poses},
                               {"sampled_poses", r.record.sampled_poses}}},
                             {"seconds", r.seconds},
                             {"limited", r.record.limited},
                             {"at_rest", r.record.at_rest},
                             {"by_clips_alone", r.record.by_clips_alone},
                             {"held_out",
                              {{"poses", r.record.calibration_poses},
                               {"rms", r.record.held_out_rms},
                               {"max", r.record.held_out_max}}},
                             {"motion", {{"rms", r.record.motion_rms}}},
                             {"tried", training["tried"]},
                             {"rules", training["rules"]},
                             {"separation", training["separation"]},
                             {"calibration",
                              {{"tolerance", r.subspace->tolerance},
                               {"violation_rate", r.calibration.alpha},
                               {"attainable_rate", r.calibration.attainable_alpha},
                               {"hit_rate", r.hit_rate()},
                               {"hit_rate_of", r.calibration.near_clips > 0 ? "clips" : "sampled"},
                               {"violations", r.calibration.violations},
                               {"severe", r.calibration.severe},
                               {"violation_rate_at_most", r.calibration.upper_bound},
                               {"kinds", kinds},
                               {"worst_accepted", r.record.worst.error},
                               {"worst_pose", r.worst_path},
                               {"warning", r.calibration.warning}}},
                             {"check",
                              {{"poses", r.check.poses},
                               {"reconstructed", r.check.reconstructed},
                               {"rms", r.check.rms},
                               {"max", r.check.max},
                               {"worst_poses", poses},
                               {"worst_regions", regions}}},
                             {"predicted",
                              {{"clip_frames", r.check.clip_frames},
                               {"full_ms", r.check.full_ms},
                               {"accelerated_ms", r.check.accelerated_ms},
                               {"speedup", r.speedup()}}},
                             {"tolerances", ToleranceJson<nlohmann::ordered_json>(r.tolerances, WordsOf(r))}};
  return JsonText(document);
}

namespace {

// The first ones, and how many more there are.
std::string FirstNames(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 6;
  return fmt::format(
      "{}{}",
      fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(std::min(kNamed, names.size())),
                ", "),
      names.size() > kNamed ? fmt::format(" and {} more", names.size() - kNamed) : "");
}

// JSON's quotes are YAML's.
std::string QuotedYaml(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string WorstPoseText(const TrainingRecord& record, const std::string& subspace) {
  std::string text = fmt::format(
      "# The accepted pose that is farthest off among those that {} was calibrated with ({}).\nkpsa: 1\n"
      "units: {{length: m, angle: rad}}\nclip: {}\n",
      subspace, record.worst.kind, QuotedYaml(record.worst.clip));
  if (!record.worst.clip.empty()) text += fmt::format("time: {}s\n", record.worst.time);
  text += record.worst.controls.empty() ? "pose: {}\n" : "pose:\n";
  for (const auto& [plug, value] : record.worst.controls)
    text += fmt::format("  {}: {}\n", QuotedYaml(plug), value);
  return text;
}

std::string TrainText(const TrainResult& r) {
  const bool light = r.subspace->of_light();
  const auto error = [&](double value) { return ErrorText(value, light); };
  std::string text;
  text +=
      fmt::format("{}: {}, {} ({} numbers), {} modes, {:.1f} s\n", r.path, Plural(r.points(), "point"),
                  Plural(r.subspace->cues.size(), "cue"), r.subspace->rows(), r.subspace->modes, r.seconds);
  text += fmt::format("trained on {} of {} and {}\n", Plural(r.record.clip_poses, "frame"),
                      r.record.clips.empty() ? "no clip" : fmt::format("{}", fmt::join(r.record.clips, ", ")),
                      Plural(r.record.sampled_poses, "sampled pose"));
  text +=
      fmt::format("held out: {}: RMS {}, max {}; motion RMS {}\n", Plural(r.record.calibration_poses, "pose"),
                  error(r.record.held_out_rms), error(r.record.held_out_max), error(r.record.motion_rms));
  if (const std::vector<std::string>& left = r.record.at_rest; !left.empty())
    text += fmt::format(
        "left at rest, as no clip moves them, and following them costs much or fails (frames that move them "
        "miss): {}\n",
        FirstNames(left));
  if (const std::vector<std::string>& alone = r.record.by_clips_alone; !alone.empty())
    text += fmt::format(
        "moved by clips and by no control, so known as these clips do it alone: {}; another clip that parts "
        "what moves together here may be wrong and hit: name them under `controls:`, as kpsa init does\n",
        FirstNames(alone));
  if (!r.record.limited.empty()) text += fmt::format("in the time and memory given: {}\n", r.record.limited);
  for (const TrainingRecord::Tried& one : r.record.tried) {
    text += fmt::format(
        "{} cues {}: {} ({} numbers); a frame is expected to cost {:.2g} of a full one, {:.3g} % of new "
        "poses miss\n",
        one.taken ? "took" : "tried", one.what, one.cues, one.rows, one.cost, 100 * one.misses);
  }
  for (const TrainingRecord::Rule& one : r.record.rules) {
    text += fmt::format("{} to judge by {}: {:.2g} of a full frame, measured points aside, {:.3g} % miss\n",
                        one.taken ? "took" : "tried", one.what, one.cost, 100 * one.misses);
  }
  if (const TrainingRecord::Separation& told = r.record.separation;
      told.beyond > 0 && told.beyond < told.poses) {
    text += fmt::format(
        "of {}, {} beyond {}: told apart by likeness {:.2f}, by doubts of tiles {:.2f} (area under ROC)\n",
        Plural(told.poses, "held-out pose"), told.beyond, error(r.subspace->tolerance), told.likeness,
        told.doubts);
  }
  // What these poses can promise, where that is less than what was asked for
  std::size_t fewest = r.calibration.poses;
  for (const Calibration::Kind& kind : r.calibration.kinds) fewest = std::min(fewest, kind.poses);
  const double promised = r.calibration.attainable_alpha;
  text += fmt::format("calibrated for {}{} in {:.4g} % of poses{}: {:.1f} % of {} hit\n",
                      light ? "an RMS of " : "", error(r.subspace->tolerance), 100 * (1 - promised),
                      promised > r.calibration.alpha
                          ? fmt::format(" ({:.4g} % was asked for, which {}{} cannot promise)",
                                        100 * (1 - r.calibration.alpha), Plural(fewest, "held-out pose"),
                                        r.calibration.kinds.size() > 1 ? " of a kind" : "")
                          : "",
                      100 * r.hit_rate(),
                      r.calibration.near_clips > 0 ? "new poses made of the clips" : "sampled poses");
  for (const Calibration::Kind& kind : r.calibration.kinds) {
    text += fmt::format("  {:<18} {:>5} poses: {:5.1f} % hit, {} beyond (at most {:.2g} %, 9 in 10 times)\n",
                        PoseKindName(static_cast<PoseKind>(kind.kind)), kind.poses,
                        100.0 * static_cast<double>(kind.hits) / static_cast<double>(kind.poses),
                        kind.violations, 100 * kind.upper_bound);
  }
  if (std::isfinite(r.subspace->activity_limit))
    text +=
        "poses with many controls far out are wrong unnoticed: where a quarter more is out of rest at once "
        "than in "
        "the clips, frames miss\n";
  if (!r.worst_path.empty()) {
    const double tolerances = r.subspace->tolerance > 0 ? r.record.worst.error / r.subspace->tolerance : 0;
    text += fmt::format(
        "worst that is accepted: {}{} ({}{}); {} replays it\n", error(r.record.worst.error),
        tolerances > 1 ? fmt::format(", {:.1f} tolerances", tolerances) : "", r.record.worst.kind,
        r.record.worst.clip.empty() ? "" : fmt::format(", over {}", r.record.worst.clip), r.worst_path);
    if (tolerances > kFarOff)
      text += fmt::format(
          "that is {:.0f} tolerances: look at it, and at the controls it moves, before this is used\n",
          tolerances);
  }
  if (r.check.poses > 0) {
    text += fmt::format(
        "tried on {}{}: full {:.3f} ms, accelerated {:.3f} ms; predicted speedup "
        "{:.1f}x with these hits\n",
        Plural(r.check.poses, "new pose"),
        r.check.clip_frames > 0
            ? fmt::format(", timed on {} of the clips", Plural(r.check.clip_frames, "frame"))
            : "",
        r.check.full_ms, r.check.accelerated_ms, r.speedup());
    // What the user can do about it
    if (r.speedup() < 1) {
      const bool slow_anyway =
          !r.tolerances.rows.empty() &&
          std::none_of(r.tolerances.rows.begin(), r.tolerances.rows.end(),
                       [](const ToleranceRow& row) { return row.hits > 0 && row.speedup >= 1; });
      text += r.hit_rate() < 0.5 && !slow_anyway
                  ? "slower than the full evaluation, as so few poses hit: a larger --tolerance, more "
                    "--samples, or narrower "
                    "controls help\n"
                  : fmt::format(
                        "slower than the full evaluation, which costs {:.3f} ms: leave this one as it "
                        "is\n",
                        r.check.full_ms);
    }
    Table poses({"worst of these poses", "where", ">max", ">RMS"});
    for (const auto& pose : r.check.worst_poses)
      poses.Row({pose.controls, pose.region, error(pose.max), error(pose.rms)});
    Table regions({"worst regions", ">RMS", ">max"});
    for (const auto& region : r.check.worst_regions)
      regions.Row({region.name, error(region.rms), error(region.max)});
    text += "\n" + poses.Text() + "\n" + regions.Text();
  }
  if (!r.tolerances.rows.empty()) text += "\n" + ToleranceText(r.tolerances, WordsOf(r));
  text += fmt::format("\nnext: kpsa bench {}{}\n", r.rig, r.own_path ? "" : " --kpsa " + r.path);
  return text;
}

}  // namespace kpsa::engine
